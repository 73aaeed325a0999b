"""The covariance of Bradley-Terry ratings in closed form, with votes that hang together.

The cross-check of the intervals. Every vote pulls at its two contestants by how much it surprises;
the pulls of a cluster are added up before they are squared, so that what its votes have in common
counts (the sandwich, H^-1 S H^-1). Clustered two ways, the pulls by scenario and by expert are
taken together and those of the cells, which are in both, once off (Cameron, Gelbach, Miller 2011).

Notation: R rows, C contestants, K parameters (C strengths, and Q that a model has besides), G
clusters.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from arena.rating import davidson
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings
from arena.rating.comparisons import (
    TIE,
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    renumber_codes,
)
from arena.rating.estimate import t_quantile

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


# --- What votes pull -----------------------------------------------------------------------------


_NUMBERS_AT_ONCE = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pulls:
    """The slope of each row's likelihood at the fitted strengths, and the way back to ratings.

    Attributes:
        contestants: C.
        first, second, count: (R,) of the rows.
        surprise: (R,) what `first` scored above what was expected, in one vote; `second` the
            opposite.
        information: (R,) how much a vote of the row says of the difference of the two.
        besides: (R, Q) the slopes by a model's further parameters, in one vote; None without.
        inverse: (K, K) of the likelihood's curvature, from slopes (columns) to strengths.
    """

    contestants: int
    first: IntArray
    second: IntArray
    count: IntArray
    surprise: FloatArray
    information: FloatArray
    inverse: FloatArray
    besides: FloatArray | None = None

    def relative_to(self, reference: BoolArray) -> Self:
        """The same for ratings whose mean over a reference (C,) is fixed, not everybody's."""
        if reference.all():
            return self
        inverse = self.inverse.copy()
        inverse[: self.contestants] -= inverse[: self.contestants][reference].mean(axis=0)
        return replace(self, inverse=inverse)

    def by_row(self) -> FloatArray:
        """(C, C) squared points: the sandwich of independent votes."""
        size = len(self.inverse)
        found = np.zeros((size, size))
        squared = self.surprise**2 * self.count
        np.add.at(found, (self.first, self.second), -squared)
        found += found.T
        found[np.diag_indices(size)] = -found.sum(axis=1)
        if self.besides is not None:
            start = size - self.besides.shape[1]
            for number, slope in enumerate(self.besides.T, start=start):
                both = self.surprise * slope * self.count
                ends = np.bincount(self.first, weights=both, minlength=size)
                ends -= np.bincount(self.second, weights=both, minlength=size)
                found[number, :start] = found[:start, number] = ends[:start]
            squares = self.besides.T @ (self.besides * self.count[:, None])
            found[start:, start:] = squares
        return self._of_ratings(found)

    def by_cluster(self, cluster_of: IntArray, clusters: int) -> FloatArray:
        """(C, C) squared points: the pulls of each of G clusters added up and squared."""
        size = len(self.inverse)
        ends = [self.first, self.second]
        pull = self.surprise * self.count
        pulls = [pull, -pull]
        if self.besides is not None:
            start = size - self.besides.shape[1]
            ends += [np.full(len(pull), number) for number in range(start, size)]
            pulls += list(self.besides.T * self.count)
        place = np.tile(cluster_of, len(ends)) * size + np.concatenate(ends)
        return self._of_ratings(_squares(place, np.concatenate(pulls), clusters, size))

    def concentration(self, cluster_of: IntArray, clusters: int) -> tuple[FloatArray, FloatArray]:
        """(C,), (C,) how unevenly a contestant's information comes from the clusters.

        The sums of squared and of cubed shares: 1 / G and 1 / G^2 where all give alike, 1 where
        one gives all.
        """
        weight = self.information * self.count
        place = np.concatenate([self.first, self.second]) * clusters + np.tile(cluster_of, 2)
        met, of_row = renumber_codes(place)
        given = np.bincount(of_row, weights=np.tile(weight, 2))
        total = np.bincount(met // clusters, weights=given, minlength=self.contestants)
        shares = given / total[met // clusters]
        squares, cubes = (
            np.bincount(met // clusters, weights=shares**power, minlength=self.contestants)
            for power in (2, 3)
        )
        return np.minimum(squares, 1.0), cubes.astype(np.float64)

    def _of_ratings(self, squares: FloatArray) -> FloatArray:
        """(C, C) from squared sums of slopes (K, K)."""
        back = self.inverse[: self.contestants]
        return np.asarray(ELO_PER_LOGIT**2 * back @ squares @ back.T)


def bradley_terry_pulls(votes: Comparisons, strengths: FloatArray, inverse: FloatArray) -> Pulls:
    """Those of Bradley-Terry with strengths (C,) and the inverse curvature (C, C)."""
    expected = 1.0 / (1.0 + np.exp(strengths[votes.second] - strengths[votes.first]))
    return Pulls(
        contestants=len(votes.names),
        first=votes.first,
        second=votes.second,
        count=votes.count,
        surprise=votes.score - expected,
        information=expected * (1.0 - expected),
        inverse=inverse,
    )


def davidson_pulls(
    votes: Comparisons, met: Meetings, games: FloatArray, answer: FloatArray
) -> Pulls:
    """Those of Davidson's model with strengths and the logarithm of v (C + 1,)."""
    expected, tied = davidson.chances(answer, votes.first, votes.second)
    return Pulls(
        contestants=len(votes.names),
        first=votes.first,
        second=votes.second,
        count=votes.count,
        surprise=votes.score - expected,
        information=expected - 0.25 * tied - expected**2,
        inverse=davidson.inverse_curvature(met, games, answer),
        besides=((votes.score == TIE) - tied)[:, None],
    )


def without_negative_parts(matrix: FloatArray) -> FloatArray:
    """Few clusters can make a difference of sums negative in some direction: that is cut off."""
    matrix = 0.5 * (matrix + matrix.T)
    values, directions = np.linalg.eigh(matrix)
    if values[0] >= 0.0:
        return matrix
    return np.asarray((directions * np.maximum(values, 0.0)) @ directions.T)


def _squares(place: IntArray, pulls: FloatArray, clusters: int, size: int) -> FloatArray:
    """(K, K) the sum over clusters of their summed pulls times themselves.

    Args:
        place: The cluster of each pull, times K, plus whom it pulls at.
        pulls: How much.
        clusters: G.
        size: K.
    """
    if clusters * size <= _NUMBERS_AT_ONCE:
        sums = np.bincount(place, weights=pulls, minlength=clusters * size).reshape(-1, size)
        return np.asarray(sums.T @ sums)
    from scipy.sparse import coo_array  # slow to load, and for large tables alone

    table = coo_array((pulls, (place // size, place % size)), shape=(clusters, size)).tocsr()
    return np.asarray((table.T @ table).toarray())
