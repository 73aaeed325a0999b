"""Contestants against each other on the same scenarios: a paired test, an interval, and Holm.

Scenarios are the unit: two objects of one scenario are no two observations, and neither are two
samples of one cell. Values in metres.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

FEWEST_PAIRS = 6
"""With fewer pairs that differ no two-sided signed-rank test can come below 0.05 (2 / 2^5)."""

# Resamples of the scenarios, and the level of the intervals from them.
ROUNDS = 10_000
LEVEL = 0.95

_ROUNDS_AT_ONCE = 64
"""For a thousand scenarios half a megabyte of drawn numbers."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PairedComparison:
    """One contestant against another, over the scenarios that both have a value for.

    Attributes:
        scenarios: How many those are.
        median_m: The median of the differences, first minus second; negative where the first
            is nearer to the references.
        low_m, high_m: The percentile interval of the median by the bootstrap over scenarios.
        p: Of Wilcoxon's signed-rank test, two-sided; None where too few pairs differ.
        p_holm: The same, adjusted for all comparisons that were made together (Holm 1979).
    """

    first: str
    second: str
    scenarios: int
    median_m: float
    low_m: float
    high_m: float
    p: float | None
    p_holm: float | None = None


def compare_all(
    values: Mapping[str, Mapping[str, float]], *, seed: int, rounds: int = ROUNDS
) -> tuple[PairedComparison, ...]:
    """Every pair of contestants that shares scenarios, the p-values adjusted together.

    Args:
        values: By contestant, by scenario.
        seed: Of the bootstrap; every pair draws from a stream of its own.
        rounds: Of the bootstrap.
    """
    pairs = list(combinations(sorted(values), 2))
    streams = np.random.SeedSequence(seed).spawn(len(pairs))
    comparisons = []
    for (first, second), stream in zip(pairs, streams, strict=True):
        shared = sorted(values[first].keys() & values[second].keys())
        if not shared:
            continue
        differences = np.array([values[first][index] - values[second][index] for index in shared])
        low_m, high_m = _interval(differences, np.random.default_rng(stream), rounds)
        comparisons.append(
            PairedComparison(
                first=first,
                second=second,
                scenarios=len(shared),
                median_m=float(np.median(differences)),
                low_m=low_m,
                high_m=high_m,
                p=find_p_by_signed_ranks(differences),
            )
        )
    adjusted = adjust_holm([comparison.p for comparison in comparisons])
    return tuple(
        replace(comparison, p_holm=p) for comparison, p in zip(comparisons, adjusted, strict=True)
    )


def _interval(
    differences: NDArray[np.float64], rng: np.random.Generator, rounds: int
) -> tuple[float, float]:
    """Return the percentile interval of the median over resampled differences."""
    n, tail = len(differences), 100.0 * (1.0 - LEVEL) / 2.0
    medians = [
        # (size, n) resampled scenarios, some rounds at a time.
        np.median(differences[rng.integers(0, n, size=(size, n))], axis=1)
        for begin in range(0, rounds, _ROUNDS_AT_ONCE)
        for size in [min(_ROUNDS_AT_ONCE, rounds - begin)]
    ]
    low, high = np.percentile(np.concatenate(medians), (tail, 100.0 - tail))
    return float(low), float(high)


def adjust_holm(p_values: Sequence[float | None]) -> list[float | None]:
    """Holm's step-down adjustment; None stays None and counts for nothing."""
    present = sorted((p, index) for index, p in enumerate(p_values) if p is not None)
    adjusted: list[float | None] = [None] * len(p_values)
    highest = 0.0
    for rank, (p, index) in enumerate(present):
        # The i-th smallest of m times m - i, and never below the one before (Holm 1979).
        highest = max(highest, min(1.0, (len(present) - rank) * p))
        adjusted[index] = highest
    return adjusted


def find_p_by_signed_ranks(differences: NDArray[np.float64]) -> float | None:
    """The two-sided p of Wilcoxon's signed-rank test; pairs without a difference are dropped."""
    from scipy.stats import wilcoxon

    # Wilcoxon's own rule: a zero has no sign to rank.
    unequal = differences[differences != 0.0]
    if len(unequal) < FEWEST_PAIRS:
        return None
    return float(wilcoxon(unequal).pvalue)


def within_sd(groups: Iterable[Sequence[float]]) -> float | None:
    """The pooled standard deviation of values within their groups; None without a repeat.

    Each group is one scenario with a value a sample: what differs between scenarios is left out.
    """
    repeated = [group for group in groups if len(group) > 1]
    if not repeated:
        return None
    # sqrt(sum (n - 1) s^2 / sum (n - 1)): each group around its own mean.
    squares = sum(float(np.var(group, ddof=1)) * (len(group) - 1) for group in repeated)
    return math.sqrt(squares / sum(len(group) - 1 for group in repeated))
