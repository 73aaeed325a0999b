"""Bradley-Terry ratings by maximum likelihood, many resamples at once.

The model: against a rival whose strength is less by d, a contestant's expected score is
1 / (1 + exp(-d)); a tie is half a win for both. Strengths are known up to a shift, so all
equations are solved on the space of mean zero: no ridge, no anchor contestant.

Notation: B rounds, C contestants, P pairs.
"""

from __future__ import annotations

import math

import numpy as np

from arena.rating.comparisons import FloatArray, IntArray

ELO_PER_LOGIT = 400.0 / math.log(10.0)
"""Points per unit of strength: 400 points are odds of 10 to 1."""

MEAN_ELO = 1000.0

_TOLERANCE = 1e-9
_MOST_STEPS = 200
_LONGEST_STEP = 2.0
"""No strength changes by more in one step: far out a whole Newton step can overshoot."""


class DidNotConverge(ArithmeticError):
    """Newton's steps did not become small; the data are worse than the checks foresee."""


def to_elo(strengths: FloatArray) -> FloatArray:
    """Strengths (..., C) on the Elo scale, their mean at 1000."""
    centred = strengths - strengths.mean(axis=-1, keepdims=True)
    return np.asarray(MEAN_ELO + ELO_PER_LOGIT * centred)


def fit(
    *,
    contestants: int,
    low: IntArray,
    high: IntArray,
    games: FloatArray,
    scores: FloatArray,
    start: FloatArray | None = None,
) -> FloatArray:
    """The most likely strengths (B, C), each round's mean zero.

    Every round must determine them: see `connectivity.determined`.

    Args:
        contestants: C.
        low: (P,) who met, each pair once.
        high: (P,) whom.
        games: (B, P) comparisons of the pair, not negative.
        scores: (B, P) what `low` scored in them.
        start: (C,) where to begin, zero by default; the answer does not depend on it.

    Raises:
        DidNotConverge: After 200 steps a strength still moved by more than 1e-9.
    """
    rounds = len(games)
    strengths = np.zeros((rounds, contestants))
    if start is not None:
        strengths += start - start.mean()
    moving = np.arange(rounds)
    for _ in range(_MOST_STEPS):
        step = _newton_step(strengths[moving], low, high, games[moving], scores[moving])
        longest = np.abs(step).max(axis=1, initial=0.0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))[:, None]
        strengths[moving] += step
        moving = moving[longest > _TOLERANCE]
        if not len(moving):
            return np.asarray(strengths - strengths.mean(axis=1, keepdims=True))
    raise DidNotConverge(f"{len(moving)} of {rounds} fits still moved after {_MOST_STEPS} steps")


def _newton_step(
    strengths: FloatArray, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> FloatArray:
    """(B, C), of mean zero: the step towards the top of the likelihood's parabola."""
    contestants = strengths.shape[1]
    expected = 1.0 / (1.0 + np.exp(strengths[:, high] - strengths[:, low]))
    surprise = scores - games * expected
    weight = games * expected * (1.0 - expected)
    meets = np.zeros((len(low), contestants))
    meets[np.arange(len(low)), low] = 1.0
    meets[np.arange(len(low)), high] = -1.0
    gradient = surprise @ meets
    curvature = np.zeros((len(strengths), contestants, contestants))
    curvature[:, low, high] = -weight
    curvature[:, high, low] = -weight
    diagonal = np.arange(contestants)
    curvature[:, diagonal, diagonal] = weight @ np.abs(meets)
    # The curvature is zero along the shift of all strengths only. Filling that one direction, by
    # the size of the rest, makes it invertible and leaves steps of mean zero as they are.
    filling = curvature[:, diagonal, diagonal].mean(axis=1) / contestants
    curvature += filling[:, None, None]
    return np.asarray(np.linalg.solve(curvature, gradient[:, :, None])[:, :, 0])
