"""Contestants on the same scenarios and planners on the same drives, held against each other.

Of contestants scenarios are the unit: two objects of one scenario are no two observations, and
neither are two samples of one cell. Values in metres. Of planners scenes are: scenarios and
samples on one scene are no independent observations. N drives lie on G scenes. Scores are shares
from 0 to 1.
"""

import math
from collections.abc import Hashable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

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


# --- Planners ----------------------------------------------------------------------------------

Scores = Mapping[Hashable, tuple[Hashable, float]]
"""The scene and the score of each drive, by what every planner drove."""

ALPHA = 0.05

_ROUNDING = 1e-9
"""Scores that differ by no more are equal: sums of the same numbers do."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ClusteredMean:
    """The mean of drives, with a 95 % interval over scenes.

    Attributes:
        low, high: None with fewer than two scenes, and where too few differ to estimate a spread.
        p: Of the hypothesis that the mean is 0; None as the interval.
    """

    mean: float
    low: float | None
    high: float | None
    p: float | None
    drives: int
    scenes: int


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannerDifference:
    """The score of one planner minus that of another, on what both drove.

    Attributes:
        p_holm: Adjusted for all differences that were estimated together (Holm 1979).
    """

    first: str
    second: str
    estimate: ClusteredMean
    p_holm: float | None = None

    @property
    def is_apart(self) -> bool:
        """True if the two are told apart at 5 % for all differences together."""
        return self.p_holm is not None and self.p_holm <= ALPHA


def estimate_score(scores: Scores) -> ClusteredMean:
    """Return the mean score with Wilson's (1927) interval, which stays within 0 and 1.

    Its number of observations is the effective one, m (1 - m) / se^2; without any spread, the G
    scenes, as if each were one success or failure.
    """
    mean, se, g = _estimate(
        [scene for scene, _ in scores.values()], [s for _, s in scores.values()]
    )
    low = high = None
    if g > 1:
        q, n = _quantile(g), mean * (1.0 - mean) / se**2 if se > 0.0 else float(g)
        middle = (mean + q * q / (2.0 * n)) / (1.0 + q * q / n)
        half = q * math.sqrt(mean * (1.0 - mean) / n + (q / (2.0 * n)) ** 2) / (1.0 + q * q / n)
        low, high = max(0.0, middle - half), min(1.0, middle + half)
    return ClusteredMean(mean=mean, low=low, high=high, p=None, drives=len(scores), scenes=g)


def compare_planners(
    tables: Sequence[Mapping[str, Scores]],
) -> tuple[tuple[PlannerDifference, ...], ...]:
    """Return for each table the differences of all pairs of planners, adjusted together.

    Args:
        tables: For each contestant, by planner.
    """
    differences = [
        [
            PlannerDifference(
                first=first, second=second, estimate=_difference(table, first, second)
            )
            for first, second in combinations(table, 2)
            if table[first].keys() & table[second].keys()
        ]
        for table in tables
    ]
    adjusted = iter(adjust_holm([one.estimate.p for group in differences for one in group]))
    return tuple(
        tuple(replace(one, p_holm=next(adjusted)) for one in group) for group in differences
    )


def find_sets(
    planners: Sequence[str], differences: Sequence[PlannerDifference]
) -> list[frozenset[str]]:
    """Return the largest sets of which no two planners are told apart (Piepho 2004).

    Args:
        planners: Best first; so are the sets by their best members.
        differences: Pairs that are absent are not told apart.
    """
    sets = {frozenset(planners)}
    for pair in (frozenset({one.first, one.second}) for one in differences if one.is_apart):
        # A set with both is split into one without the first and one without the second.
        sets = {
            part for old in sets for part in ({old - {x} for x in pair} if pair <= old else {old})
        }
        sets = {part for part in sets if not any(part < other for other in sets)}
    return sorted(sets, key=lambda part: sorted(planners.index(name) for name in part))


def _difference(table: Mapping[str, Scores], first: str, second: str) -> ClusteredMean:
    shared = [key for key in table[first] if key in table[second]]
    scenes = [table[first][key][0] for key in shared]
    values = np.array([table[first][key][1] - table[second][key][1] for key in shared])
    mean, se, g = _estimate(scenes, values)
    low = high = p = None
    # Of fewer scenes no spread can be estimated: with one that differs the mean is its own se.
    differ = {scene for scene, value in zip(scenes, values, strict=True) if abs(value) > _ROUNDING}
    if len(differ) >= FEWEST_PAIRS:
        from scipy.stats import t

        half = _quantile(g) * se
        low, high = max(-1.0, mean - half), min(1.0, mean + half)
        p = 2.0 * float(t.sf(abs(mean) / se, g - 1)) if se > 0.0 else 0.0
    return ClusteredMean(mean=mean, low=low, high=high, p=p, drives=len(shared), scenes=g)


def _estimate(scenes: Sequence[Hashable], values: ArrayLike) -> tuple[float, float, int]:
    """Return the mean of (N,) values, its standard error over scenes, and G."""
    number = {scene: index for index, scene in enumerate(dict.fromkeys(scenes))}
    observed: NDArray[np.float64] = np.asarray(values, dtype=np.float64)
    mean, g = float(observed.mean()), len(number)
    if g < 2:
        return mean, 0.0, g
    # (G,) sums of residuals by scene; se^2 = G / (G - 1) sum of their squares / N^2.
    sums = np.bincount([number[scene] for scene in scenes], weights=observed - mean)
    se = math.sqrt(g / (g - 1) * float(sums @ sums)) / len(observed)
    return mean, se if se > _ROUNDING else 0.0, g


def _quantile(scenes: int) -> float:
    from scipy.stats import t

    return float(t.ppf(1.0 - ALPHA / 2.0, scenes - 1))
