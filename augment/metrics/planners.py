"""Planners against each other on the same drives: means, paired differences, sets.

Scenes are the unit: scenarios and samples on one scene are no independent observations. N drives
lie on G scenes. Scores are shares from 0 to 1.
"""

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.metrics.paired import FEWEST_PAIRS, adjust_holm

Scores = Mapping[Hashable, tuple[Hashable, float]]
"""The scene and the score of each drive, by what every planner drove."""

ALPHA = 0.05


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


# --- Private -----------------------------------------------------------------------------------


def _difference(table: Mapping[str, Scores], first: str, second: str) -> ClusteredMean:
    shared = [key for key in table[first] if key in table[second]]
    scenes = [table[first][key][0] for key in shared]
    values = np.array([table[first][key][1] - table[second][key][1] for key in shared])
    mean, se, g = _estimate(scenes, values)
    low = high = p = None
    # Of fewer scenes no spread can be estimated: with one that differs the mean is its own se.
    if len({scene for scene, value in zip(scenes, values, strict=True) if value}) >= FEWEST_PAIRS:
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
    return mean, math.sqrt(g / (g - 1) * float(sums @ sums)) / len(observed), g


def _quantile(scenes: int) -> float:
    from scipy.stats import t

    return float(t.ppf(1.0 - ALPHA / 2.0, scenes - 1))
