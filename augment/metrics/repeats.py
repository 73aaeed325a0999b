"""How far the same question has the same answer: spreads over repeated samples. Pure."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
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
