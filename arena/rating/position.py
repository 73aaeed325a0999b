"""Whether the left picture has an advantage because it is on the left.

Bradley-Terry with one more number: what the first (left) contestant has in advance. Its error is
clustered, because an expert who prefers a side does so in all their votes.

Strengths are natural logarithms of odds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri, stdtrit

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons
from arena.rating.estimate import LEVEL, Estimate
from arena.rating.logistic import fit_with_columns, parameter_covariance
from arena.rating.shares import share


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
    fitted = fit_with_columns(votes, np.ones((len(votes), 1)))
    if fitted is None:
        return SideBias(
            advantage=Estimate(value=None), standard_error=None, left=left, clusters=clusters
        )
    value = float(fitted.coefficients[0]) * ELO_PER_LOGIT
    unit = Unit.EXPERT if clusters > 1 else Unit.VOTE
    error = math.sqrt(float(parameter_covariance(votes, fitted, unit)[-1, -1]))
    half = error * float(
        stdtrit(clusters - 1, 0.5 + LEVEL / 2) if clusters > 1 else ndtri(0.5 + LEVEL / 2)
    )
    return SideBias(
        advantage=Estimate(value=value, lower=value - half, upper=value + half),
        standard_error=error,
        left=left,
        clusters=clusters,
    )
