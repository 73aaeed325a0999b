"""How far the same question has the same answer: spreads over samples and over wordings."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, slots=True, kw_only=True)
class SampleSpread:
    """One number a sample, over everything that was asked in it.

    Attributes:
        mean: Over the samples.
        sd: Between the samples (divided by n - 1), None for a single one.
        values: One a sample, in their order.
    """

    mean: float
    sd: float | None
    values: tuple[float, ...]


def spread_of(values: Sequence[float]) -> SampleSpread | None:
    """Mean and standard deviation between samples, None without values."""
    if not values:
        return None
    sd = float(np.std(values, ddof=1)) if len(values) > 1 else None
    return SampleSpread(mean=float(np.mean(values)), sd=sd, values=tuple(values))


def within_sd(groups: Iterable[Sequence[float]]) -> float | None:
    """The pooled standard deviation of values within their groups; None without a repeat.

    Each group is one scenario with a value a sample: what differs between scenarios is left out.
    """
    repeated = [group for group in groups if len(group) > 1]
    if not repeated:
        return None
    squares = sum(float(np.var(group, ddof=1)) * (len(group) - 1) for group in repeated)
    return math.sqrt(squares / sum(len(group) - 1 for group in repeated))


@dataclass(frozen=True, slots=True, kw_only=True)
class Robustness:
    """One contestant over all scenarios with at least two wordings that were measured.

    Attributes:
        scenarios: How many those are.
        wordings: How many wordings they have together.
        within_m: The pooled standard deviation within a scenario.
        median_range_m: The median over scenarios of the largest less the smallest value.
    """

    scenarios: int
    wordings: int
    within_m: float
    median_range_m: float


def measure_robustness(values: Mapping[str, Sequence[float]]) -> Robustness | None:
    """The spread within scenarios, None where no scenario has two wordings.

    Args:
        values: By scenario, one for each of its wordings.
    """
    several = [wordings for wordings in values.values() if len(wordings) > 1]
    within_m = within_sd(several)
    if within_m is None:
        return None
    return Robustness(
        scenarios=len(several),
        wordings=sum(len(wordings) for wordings in several),
        within_m=within_m,
        median_range_m=float(np.median([np.ptp(wordings) for wordings in several])),
    )
