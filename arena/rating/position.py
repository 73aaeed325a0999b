"""Whether the left picture has an advantage because it is on the left.

Bradley-Terry with one more number: what the first (left) contestant has in advance. Its error is
clustered, because an expert who prefers a side does so in all their votes.

Notation: V votes, C contestants, G clusters. Strengths are natural logarithms of odds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import expit, ndtri, stdtrit

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, FloatArray, IntArray
from arena.rating.estimate import LEVEL, Estimate
from arena.rating.shares import share

_MOST_STEPS = 50
_TOLERANCE = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBias:
    """What the left side is worth.

    Attributes:
        advantage: In Elo points with the interval clustered by expert; zero is no bias.
        standard_error: Of the advantage, in Elo points; None where it is not determined.
        left: The share of decided votes that the left picture won.
        clusters: Experts.
    """

    advantage: Estimate
    standard_error: float | None
    left: Estimate
    clusters: int


def side_bias(votes: Comparisons) -> SideBias:
    """The advantage of the left side, beside what the contestants are worth.

    Args:
        votes: `first` was shown on the left. They must determine ratings; else the advantage is
            unknown and only the share is given.
    """
    decided = votes.score != 0.5
    left = share(votes.score[decided] == 1.0, votes.expert[decided])
    clusters = len(np.unique(votes.expert))
    fitted = _fit(votes)
    if fitted is None:
        return SideBias(
            advantage=Estimate(value=None), standard_error=None, left=left, clusters=clusters
        )
    parameters, bread = fitted
    value = float(parameters[-1]) * ELO_PER_LOGIT
    variance = _variance(votes, parameters, bread)
    error = math.sqrt(variance) * ELO_PER_LOGIT
    half = error * float(
        stdtrit(clusters - 1, 0.5 + LEVEL / 2) if clusters > 1 else ndtri(0.5 + LEVEL / 2)
    )
    return SideBias(
        advantage=Estimate(value=value, lower=value - half, upper=value + half),
        standard_error=error,
        left=left,
        clusters=clusters,
    )


# --- Private -----------------------------------------------------------------------------------


def _fit(votes: Comparisons) -> tuple[FloatArray, FloatArray] | None:
    """(C + 1,) strengths and the advantage, and the inverse curvature; None without a maximum."""
    contestants = len(votes.names)
    code, cell = np.unique(votes.first * contestants + votes.second, return_inverse=True)
    games = np.bincount(cell, minlength=len(code)).astype(np.float64)
    scores = np.bincount(cell, weights=votes.score, minlength=len(code))
    design = _design(code // max(contestants, 1), code % max(contestants, 1), contestants)
    parameters = np.zeros(contestants + 1)
    for _ in range(_MOST_STEPS):
        expected = expit(design @ parameters)
        curvature = (design * (games * expected * (1 - expected))[:, None]).T @ design
        # Strengths are known up to a shift: the pseudo-inverse leaves that direction alone.
        inverse = np.linalg.pinv(curvature, rcond=1e-10, hermitian=True)
        step = inverse @ (design.T @ (scores - games * expected))
        longest = float(np.abs(step).max(initial=0.0))
        parameters = parameters + step * min(1.0, 2.0 / max(longest, 1e-300))
        if longest < _TOLERANCE:
            return parameters, np.asarray(inverse)
        if np.abs(parameters).max() > 30.0:
            return None
    return None


def _variance(votes: Comparisons, parameters: FloatArray, bread: FloatArray) -> float:
    """Of the advantage: clustered by expert, or for single votes where there is one expert."""
    design = _design(votes.first, votes.second, len(votes.names))
    surprise = votes.score - expit(design @ parameters)
    influence = (design @ bread[-1]) * surprise
    found, cluster = np.unique(votes.expert, return_inverse=True)
    if len(found) < 2:
        return float((influence**2).sum())
    sums = np.bincount(cluster, weights=influence, minlength=len(found))
    return float((sums**2).sum()) * len(found) / (len(found) - 1)


def _design(first: IntArray, second: IntArray, contestants: int) -> FloatArray:
    """(n, C + 1): plus one for the first, minus one for the second, one for being on the left."""
    design = np.zeros((len(first), contestants + 1))
    rows = np.arange(len(first))
    design[rows, first] = 1.0
    design[rows, second] -= 1.0
    design[:, -1] = 1.0
    return design
