"""Bradley-Terry with further numbers: strengths, and what else shifts who wins.

The model: the logarithm of the odds that the first wins is the difference of the strengths plus
the row's columns times one coefficient each. A tie is half a win for both.

Notation: R rows, C contestants, Q columns, K = C + Q parameters. Strengths and coefficients are
logarithms of odds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri, stdtrit

from arena.rating import sandwich
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, FloatArray
from arena.rating.estimate import LEVEL, Estimate, share, t_above, t_quantile
from arena.rating.moderated import clusters_of
from arena.rating.sandwich import Pulls

_MOST_STEPS = 60
_TOLERANCE = 1e-10
_LONGEST_STEP = 2.0
_FAR = 30.0
"""A strength or effect beyond this is on its way to infinity."""
_SINGULAR = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LogisticFit:
    """The most likely parameters.

    Attributes:
        strengths: (C,) of mean zero.
        coefficients: (Q,) in the columns' own units.
        inverse: (K, K) of the likelihood's curvature, on the space of mean strengths zero.
        pulls: What each row pulls at the parameters.
    """

    strengths: FloatArray
    coefficients: FloatArray
    inverse: FloatArray
    pulls: Pulls


def fit_with_columns(votes: Comparisons, columns: FloatArray) -> LogisticFit | None:
    """Strengths and the columns' coefficients by maximum likelihood, to 1e-10.

    Args:
        votes: Of contestants who all have votes.
        columns: (R, Q) of the rows, seen from the first contestant.

    Returns:
        None where the votes determine no finite answer, or columns say the same as others.
    """
    contestants, extra = len(votes.names), columns.shape[1]
    # Columns of very different size would look like columns that say the same.
    scale = np.sqrt((columns**2 * votes.count[:, None]).mean(axis=0))
    if not (scale > 0.0).all():
        return None
    scaled = columns / scale
    parameters = np.zeros(contestants + extra)
    for _ in range(_MOST_STEPS):
        slope, curvature, _ = _derivatives(votes, scaled, parameters)
        inverse = _inverse(curvature, contestants)
        if inverse is None:
            return None
        step = inverse @ slope
        longest = float(np.abs(step).max(initial=0.0))
        parameters = parameters + step * min(1.0, _LONGEST_STEP / max(longest, 1e-300))
        if np.abs(parameters).max() > _FAR:
            return None
        if longest < _TOLERANCE:
            break
    else:
        return None
    _, curvature, surprise = _derivatives(votes, scaled, parameters)
    inverse = _inverse(curvature, contestants)
    if inverse is None:
        return None
    units = np.concatenate([np.ones(contestants), 1.0 / scale])
    inverse = units[:, None] * inverse * units
    expected = votes.score - surprise
    strengths = parameters[:contestants]
    return LogisticFit(
        strengths=strengths - strengths.mean(),
        coefficients=parameters[contestants:] / scale,
        inverse=inverse,
        pulls=Pulls(
            contestants=contestants,
            first=votes.first,
            second=votes.second,
            count=votes.count,
            surprise=surprise,
            information=expected * (1.0 - expected),
            inverse=inverse,
            besides=surprise[:, None] * columns,
        ),
    )


def parameter_covariance(votes: Comparisons, fitted: LogisticFit, unit: Unit) -> FloatArray:
    """(K, K) in squared Elo points, by the plain sandwich; coefficients times a point's worth."""
    everything = replace(fitted.pulls, contestants=len(fitted.inverse))
    return sandwich.covariance(votes, everything, unit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient:
    """What one unit of a covariate is worth.

    Attributes:
        points: Elo points, with its interval clustered as the ratings' are.
        p_value: Of none; None where it can't be told.
    """

    points: Estimate
    p_value: float | None


def coefficients_of(
    votes: Comparisons, fitted: LogisticFit, unit: Unit
) -> tuple[Coefficient, ...]:
    """The columns' coefficients in Elo points, by the plain sandwich and Student's t."""
    covariance = parameter_covariance(votes, fitted, unit)
    clusters = min((number for number, _ in clusters_of(votes, unit)), default=votes.votes)
    degrees = float(max(clusters - 1, 1))
    found = []
    for place, value in enumerate(fitted.coefficients.tolist(), start=len(fitted.strengths)):
        points, error = value * ELO_PER_LOGIT, math.sqrt(max(covariance[place, place], 0.0))
        half = float(t_quantile(degrees)) * error
        known = error > 0.0
        found.append(
            Coefficient(
                points=Estimate(value=points, lower=points - half, upper=points + half)
                if known
                else Estimate(value=points),
                p_value=2.0 * float(t_above(abs(points) / error, degrees)) if known else None,
            )
        )
    return tuple(found)


# --- Steps ---------------------------------------------------------------------------------------


def _derivatives(
    votes: Comparisons, columns: FloatArray, parameters: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """(K,) slope, (K, K) curvature, (R,) what each vote of a row scored above expectation."""
    contestants, size = len(votes.names), len(parameters)
    first, second = votes.first, votes.second
    lead = parameters[first] - parameters[second] + columns @ parameters[contestants:]
    expected = 1.0 / (1.0 + np.exp(-lead))
    surprise = votes.score - expected
    pull = votes.count * surprise
    weight = votes.count * expected * (1.0 - expected)
    slope = np.empty(size)
    slope[:contestants] = _of_ends(votes, pull)
    slope[contestants:] = columns.T @ pull
    between = np.bincount(first * contestants + second, weight, contestants**2)
    between = between.reshape(contestants, contestants)
    curvature = np.zeros((size, size))
    inner = -(between + between.T)
    inner[np.diag_indices(contestants)] = -inner.sum(axis=1)
    curvature[:contestants, :contestants] = inner
    for number, column in enumerate(columns.T, start=contestants):
        curvature[:contestants, number] = _of_ends(votes, weight * column)
    curvature[contestants:, :contestants] = curvature[:contestants, contestants:].T
    curvature[contestants:, contestants:] = (columns * weight[:, None]).T @ columns
    return slope, curvature, surprise


def _of_ends(votes: Comparisons, values: FloatArray) -> FloatArray:
    """(C,): a row's value counts for its first contestant, and against its second."""
    contestants = len(votes.names)
    return np.asarray(
        np.bincount(votes.first, values, contestants)
        - np.bincount(votes.second, values, contestants)
    )


def _inverse(curvature: FloatArray, contestants: int) -> FloatArray | None:
    """(K, K) on the space of mean strengths zero; None where another direction is flat, too."""
    values, directions = np.linalg.eigh(curvature)
    if len(values) > 1 and values[1] < _SINGULAR * max(values[-1], 1e-300):
        return None
    inverse = np.zeros_like(values)
    inverse[1:] = 1.0 / values[1:]
    return np.asarray((directions * inverse) @ directions.T)


# --- The left side -------------------------------------------------------------------------------


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
