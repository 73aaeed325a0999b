"""Bradley-Terry with further numbers: strengths, and what else shifts who wins.

The model: the logarithm of the odds that the first wins is the difference of the strengths plus
the row's columns times one coefficient each. A tie is half a win for both.

Notation: R rows, C contestants, Q columns, K = C + Q parameters. Strengths and coefficients are
logarithms of odds.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from arena.rating.comparisons import (
    TIE,
    Comparisons,
    Estimate,
    FloatArray,
    share,
    t_above,
    t_quantile,
)
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.rules import Unit
from arena.rating.sandwich import Pulls, clusters_of, design_of, plain_covariance

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
        pulls: What each row pulls at the parameters.
    """

    strengths: FloatArray
    coefficients: FloatArray
    pulls: Pulls


def fit_with_columns(votes: Comparisons, columns: FloatArray) -> LogisticFit | None:
    """Strengths and the columns' coefficients by maximum likelihood, to 1e-10.

    Args:
        votes: Of contestants who all have votes.
        columns: (R, Q) of the rows, seen from the first contestant.

    Returns:
        None where the votes determine no finite answer, or columns say the same as others.
    """
    contestants = len(votes.names)
    # Columns of very different size would look like columns that say the same.
    scale = np.sqrt((columns**2 * votes.count[:, None]).mean(axis=0))
    if not (scale > 0.0).all():
        return None
    design = design_of(votes, np.ones(len(votes)), columns / scale)
    parameters = np.zeros(design.shape[1])
    longest = np.inf
    for _ in range(_MOST_STEPS):
        expected = expit(design @ parameters)
        weight = votes.count * expected * (1.0 - expected)
        inverse = _invert((design.T @ (design * weight[:, None])).toarray())
        if inverse is None or np.abs(parameters).max() > _FAR:
            return None
        if longest < _TOLERANCE:
            break
        step = inverse @ (design.T @ (votes.count * (votes.score - expected)))
        longest = float(np.abs(step).max(initial=0.0))
        parameters += step * min(1.0, _LONGEST_STEP / max(longest, 1e-300))
    else:
        return None
    units = np.concatenate([np.ones(contestants), 1.0 / scale])
    inverse = units[:, None] * inverse * units
    surprise = votes.score - expected
    strengths = parameters[:contestants]
    return LogisticFit(
        strengths=strengths - strengths.mean(),
        coefficients=parameters[contestants:] / scale,
        pulls=Pulls(
            votes=votes,
            slopes=design_of(votes, surprise, surprise[:, None] * columns),
            information=expected * (1.0 - expected),
            inverse=inverse,
            back=inverse[:contestants],
        ),
    )


def _invert(curvature: FloatArray) -> FloatArray | None:
    """(K, K) on the space of mean strengths zero; None where another direction is flat, too."""
    values, directions = np.linalg.eigh(curvature)
    if len(values) > 1 and values[1] < _SINGULAR * max(values[-1], 1e-300):
        return None
    inverse = np.zeros_like(values)
    inverse[1:] = 1.0 / values[1:]
    return np.asarray((directions * inverse) @ directions.T)


@dataclass(frozen=True, slots=True, kw_only=True)
class Coefficient:
    """What one unit of a covariate is worth.

    Attributes:
        points: Elo points, with its interval clustered as the ratings' are.
        error: Its standard error.
        p_value: Of none; None where it can't be told.
    """

    points: Estimate
    error: float
    p_value: float | None


def coefficients_of(fitted: LogisticFit, unit: Unit) -> tuple[Coefficient, ...]:
    """The columns' coefficients in Elo points, by the plain sandwich and Student's t."""
    pulls = replace(fitted.pulls, back=fitted.pulls.inverse)
    variances = plain_covariance(pulls, unit).diagonal()[len(fitted.strengths) :]
    votes = fitted.pulls.votes
    clusters = min((number for number, _ in clusters_of(votes, unit)), default=votes.votes)
    degrees = float(max(clusters - 1, 1))
    found = []
    for value, variance in zip(fitted.coefficients.tolist(), variances.tolist(), strict=True):
        points, error = value * ELO_PER_LOGIT, max(variance, 0.0) ** 0.5
        half = float(t_quantile(degrees)) * error
        lower, upper = (points - half, points + half) if error > 0.0 else (None, None)
        found.append(
            Coefficient(
                points=Estimate(value=points, lower=lower, upper=upper),
                error=error,
                p_value=2.0 * float(t_above(abs(points) / error, degrees)) if error else None,
            )
        )
    return tuple(found)


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
    decided = votes.score != TIE
    clusters = len(np.unique(votes.expert))
    fitted = fit_with_columns(votes, np.ones((len(votes), 1)))
    advantage, error = Estimate(value=None), None
    if fitted is not None:
        unit = Unit.EXPERT if clusters > 1 else Unit.VOTE
        (coefficient,) = coefficients_of(fitted, unit)
        advantage, error = coefficient.points, coefficient.error
    return SideBias(
        advantage=advantage,
        standard_error=error,
        left=share(votes.score[decided] == 1.0, votes.expert[decided]),
        clusters=clusters,
    )
