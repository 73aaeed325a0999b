"""Bradley-Terry ratings by maximum likelihood, many resamples at once.

The model: against a rival whose strength is less by d, a contestant's expected score is
1 / (1 + exp(-d)); a tie is half a win for both. Strengths are known up to a shift, so all
equations are solved on the space of mean zero: no ridge, no anchor contestant.

Notation: C contestants, P pairs, B rounds, which are the last axis everywhere but in `fit`.
"""

from __future__ import annotations

import math

import numpy as np

from arena.rating.comparisons import BoolArray, FloatArray, IntArray

ELO_PER_LOGIT = 400.0 / math.log(10.0)
"""Points per unit of strength: 400 points are odds of 10 to 1."""

MEAN_ELO = 1000.0

_TOLERANCE = 1e-9
_MOST_STEPS = 200
_LONGEST_STEP = 2.0
"""No strength changes by more in one step: far out a whole Newton step can overshoot."""
_NUMBERS_AT_ONCE = 4_000_000


class DidNotConverge(ArithmeticError):
    """Newton's steps did not become small; the data are worse than the checks foresee."""


class Meetings:
    """Who met whom: sums over the pairs of each contestant.

    Args:
        contestants: C.
        low: (P,) who met, each pair once.
        high: (P,) whom.
    """

    def __init__(self, *, contestants: int, low: IntArray, high: IntArray) -> None:
        self.contestants, self.low, self.high = contestants, low, high
        ends = np.concatenate([low, high])
        self._by_end = np.argsort(ends, kind="stable")
        self._present, self._starts = np.unique(ends[self._by_end], return_index=True)

    def sums(self, of_low: FloatArray, of_high: FloatArray) -> FloatArray:
        """(C, B): a pair's first value counts for its low contestant, the second for its high."""
        totals = np.zeros((self.contestants, of_low.shape[1]))
        if len(self.low):
            values = np.concatenate([of_low, of_high])[self._by_end]
            totals[self._present] = np.add.reduceat(values, self._starts, axis=0)
        return totals

    def totals(self, values: FloatArray) -> FloatArray:
        """(C, B): a pair's value counts for both."""
        return self.sums(values, values)


def to_elo(strengths: FloatArray) -> FloatArray:
    """Strengths (C, ...) on the Elo scale, their mean at 1000."""
    return np.asarray(MEAN_ELO + ELO_PER_LOGIT * (strengths - strengths.mean(axis=0)))


def fit(
    *,
    contestants: int,
    low: IntArray,
    high: IntArray,
    games: FloatArray,
    scores: FloatArray,
    start: FloatArray | None = None,
) -> FloatArray:
    """The most likely strengths (n, C) of n sets of votes, each set's mean zero, to 1e-9.

    Every set must determine them: see `chains.are_determined`.

    Args:
        contestants: C.
        low: (P,) who met, each pair once.
        high: (P,) whom.
        games: (n, P) comparisons of the pair, not negative.
        scores: (n, P) what `low` scored in them.
        start: (C,) where to begin, zero by default; the answer does not depend on it.

    Raises:
        DidNotConverge: After 200 steps a strength still moved by more than 1e-9.
    """
    met = Meetings(contestants=contestants, low=low, high=high)
    return newton(met, games.T, scores.T, start=None if start is None else start[:, None]).T


def newton(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    *,
    start: FloatArray | None = None,
    together: BoolArray | None = None,
) -> FloatArray:
    """The most likely strengths (C, B), each round's mean zero, by Newton's method to 1e-9.

    Every round must determine them: see `chains.are_determined`.

    Args:
        met: The pairs.
        games: (P, B) comparisons of the pair, not negative.
        scores: (P, B) what `low` scored in them.
        start: (C, B) where to begin, zero by default; the answer does not depend on it.
        together: (B, C, C) who are in one component, for rounds without comparisons between
            components: then strengths can be compared within a component only.

    Raises:
        DidNotConverge: After 200 steps a strength still moved by more than 1e-9.
    """
    strengths = np.zeros((met.contestants, games.shape[1]))
    if start is not None:
        strengths += start - start.mean(axis=0)
    at_once = max(1, _NUMBERS_AT_ONCE // max(1, met.contestants**2))
    for first in range(0, games.shape[1], at_once):
        block = slice(first, first + at_once)
        strengths[:, block] = _newton(
            met,
            games[:, block],
            scores[:, block],
            strengths[:, block],
            None if together is None else together[block],
        )
    return strengths


def inverse_curvature(met: Meetings, games: FloatArray, strengths: FloatArray) -> FloatArray:
    """(C, C) covariance of the strengths if votes were independent and had no ties.

    It is the inverse of the likelihood's curvature on the space of mean zero; its rows add to
    zero.

    Args:
        met: The pairs.
        games: (P,) comparisons of the pair.
        strengths: (C,).
    """
    expected = _expected(met, strengths[:, None])
    curvature = _curvature(met, games[:, None] * expected * (1.0 - expected))[0]
    contestants = met.contestants
    filling = float(_filling(curvature[None])[0])
    inverse = np.linalg.inv(curvature + filling)
    return np.asarray(inverse - 1.0 / (filling * contestants**2))


def _newton(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    start: FloatArray,
    together: BoolArray | None,
) -> FloatArray:
    strengths = start.copy()
    scored = met.sums(scores, games - scores)
    moving = np.arange(games.shape[1])
    for _ in range(_MOST_STEPS):
        expected = _expected(met, strengths[:, moving])
        weight = games[:, moving] * expected * (1.0 - expected)
        of_low = games[:, moving] * expected
        slope = scored[:, moving] - met.sums(of_low, games[:, moving] - of_low)
        curvature = _curvature(met, weight)
        filling = _filling(curvature)[:, None, None]
        curvature += filling if together is None else filling * together[moving]
        step = np.linalg.solve(curvature, slope.T[:, :, None])[:, :, 0].T
        longest = np.abs(step).max(axis=0, initial=0.0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
        strengths[:, moving] += step
        moving = moving[longest > _TOLERANCE]
        if not len(moving):
            return np.asarray(strengths - strengths.mean(axis=0))
    raise DidNotConverge(f"{len(moving)} fits still moved after {_MOST_STEPS} steps")


def _expected(met: Meetings, strengths: FloatArray) -> FloatArray:
    """(P, B) what low is expected to score in one comparison."""
    return np.asarray(1.0 / (1.0 + np.exp(strengths[met.high] - strengths[met.low])))


def _curvature(met: Meetings, weight: FloatArray) -> FloatArray:
    """(B, C, C) of the negative log-likelihood, for weights (P, B) of the pairs."""
    curvature = np.zeros((weight.shape[1], met.contestants, met.contestants))
    curvature[:, met.low, met.high] = -weight.T
    curvature[:, met.high, met.low] = -weight.T
    diagonal = np.arange(met.contestants)
    curvature[:, diagonal, diagonal] = met.totals(weight).T
    return curvature


def _filling(curvature: FloatArray) -> FloatArray:
    """(B,) what to add to every entry.

    The curvature is zero along the shift of all strengths only. Filling that one direction, by the
    size of the rest, makes it invertible and leaves steps of mean zero as they are. With several
    components that holds for each of them.
    """
    size = curvature.diagonal(axis1=1, axis2=2).mean(axis=1)
    return np.asarray(np.where(size > 0.0, size, 1.0) / curvature.shape[1])
