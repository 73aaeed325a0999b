"""The covariance of Bradley-Terry ratings in closed form, with votes that hang together.

The cross-check of the bootstrap. Every vote pulls at its two contestants by how much it surprises;
the pulls of a cluster are added up before they are squared, so that what its votes have in common
counts (the sandwich, H^-1 S H^-1). Clustered two ways, the pulls by scenario and by expert are
taken together and those of the cells, which are in both, once off (Cameron, Gelbach, Miller 2011).

Notation: R rows, C contestants, P pairs, G clusters.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings, inverse_curvature
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
)

FEW_CLUSTERS = 20
NORMAL = 1.959963984540054
"""97.5 % of the normal distribution lie below."""
_NUMBERS_AT_ONCE = 2_000_000


def covariance(
    votes: Comparisons, counts: PairCounts, strengths: FloatArray, unit: Unit
) -> FloatArray:
    """(C, C) in squared Elo points; rows add to zero, as ratings have a fixed mean.

    Args:
        votes: Of contestants who all have votes.
        counts: The same, by pair.
        strengths: (C,) of the data.
        unit: What hangs together.
    """
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    inverse = inverse_curvature(met, counts.games, strengths)
    gap = strengths[votes.second] - strengths[votes.first]
    surprise = votes.score - 1.0 / (1.0 + np.exp(gap))
    experts, expert_of = renumber_codes(votes.expert)
    scenarios, scenario_of = renumber_codes(votes.scenario)
    if unit is Unit.VOTE:
        spread = _of_votes(votes, surprise)
    elif unit is Unit.EXPERT:
        spread = _of_clusters(votes, surprise, expert_of, len(experts))
    elif unit is Unit.SCENARIO:
        spread = _of_clusters(votes, surprise, scenario_of, len(scenarios))
    else:
        cells, cell_of = renumber_codes(expert_of * len(scenarios) + scenario_of)
        spread = (
            _of_clusters(votes, surprise, expert_of, len(experts))
            + _of_clusters(votes, surprise, scenario_of, len(scenarios))
            - _of_clusters(votes, surprise, cell_of, len(cells))
        )
    return _without_negative_parts(ELO_PER_LOGIT**2 * inverse @ spread @ inverse)


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
    return NORMAL if clusters is None else t_quantile(clusters - 1)


def t_quantile(degrees: int, probability: float = 0.975) -> float:
    """Of Student's t with whole degrees of freedom, from 1, for probabilities above a half."""
    low, high = 0.0, 1e4
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _t_below(middle, degrees) < probability:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


def _t_below(value: float, degrees: int) -> float:
    """The distribution function of t, as the finite sum that whole degrees have."""
    angle = math.atan(value / math.sqrt(degrees))
    cosine, sine = math.cos(angle), math.sin(angle)
    if degrees % 2:
        term, total = cosine, cosine if degrees > 1 else 0.0
        for step in range(2, degrees - 1, 2):
            term *= cosine**2 * step / (step + 1)
            total += term
        return 0.5 + (angle + sine * total) / math.pi
    term = total = 1.0
    for step in range(1, degrees - 2, 2):
        term *= cosine**2 * step / (step + 1)
        total += term
    return 0.5 + 0.5 * sine * total


def _of_votes(votes: Comparisons, surprise: FloatArray) -> FloatArray:
    """(C, C) the sum of the votes' squared pulls."""
    contestants = len(votes.names)
    found = np.zeros((contestants, contestants))
    squared = surprise**2 * votes.count
    np.add.at(found, (votes.first, votes.second), -squared)
    found += found.T
    found[np.diag_indices(contestants)] = -found.sum(axis=1)
    return found


def _of_clusters(
    votes: Comparisons, surprise: FloatArray, cluster_of: IntArray, clusters: int
) -> FloatArray:
    """(C, C) the sum over clusters of their pulls times themselves, G / (G - 1) of it."""
    contestants = len(votes.names)
    pull = surprise * votes.count
    found = np.zeros((contestants, contestants))
    at_once = max(1, _NUMBERS_AT_ONCE // contestants)
    order = np.argsort(cluster_of, kind="stable")
    bounds = np.searchsorted(cluster_of[order], np.arange(0, clusters + at_once, at_once))
    for block, (begin, end) in enumerate(pairwise(bounds)):
        rows = order[begin:end]
        place = (cluster_of[rows] - block * at_once) * contestants
        size = min(at_once, clusters - block * at_once) * contestants
        pulls = np.bincount(place + votes.first[rows], weights=pull[rows], minlength=size)
        pulls -= np.bincount(place + votes.second[rows], weights=pull[rows], minlength=size)
        by_cluster = pulls.reshape(-1, contestants)
        found += by_cluster.T @ by_cluster
    return found * clusters / max(1, clusters - 1)


def _without_negative_parts(matrix: FloatArray) -> FloatArray:
    """Few clusters can make a difference of sums negative in some direction: that is cut off."""
    matrix = 0.5 * (matrix + matrix.T)
    values, directions = np.linalg.eigh(matrix)
    if values[0] >= 0.0:
        return matrix
    return np.asarray((directions * np.maximum(values, 0.0)) @ directions.T)
