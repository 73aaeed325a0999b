"""What the left side is worth, beside what the contestants are worth.

The model: the logarithm of the odds that the left one wins is the difference of the strengths plus
the advantage of the left. A tie is half a win for both.

Notation: R rows, C contestants. Strengths and the advantage are logarithms of odds.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from arena.rating.comparisons import TIE, Comparisons, Estimate, FloatArray, share, t_quantile
from arena.rating.models import ELO_PER_LOGIT
from arena.rating.sandwich import design_of

_MOST_STEPS = 60
_TOLERANCE = 1e-10
_LONGEST_STEP = 2.0
_FAR = 30.0
"""A strength or advantage beyond this is on its way to infinity."""
_SINGULAR = 1e-9


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
    """The advantage of the left side.

    Args:
        votes: `first` was shown on the left. They must determine ratings; else the advantage is
            unknown and only the share is given.
    """
    experts, expert_of = np.unique(votes.expert, return_inverse=True)
    advantage, error = Estimate(value=None), None
    fitted = _fit_advantage(votes)
    if fitted is not None:
        points, pulls = fitted
        clusters = len(experts)
        if clusters > 1:
            sums = np.bincount(expert_of, weights=votes.count * pulls)
            variance = float((sums**2).sum()) * clusters / (clusters - 1)
        else:
            clusters, variance = votes.votes, float((votes.count * pulls**2).sum())
        error = variance**0.5
        half = float(t_quantile(clusters - 1)) * error
        lower, upper = (points - half, points + half) if error > 0.0 else (None, None)
        advantage = Estimate(value=points, lower=lower, upper=upper)
    decided = votes.score != TIE
    return SideBias(
        advantage=advantage,
        standard_error=error,
        left=share(votes.score[decided] == 1.0, votes.expert[decided]),
        clusters=len(experts),
    )


def _fit_advantage(votes: Comparisons) -> tuple[float, FloatArray] | None:
    """Elo points of being on the left, and what one vote of each row (R,) pulls at them.

    By maximum likelihood, to 1e-10; None where the votes determine no finite answer.
    """
    design = design_of(votes, np.ones(len(votes)), np.ones((len(votes), 1)))
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
    pulls = (votes.score - expected) * (design @ inverse[-1])
    return ELO_PER_LOGIT * float(parameters[-1]), ELO_PER_LOGIT * np.asarray(pulls)


def _invert(curvature: FloatArray) -> FloatArray | None:
    """(C + 1,)² on the space of mean strengths zero; None where another direction is flat, too."""
    values, directions = np.linalg.eigh(curvature)
    if values[1] < _SINGULAR * max(values[-1], 1e-300):
        return None
    inverse = np.zeros_like(values)
    inverse[1:] = 1.0 / values[1:]
    return np.asarray((directions * inverse) @ directions.T)
