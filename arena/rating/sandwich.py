"""The covariance of Bradley-Terry ratings in closed form, with votes that hang together.

The cross-check of the intervals. Every vote pulls at its two contestants by how much it surprises;
the pulls of a cluster are added up before they are squared, so that what its votes have in common
counts (the sandwich, H^-1 S H^-1). Clustered two ways, the pulls by scenario and by expert are
taken together and those of the cells, which are in both, once off (Cameron, Gelbach, Miller 2011).

Notation: R rows, C contestants, G clusters.
"""

from __future__ import annotations

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    renumber_codes,
)
from arena.rating.pulls import Pulls, without_negative_parts
from arena.rating.student import t_quantile

FEW_CLUSTERS = 20
NORMAL = 1.959963984540054
"""97.5 % of the normal distribution lie below."""


def covariance(votes: Comparisons, pulls: Pulls, unit: Unit) -> FloatArray:
    """(C, C) in squared Elo points; rows add to zero, as ratings have a fixed mean.

    Args:
        votes: Of contestants who all have votes.
        pulls: What each row pulls at its contestants.
        unit: What hangs together.
    """
    if unit is Unit.VOTE:
        return without_negative_parts(pulls.by_row())
    experts, expert_of = renumber_codes(votes.expert)
    scenarios, scenario_of = renumber_codes(votes.scenario)
    if unit is Unit.EXPERT:
        return without_negative_parts(_corrected(pulls, expert_of, len(experts)))
    if unit is Unit.SCENARIO:
        return without_negative_parts(_corrected(pulls, scenario_of, len(scenarios)))
    cells, cell_of = renumber_codes(expert_of * len(scenarios) + scenario_of)
    return without_negative_parts(
        _corrected(pulls, expert_of, len(experts))
        + _corrected(pulls, scenario_of, len(scenarios))
        - _corrected(pulls, cell_of, len(cells))
    )


def _corrected(pulls: Pulls, cluster_of: IntArray, clusters: int) -> FloatArray:
    """G / (G - 1) of the squares, for what the fit has taken of them."""
    return pulls.by_cluster(cluster_of, clusters) * clusters / max(1, clusters - 1)


def relative_to(found: FloatArray, reference: BoolArray) -> FloatArray:
    """(C, C) of ratings relative to the mean of a reference (C,) instead of everybody's."""
    if reference.all():
        return found
    of_mean = found[:, reference].mean(axis=1)
    return np.asarray(found - of_mean[:, None] - of_mean[None, :] + of_mean[reference].mean())


def factor(clusters: int | None) -> float:
    """By how much to multiply a standard error for a 95 % interval.

    Student's t of one less than `clusters` where these are few, else the normal's 1.96.
    """
    return NORMAL if clusters is None else float(t_quantile(clusters - 1))
