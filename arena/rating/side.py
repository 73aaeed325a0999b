"""Value of the left side, beside the contestants' own.

The model: the logarithm of the odds that the left one wins is the difference of the strengths plus
the advantage of the left. A tie is half a win for both.

Notation: R rows, C contestants. Strengths and the advantage are logarithms of odds.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import expit

from arena.rating.comparisons import TIE, Comparisons, Estimate, FloatArray, share, t_quantile
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.sandwich import design_matrix

_MOST_STEPS = 60
# Logits, as the longest step.
_TOLERANCE = 1e-10
_LONGEST_STEP = 2.0
_FAR = 30.0
"""A strength or advantage beyond this is on its way to infinity."""
_SINGULAR = 1e-9
_SAME = 1e-6
"""Points. An interval that is narrower says nothing."""


ONE_EXPERT = "no interval: all votes are of one expert"
ALIKE = "no interval: nothing could have come out otherwise"
ONE_SIDED = "unknown: one side won all decided votes"
UNDETERMINED = "unknown: the votes do not determine everybody’s rating"


@dataclass(frozen=True, slots=True, kw_only=True)
class SideBias:
    """Advantage of the left side.

    Attributes:
        advantage: In Elo points with the interval clustered by expert; zero is no bias.
        standard_error: Of the advantage, in Elo points, by the sandwich of G experts times
            G / (G - 1); None where it is not determined.
        left: The share of decided votes that the left picture won.
        clusters: Experts.
        reason: Why the interval, or the advantage, is missing; empty where nothing is.
    """

    advantage: Estimate
    standard_error: float | None
    left: Estimate
    clusters: int
    reason: str = field(default="", metadata={"since": 5})


def side_bias(votes: Comparisons) -> SideBias:
    """The advantage of the left side.

    Args:
        votes: `first` was shown on the left. They must determine ratings; else the advantage is
            unknown and only the share is given.
    """
    experts, expert_of = np.unique(votes.expert, return_inverse=True)
    clusters, decided = len(experts), votes.score != TIE
    left = share(votes.score[decided] == 1.0, votes.expert[decided])
    advantage, error, reason = Estimate(value=None), None, ""
    fitted = _fit_advantage(votes)
    if fitted is None:
        reason = ONE_SIDED if left.value in (0.0, 1.0) else UNDETERMINED
    elif clusters < 2:
        advantage, reason = Estimate(value=fitted[0]), ONE_EXPERT
    else:
        points, pulls, information = fitted
        sums, squares, weights = (
            np.bincount(expert_of, weights=votes.count * values).astype(np.float64)
            for values in (pulls, pulls**2, information)
        )
        error = float(sums @ sums * clusters / (clusters - 1)) ** 0.5
        half = _half_width(sums, squares, weights)
        reason = "" if half > _SAME else ALIKE
        lower, upper = (None, None) if reason else (points - half, points + half)
        advantage = Estimate(value=points, lower=lower, upper=upper)
    return SideBias(
        advantage=advantage, standard_error=error, left=left, clusters=len(experts), reason=reason
    )


def _half_width(sums: FloatArray, squares: FloatArray, weights: FloatArray) -> float:
    """Half the 95 % interval of the advantage, in points, also where experts are uneven.

    The advantage is a mean of experts' habits s with weights w, of variances
    v = t² + squares / w². What one pulls after the fit is r = w (s - w's), so that sum r² is a
    quadratic form in s with the matrix M = W (I - 1w') V (I - w1') W. It is scaled to the
    variance of the mean, w'Vw, and Student's t gets (tr M)² / tr M² degrees of freedom (R. Bell,
    D. McCaffrey, Bias reduction in standard errors for linear regression with multi-stage
    samples, 2002).

    Args:
        sums: (E,) what each expert's votes pull, in points.
        squares: (E,) of single votes.
        weights: (E,) of the experts, which add up to one.
    """
    pulled, even = sums @ sums, weights @ weights
    free = 1.0 - 2.0 * weights
    # What single votes alone make of sum r^2; the rest is t^2 of the experts, at least 0.
    by_votes = squares @ (free + even)
    effect = max(float(pulled - by_votes), 0.0) / max(float(weights**2 @ (free + even)), 1e-300)
    own = effect * weights**2 + squares
    whole, met, square = own.sum(), own @ weights, own @ own
    # With own = w^2 v: tr M = sum own (1 - 2 w) + w'w sum own.
    trace = own @ free + even * whole
    of_square = (1.0 + 2.0 * even) * square + 2.0 * own * weights @ (whole * weights - 2.0 * own)
    of_square += 2.0 * met**2 + even * whole * (even * whole - 4.0 * met)
    if trace <= 0.0:
        return 0.0
    degrees = trace**2 / max(float(of_square), 1e-300)
    # `whole` is w'Vw.
    return float(t_quantile(degrees) * np.sqrt(pulled * whole / trace))


def _fit_advantage(votes: Comparisons) -> tuple[float, FloatArray, FloatArray] | None:
    """Elo points of being on the left; (R,) what one vote pulls at them, (R,) and its weight.

    By maximum likelihood, to 1e-10; None where the votes determine no finite answer.
    """
    # (R, C + 1): 1 and -1 for the two contestants, and 1 for being on the left.
    design = design_matrix(votes, np.ones(len(votes)), np.ones((len(votes), 1)))
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
    # (R,): by how much the advantage moves for a unit of a row's surprise.
    back = np.asarray(design @ inverse[-1])
    pulls = ELO_PER_LOGIT * (votes.score - expected) * back
    return ELO_PER_LOGIT * float(parameters[-1]), pulls, expected * (1.0 - expected) * back


def _invert(curvature: FloatArray) -> FloatArray | None:
    """(C + 1,)² on the space of mean strengths zero; None where another direction is flat, too."""
    values, directions = np.linalg.eigh(curvature)
    if values[1] < _SINGULAR * max(values[-1], 1e-300):
        return None
    inverse = np.zeros_like(values)
    inverse[1:] = 1.0 / values[1:]
    return np.asarray((directions * inverse) @ directions.T)
