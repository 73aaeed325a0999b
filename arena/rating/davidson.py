"""Davidson's model of ties (1970): Bradley-Terry with one more number, how often equals tie.

Contestants of powers x and y win, tie and lose in the proportions x : v sqrt(x y) : y. With half
wins for ties, Bradley-Terry ratings lie the closer together the more ties there are; these do not.
They need the counts of comparisons, of points scored, and of all ties together.

Ties say less here than half wins: where they are the only scores one way, the likelihood can grow
for ever with the strengths and v together. Such votes determine no ratings and give none.

Notation: C contestants, P pairs, B rounds, which are the last axis.
"""

from __future__ import annotations

import numpy as np

from arena.rating.bradley_terry import Meetings
from arena.rating.comparisons import BoolArray, FloatArray, IntArray

_TOLERANCE = 1e-9
_MOST_STEPS = 200
_LONGEST_STEP = 1.0
_NUMBERS_AT_ONCE = 4_000_000
_FARTHEST = 15.0
"""Odds of e^15 are no answer: the likelihood has no top."""


def fit(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    ties: FloatArray,
    *,
    start: FloatArray | None = None,
    together: BoolArray | None = None,
) -> FloatArray:
    """The most likely strengths, each round's mean zero, and the logarithm of v: (C + 1, B).

    Not a number in rounds that determine none. Every round must determine Bradley-Terry strengths,
    see `chains.are_determined`, and neither none nor all of its votes may be ties.

    Args:
        met: The pairs.
        games: (P, B) comparisons of the pair.
        scores: (P, B) what `low` scored in them, a tie half.
        ties: (B,) ties of all pairs together.
        start: (C + 1,) where to begin, zero by default.
        together: (B, C, C) who are in one component, for rounds without comparisons between
            components: then strengths can be compared within a component only.
    """
    rounds = games.shape[1]
    answer = np.zeros((met.contestants + 1, rounds))
    if start is not None:
        answer += start[:, None]
    at_once = max(1, _NUMBERS_AT_ONCE // max((met.contestants + 1) ** 2, len(games)))
    for first in range(0, rounds, at_once):
        block = slice(first, first + at_once)
        answer[:, block] = _newton(
            met,
            games[:, block],
            scores[:, block],
            ties[block],
            answer[:, block],
            None if together is None else together[block],
        )
    return answer


def inverse_curvature(met: Meetings, games: FloatArray, answer: FloatArray) -> FloatArray:
    """(C + 1, C + 1) inverse curvature of the likelihood at an answer (C + 1,).

    The direction of a common shift is filled; what sums to zero over contestants does not see it.

    Args:
        met: The pairs.
        games: (P,) comparisons of the pair.
        answer: Strengths and the logarithm of v.
    """
    expected, tied = chances(answer, met.low, met.high)
    expected, tied = expected[:, None], tied[:, None]
    one = np.ones((1, 1, 1))
    return np.asarray(np.linalg.inv(_curvature(met, games[:, None], expected, tied, one)[0]))


def chances(
    answer: FloatArray, first: IntArray, second: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(n,) the score that `first` (n,) is expected to make against `second`, and of a tie."""
    half_gap = 0.5 * (answer[first] - answer[second])
    win, tie, loss = np.exp(half_gap), np.exp(answer[-1]), np.exp(-half_gap)
    tied = tie / (win + tie + loss)
    return np.asarray(win / (win + tie + loss) + 0.5 * tied), np.asarray(tied)


def _newton(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    ties: FloatArray,
    start: FloatArray,
    together: BoolArray | None,
) -> FloatArray:
    answer = start.copy()
    scored = met.sums(scores, games - scores)
    moving = np.arange(games.shape[1])
    for _ in range(_MOST_STEPS):
        linked = np.ones((1, 1, 1)) if together is None else together[moving]
        step = _step(
            met, games[:, moving], scored[:, moving], ties[moving], answer[:, moving], linked
        )
        longest = np.abs(step).max(axis=0, initial=0.0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
        answer[:, moving] += step
        gone = np.abs(answer[:, moving]).max(axis=0) > _FARTHEST
        answer[:, moving[gone]] = np.nan
        moving = moving[(longest > _TOLERANCE) & ~gone]
        if not len(moving):
            break
    answer[:, moving] = np.nan
    answer[:-1] -= answer[:-1].mean(axis=0)
    return answer


def _step(
    met: Meetings,
    games: FloatArray,
    scored: FloatArray,
    ties: FloatArray,
    answer: FloatArray,
    together: FloatArray | BoolArray,
) -> FloatArray:
    """(C + 1, B) Newton's step; that of the strengths has mean zero."""
    half_gap = 0.5 * (answer[:-1][met.low] - answer[:-1][met.high])
    # Proportions over sqrt(x y): exp(d / 2), v and exp(-d / 2).
    win, tie, loss = np.exp(half_gap), np.exp(answer[-1])[None, :], np.exp(-half_gap)
    everything = win + tie + loss
    tied = tie / everything
    expected = win / everything + 0.5 * tied
    of_low = games * expected
    slope = np.vstack(
        [scored - met.sums(of_low, games - of_low), (ties - (games * tied).sum(axis=0))[None, :]]
    )
    curvature = _curvature(met, games, expected, tied, together)
    # Where there is no top it flattens out; a trace of steepness changes steps, no answer.
    diagonal = np.arange(curvature.shape[1])
    curvature[:, diagonal, diagonal] += 1e-12 * (1.0 + games.sum(axis=0))[:, None]
    return np.asarray(np.linalg.solve(curvature, slope.T[:, :, None])[:, :, 0].T)


def _curvature(
    met: Meetings,
    games: FloatArray,
    expected: FloatArray,
    tied: FloatArray,
    together: FloatArray | BoolArray,
) -> FloatArray:
    """(B, C + 1, C + 1), the direction of a common shift filled as for Bradley-Terry."""
    last = met.contestants
    weight = games * (expected - 0.25 * tied - expected**2)
    both = games * tied * (0.5 - expected)
    curvature = np.zeros((games.shape[1], last + 1, last + 1))
    curvature[:, met.low, met.high] = -weight.T
    curvature[:, met.high, met.low] = -weight.T
    diagonal = np.arange(last)
    of_contestants = met.totals(weight).T
    curvature[:, diagonal, diagonal] = of_contestants
    curvature[:, :last, :last] += of_contestants.mean(axis=1)[:, None, None] / last * together
    curvature[:, :last, last] = curvature[:, last, :last] = met.sums(both, -both).T
    curvature[:, last, last] = (games * tied * (1.0 - tied)).sum(axis=0)
    return curvature
