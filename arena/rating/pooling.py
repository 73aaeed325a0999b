"""Ratings by scenario type that borrow from each other (partial pooling, empirical Bayes).

A type with few votes, or votes that all went one way, says little or nothing by itself. But a
contestant is rarely a stranger on one type: its strength there is its strength on all types plus
a difference, drawn from a normal distribution of mean zero whose standard deviation the types'
votes say something about. So a type's own votes count the more, the more there are and the more
types seem to differ.

Strengths maximise the likelihood with that penalty; every standard deviation on a grid is tried
and weighs as much as the votes make it likely (Laplace's approximation, a flat prior as in Gelman
2006), so that intervals know that it is not known. Likelihoods are tempered by how much votes on
one scenario hang together, and what experts have in common in all types is added to the variance.

Notation: R rows, C contestants, T types, N points of the grid.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, MEAN_ELO
from arena.rating.comparisons import Comparisons, FloatArray, IntArray
from arena.rating.estimate import LEVEL, Estimate
from arena.rating.logistic import fit_with_columns
from arena.rating.moderated import spread_of, t_factor
from arena.rating.pulls import Pulls

GRID_ELO = np.concatenate([[0.0], np.geomspace(2.0, 400.0, 28)])
"""Standard deviations of the types' differences that are tried, in points."""
_MOST_STEPS = 50
_TOLERANCE = 1e-8


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Pooled:
    """Ratings of every type, drawn towards those on all types.

    Attributes:
        rating, lower, upper: (T, C) points; in each type the mean is 1000.
        spread: By how many points contestants differ from type to type: a standard deviation.
    """

    rating: FloatArray
    lower: FloatArray
    upper: FloatArray
    spread: Estimate


def pool_types(votes: Comparisons, type_of: IntArray, types: int, unit: Unit) -> Pooled | None:
    """Ratings by type, partially pooled.

    Args:
        votes: Of contestants who all have votes.
        type_of: (R,) the type of each row, from 0.
        types: T.
        unit: What hangs together.

    Returns:
        None where the votes of all types together do not determine everybody's rating.
    """
    whole = fit_with_columns(votes, np.empty((len(votes), 0)))
    if whole is None:
        return None
    dispersion, shared, degrees = _how_sure(votes, whole.pulls, whole.inverse, unit)
    rows = [
        _Rows.of(votes, np.flatnonzero(type_of == number), dispersion) for number in range(types)
    ]
    basis = _basis(len(votes.names))
    start = np.zeros((types + 1, basis.shape[1]))
    start[0] = whole.strengths @ basis
    grid = GRID_ELO / ELO_PER_LOGIT
    found = [_Fit.at(rows, basis, deviation, start) for deviation in grid.tolist()]
    height = np.array([one.log_marginal for one in found])
    weight = np.exp(height - height.max()) * np.gradient(grid)
    weight /= weight.sum()
    means = np.array([one.mean for one in found])
    mean = np.tensordot(weight, means, axes=1)
    inner = np.array([one.variance for one in found]) + (means - mean) ** 2
    variance = np.tensordot(weight, inner, axes=1) * ELO_PER_LOGIT**2 + shared
    half = t_factor(degrees) * np.sqrt(variance)
    rating = MEAN_ELO + ELO_PER_LOGIT * mean
    return Pooled(
        rating=rating,
        lower=rating - half,
        upper=rating + half,
        spread=_of_grid(weight, GRID_ELO),
    )


def fit_penalised(
    votes: Comparisons, type_of: IntArray, types: int, *, deviation: float, dispersion: float = 1.0
) -> FloatArray:
    """(T, C) strengths that maximise the penalised likelihood for one standard deviation.

    Args:
        votes: They must determine everybody's strength over all types.
        type_of: (R,) the type of each row, from 0.
        types: T.
        deviation: Of the types' differences, in logarithms of odds.
        dispersion: How much larger variances are than those of independent votes without ties.
    """
    rows = [
        _Rows.of(votes, np.flatnonzero(type_of == number), dispersion) for number in range(types)
    ]
    basis = _basis(len(votes.names))
    return _Fit.at(rows, basis, deviation, np.zeros((types + 1, basis.shape[1]))).mean


# --- Private -----------------------------------------------------------------------------------


def _how_sure(
    votes: Comparisons, pulls: Pulls, inverse: FloatArray, unit: Unit
) -> tuple[float, FloatArray, FloatArray]:
    """The dispersion by scenarios, (C,) what experts add everywhere, (C,) degrees of freedom."""
    by_row = pulls.by_row().diagonal()
    ends = {Unit.TWO_WAY: (Unit.SCENARIO, Unit.EXPERT), Unit.SCENARIO: (Unit.SCENARIO, None)}
    scenarios, experts = ends.get(unit, (None, Unit.EXPERT if unit is Unit.EXPERT else None))
    inner = spread_of(votes, pulls, scenarios or Unit.VOTE)
    seen = inner.covariance.diagonal()
    seen = np.where(seen > 0.0, seen, by_row)
    claimed = ELO_PER_LOGIT**2 * inverse.diagonal()[: len(by_row)]
    shared: FloatArray = np.zeros(len(by_row))
    if experts is not None:
        of_experts = spread_of(votes, pulls, experts).covariance.diagonal()
        shared = np.maximum(of_experts - by_row, 0.0)
    degrees = spread_of(votes, pulls, unit).degrees
    return float(np.median(seen / claimed)), shared, degrees


def _basis(contestants: int) -> FloatArray:
    """(C, C - 1) orthonormal directions of mean zero."""
    centred = np.eye(contestants) - 1.0 / contestants
    return np.asarray(np.linalg.svd(centred)[0][:, : contestants - 1])


def _of_grid(weight: FloatArray, grid: FloatArray) -> Estimate:
    """The mean of a distribution on a grid, and between what 95 % of it lie."""
    up_to = np.cumsum(weight)
    tail = 0.5 * (1.0 - LEVEL)
    lower, upper = (
        float(grid[min(int(np.searchsorted(up_to, share)), len(grid) - 1)])
        for share in (tail, 1.0 - tail)
    )
    return Estimate(value=float(weight @ grid), lower=lower, upper=upper)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Rows:
    """A type's votes, their likelihood tempered."""

    first: IntArray
    second: IntArray
    score: FloatArray
    weight: FloatArray

    @classmethod
    def of(cls, votes: Comparisons, rows: IntArray, dispersion: float) -> _Rows:
        return cls(
            first=votes.first[rows],
            second=votes.second[rows],
            score=votes.score[rows],
            weight=votes.count[rows] / dispersion,
        )

    def derivatives(self, strengths: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        """The logarithm of the likelihood, its slope (C,) and curvature (C, C)."""
        contestants = len(strengths)
        lead = strengths[self.first] - strengths[self.second]
        expected = 1.0 / (1.0 + np.exp(-lead))
        height = float((self.weight * (self.score * lead - np.logaddexp(0.0, lead))).sum())
        pull = self.weight * (self.score - expected)
        slope: FloatArray = np.bincount(self.first, pull, contestants).astype(np.float64)
        slope -= np.bincount(self.second, pull, contestants)
        information = self.weight * expected * (1.0 - expected)
        place = self.first * contestants + self.second
        between: FloatArray = np.bincount(place, information, contestants**2).astype(np.float64)
        between = between.reshape(contestants, contestants)
        curvature = -(between + between.T)
        curvature[np.diag_indices(contestants)] = -curvature.sum(axis=1)
        return height, slope, curvature


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fit:
    """The answer for one standard deviation.

    Attributes:
        mean, variance: (T, C) of the strengths.
        log_marginal: How likely the votes are, up to a constant.
    """

    mean: FloatArray
    variance: FloatArray
    log_marginal: float

    @classmethod
    def at(cls, rows: list[_Rows], basis: FloatArray, deviation: float, start: FloatArray) -> _Fit:
        """Newton's method; rows of `start` are the common strengths, then each type's difference.

        For a deviation of zero all types have the common strengths.
        """
        types, size = len(rows), basis.shape[1]
        penalty = 1.0 / deviation**2 if deviation > 0.0 else np.inf
        place = start.copy()
        for _ in range(_MOST_STEPS):
            height, slopes, curvatures = _of_types(rows, basis, place)
            step, covariance, log_size = _step(slopes, curvatures, place, penalty)
            longest = float(np.abs(step).max(initial=0.0))
            if longest < _TOLERANCE:
                break
            place = place + step * min(1.0, 2.0 / longest)
        if deviation > 0.0:
            height -= 0.5 * penalty * float((place[1:] ** 2).sum())
            height -= types * size * float(np.log(deviation))
        return cls(
            mean=(place[0] + place[1:]) @ basis.T,
            variance=np.einsum("ci,tij,cj->tc", basis, covariance, basis),
            log_marginal=height - 0.5 * log_size,
        )


def _of_types(
    rows: list[_Rows], basis: FloatArray, place: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """The sum of heights, (T, C - 1) slopes and (T, C - 1, C - 1) curvatures."""
    strengths = (place[0] + place[1:]) @ basis.T
    found = [one.derivatives(own) for one, own in zip(rows, strengths, strict=True)]
    slopes = np.array([slope @ basis for _, slope, _ in found])
    curvatures = np.array([basis.T @ curvature @ basis for _, _, curvature in found])
    return sum(height for height, _, _ in found), slopes, curvatures


def _step(
    slopes: FloatArray, curvatures: FloatArray, place: FloatArray, penalty: float
) -> tuple[FloatArray, FloatArray, float]:
    """Newton's step (T + 1, C - 1), the types' covariances, and the curvature's log-determinant.

    The differences are eliminated: each meets the others by the common strengths alone.
    """
    size = slopes.shape[1]
    if np.isinf(penalty):
        common = np.linalg.inv(curvatures.sum(axis=0))
        step = np.zeros_like(place)
        step[0] = common @ slopes.sum(axis=0)
        log_size = -float(np.linalg.slogdet(common)[1])
        everywhere = np.broadcast_to(common, curvatures.shape).astype(np.float64)
        return step, everywhere, log_size
    own = np.linalg.inv(curvatures + penalty * np.eye(size))
    kept = penalty * own  # what is left of the common strengths where a type has its own
    of_common = curvatures @ kept
    common = np.linalg.inv(of_common.sum(axis=0))
    pull = slopes - penalty * place[1:]
    reduced = slopes - np.einsum("tij,tjk,tk->ti", curvatures, own, pull)
    step = np.zeros_like(place)
    step[0] = common @ reduced.sum(axis=0)
    step[1:] = np.einsum("tij,tj->ti", own, pull - curvatures @ step[0])
    covariance = np.asarray(own + kept @ common @ kept.transpose(0, 2, 1), dtype=np.float64)
    log_size = -float(np.linalg.slogdet(common)[1]) - float(np.linalg.slogdet(own)[1].sum())
    return step, covariance, log_size
