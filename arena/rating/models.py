"""Ratings from votes: Bradley-Terry, Davidson's model of ties, and online Elo.

Bradley-Terry: against a rival whose strength is less by d, a contestant's expected score is
1 / (1 + exp(-d)); a tie is half a win for both. Davidson (1970): contestants of powers x and y
win, tie and lose in the proportions x : v sqrt(x y) : y; Bradley-Terry is the case v = 0 with
half wins for ties. Both are fitted by maximum likelihood, many rounds of resampled votes at once.
Strengths are known up to a shift, so all equations are solved on the space of mean zero.

Online Elo depends on the order of the votes: every round plays a resample in random order.

Notation: C contestants, P pairs, B rounds, which are the last axis; K parameters: C strengths,
and the logarithm of v where ties have a parameter of their own.
"""

import math
from collections.abc import Iterator

import numpy as np

from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    count_pairs,
)

ELO_PER_LOGIT = 400.0 / math.log(10.0)
"""Points per unit of strength: 400 points are odds of 10 to 1."""

MEAN_ELO = 1000.0

# In logits, as all parameters.
_TOLERANCE = 1e-9
_CHORD_TOLERANCE = 1e-7
"""The error that is left is a hundredth of that, 2e-7 points."""
_MOST_STEPS = 200
_MOST_CHORD_STEPS = 40
_LONGEST_STEP = 1.0
"""No parameter changes by more in one step: far out a whole Newton step can overshoot."""
_FARTHEST = 15.0
"""With a parameter of ties the likelihood may have no top: odds of e^15 are no answer."""
# Numbers in the largest array of a block of rounds.
_NUMBERS_AT_ONCE = 4_000_000


class DidNotConverge(ArithmeticError):
    """Newton's steps did not become small; the data are worse than the checks foresee."""


class Meetings:
    """Sums over the votes of each of C contestants' pairs."""

    def __init__(self, contestants: int, counts: PairCounts) -> None:
        from scipy.sparse import csr_array  # slow to load

        self.contestants, self.low, self.high = contestants, counts.low, counts.high
        pairs, shape = np.arange(len(counts.low)), (contestants, len(counts.low))
        # (C, P), 1 where the contestant is the pair's low or high: times values (P, B) of
        # pairs they are sums (C, B) by contestant.
        self._of_low, self._of_high = (
            csr_array((np.ones(len(pairs)), (ends, pairs)), shape=shape)
            for ends in (counts.low, counts.high)
        )
        # All 2 P ends sorted by contestant, and where each one's run starts, for reduceat.
        ends = np.concatenate([counts.high, counts.low])
        self.by_end = np.argsort(ends, kind="stable")
        self.present, self.starts = np.unique(ends[self.by_end], return_index=True)

    def sums(self, of_low: FloatArray, of_high: FloatArray) -> FloatArray:
        """(C, B): a pair's first value counts for its low contestant, the second for its high."""
        return np.asarray(self._of_low @ of_low + self._of_high @ of_high)


def to_elo(strengths: FloatArray) -> FloatArray:
    """Strengths (C, ...) on the Elo scale, their mean at 1000."""
    return np.asarray(MEAN_ELO + ELO_PER_LOGIT * (strengths - strengths.mean(axis=0)))


def fit(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    ties: FloatArray | None = None,
    *,
    start: FloatArray | None = None,
    together: BoolArray | None = None,
) -> FloatArray:
    """The most likely parameters (K, B) by Newton's method to 1e-9, strengths of mean zero.

    Every round must determine Bradley-Terry strengths: see `chains.are_determined`.

    Args:
        met: The pairs.
        games: (P, B) comparisons of the pair, not negative.
        scores: (P, B) what `low` scored in them, a tie half.
        ties: (B,) ties of all pairs together for Davidson's model, neither none nor all votes; a
            round that determines no answer in it gives NaN. None for Bradley-Terry.
        start: (K,) where to begin, zero by default; the answer does not depend on it. Rounds of
            Bradley-Terry that resemble each other take less time from the answer of their mean.
        together: (B, C, C) who are in one component, for rounds without comparisons between
            components: then strengths can be compared within a component only.

    Raises:
        DidNotConverge: After 200 steps a strength of Bradley-Terry still moved.
    """
    parameters = met.contestants + (ties is not None)
    answer = np.zeros((parameters, games.shape[1]))
    if start is not None:
        answer += start[:, None]
    left = np.arange(games.shape[1])
    if start is not None and ties is None and together is None and games.size:
        left = _follow_chord(met, games, scores, answer)
    # Curvatures (B, K, K) and comparisons (P, B) of a block must fit into memory.
    at_once = max(1, _NUMBERS_AT_ONCE // max(1, parameters**2, len(games)))
    for first in range(0, len(left), at_once):
        block = left[first : first + at_once]
        answer[:, block] = _climb(
            met,
            games[:, block],
            scores[:, block],
            None if ties is None else ties[block],
            answer[:, block],
            None if together is None else together[block],
        )
    answer[: met.contestants] -= answer[: met.contestants].mean(axis=0)
    return answer


def inverse_curvature(met: Meetings, games: FloatArray, answer: FloatArray) -> FloatArray:
    """(K, K) inverse curvature of the likelihood at an answer (K,) to comparisons (P,).

    The direction of a common shift is filled; what sums to zero over contestants does not see it.
    """
    expected, tied = chances(met.contestants, answer, met.low, met.high)
    curvature = _curvature(
        met, games[:, None], expected[:, None], tied[:, None], len(answer), np.ones((1, 1, 1))
    )
    return np.asarray(np.linalg.inv(curvature[0]))


def chances(
    contestants: int, answer: FloatArray, first: IntArray, second: IntArray
) -> tuple[FloatArray, FloatArray]:
    """(n, ...) the score that `first` (n,) is expected to make against `second`, and of a tie."""
    # x : v sqrt(x y) : y, all divided by sqrt(x y): with h half the gap, e^h : v : e^-h.
    half_gap = 0.5 * (answer[first] - answer[second])
    win, loss = np.exp(half_gap), np.exp(-half_gap)
    tie = np.exp(answer[-1]) if len(answer) > contestants else 0.0
    tied = tie / (win + tie + loss)
    return np.asarray(win / (win + tie + loss) + 0.5 * tied), np.asarray(tied)


# --- Newton's steps ------------------------------------------------------------------------------


def _follow_chord(
    met: Meetings, games: FloatArray, scores: FloatArray, answer: FloatArray
) -> IntArray:
    """Move Bradley-Terry strengths (C, B) of rounds that resemble each other, in place.

    Every round follows its own slope by the curvature of the mean round (the chord method): one
    inverse serves all rounds. Returns the rounds that did not arrive; they stay where they were.
    """
    inverse = inverse_curvature(met, games.mean(axis=1), answer[:, 0])
    scored = met.sums(scores, games - scores)
    # (B,): a round with more comparisons is curved more, about in proportion.
    size = games.sum(axis=0) / games.sum(axis=0).mean()
    moving, now = np.arange(games.shape[1]), answer.copy()
    for _ in range(_MOST_CHORD_STEPS):
        # One of power x scores x / (x + y) in a game against one of power y.
        power: FloatArray = np.exp(now)
        shares = power[met.low]
        shares += power[met.high]
        np.divide(games, shares, out=shares)
        step = inverse @ (scored - power * met.sums(shares, shares)) / size
        longest = np.abs(step).max(axis=0)
        now += step * np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
        stays = longest > _CHORD_TOLERANCE
        if 2 * stays.sum() < len(stays):  # to copy them for a few is not worth it
            answer[:, moving[~stays]] = now[:, ~stays]
            moving, now, games = moving[stays], now[:, stays], games[:, stays]
            scored, size = scored[:, stays], size[stays]
        if not len(moving):
            break
    return moving


def _climb(
    met: Meetings,
    games: FloatArray,
    scores: FloatArray,
    ties: FloatArray | None,
    start: FloatArray,
    together: BoolArray | None,
) -> FloatArray:
    """(K, B) parameters by Newton's steps, those of strengths of mean zero."""
    answer = start.copy()
    # (C, B); only the rounds that still move are stepped again.
    scored = met.sums(scores, games - scores)
    moving = np.arange(games.shape[1])
    for _ in range(_MOST_STEPS):
        linked = np.ones((1, 1, 1)) if together is None else together[moving]
        played, now = games[:, moving], answer[:, moving]
        expected, tied = chances(met.contestants, now, met.low, met.high)
        of_low = played * expected
        # (C, B) of the log-likelihood: what was scored less what is expected.
        slope = scored[:, moving] - met.sums(of_low, played - of_low)
        curvature = _curvature(met, played, expected, tied, len(now), linked)
        if ties is not None:
            slope = np.vstack([slope, ties[moving] - (played * tied).sum(axis=0)])
            # Where there is no top it flattens out; a trace of steepness changes steps, no answer.
            diagonal = np.arange(len(now))
            curvature[:, diagonal, diagonal] += 1e-12 * (1.0 + played.sum(axis=0))[:, None]
        # (B, K, K) against (B, K, 1); rounds are the last axis again.
        step = np.asarray(np.linalg.solve(curvature, slope.T[:, :, None])[:, :, 0].T)
        longest = np.abs(step).max(axis=0, initial=0.0)
        step *= np.minimum(1.0, _LONGEST_STEP / np.maximum(longest, 1e-300))
        answer[:, moving] += step
        stays = longest > _TOLERANCE
        if ties is not None:
            is_gone = np.abs(answer[:, moving]).max(axis=0) > _FARTHEST
            answer[:, moving[is_gone]] = np.nan
            stays &= ~is_gone
        moving = moving[stays]
        if not len(moving):
            return answer
    if ties is None:
        raise DidNotConverge(f"{len(moving)} fits still moved after {_MOST_STEPS} steps")
    answer[:, moving] = np.nan
    return answer


def _curvature(
    met: Meetings,
    games: FloatArray,
    expected: FloatArray,
    tied: FloatArray,
    parameters: int,
    together: FloatArray | BoolArray,
) -> FloatArray:
    """(B, K, K) of the negative log-likelihood, made invertible.

    It is zero along the shift of all strengths. That direction is filled, in every component by
    the size of the rest, which leaves steps of mean zero as they are.
    """
    size = met.contestants
    # (P, B) variances of the scores: E[s^2] = expected - tied / 4.
    weight = games * (expected - 0.25 * tied - expected**2)
    curvature = np.zeros((games.shape[1], parameters, parameters))
    curvature[:, met.low, met.high] = -weight.T
    curvature[:, met.high, met.low] = -weight.T
    of_contestants = met.sums(weight, weight).T
    curvature[:, np.arange(size), np.arange(size)] = of_contestants
    mean = of_contestants.mean(axis=1)
    filling = np.where(mean > 0.0, mean, 1.0) / size
    curvature[:, :size, :size] += filling[:, None, None] * together
    if parameters > size:
        # By log v expected changes by tied (1/2 - expected), tied by tied (1 - tied).
        both = games * tied * (0.5 - expected)
        curvature[:, :size, size] = curvature[:, size, :size] = met.sums(both, -both).T
        curvature[:, size, size] = (games * tied * (1.0 - tied)).sum(axis=0)
    return curvature


# --- Online Elo ----------------------------------------------------------------------------------


K = 4.0
"""Points at stake in one vote."""

# With h for half a strength in logits, a vote moves both by a quarter of the stake in logits times
# tanh(h of the second - h of the first) + 1 (won), 0 (tied) or -1 (lost).
_ELO_PER_HALF = 2.0 * ELO_PER_LOGIT

_VOTES_AT_ONCE = 32_000
"""How many votes are drawn ahead in all rounds together: what stays in a core's second cache."""


def resample_elo(votes: Comparisons, *, rounds: int, seed: int, k: float = K) -> FloatArray:
    """(C, B) ratings after as many votes as there are, drawn with replacement in random order."""
    halves = np.zeros(len(votes.names) * rounds)
    for places, gains in _draw_votes(votes, rounds, seed):
        _play(halves, places, gains, 0.5 * k / _ELO_PER_HALF)
    return np.asarray(MEAN_ELO + _ELO_PER_HALF * halves.reshape(-1, rounds))


def _draw_votes(
    votes: Comparisons, rounds: int, seed: int
) -> Iterator[tuple[IntArray, FloatArray]]:
    """Resampled votes, some at a time: the places (n, 2, B) of those who met, and gains (n, B).

    A place is contestant * B + round; a gain is 1, 0 or -1.
    """
    rng = np.random.default_rng(seed)
    counts = count_pairs(votes)
    kind = np.repeat(counts.pair_of * 3 + counts.outcome_of, votes.count)
    kind.sort()  # so that no order of lines counts
    pair, outcome = kind // 3, kind % 3
    ends = np.stack([counts.low[pair], counts.high[pair]], axis=1) * rounds
    gain = 1.0 - outcome
    every_round = np.arange(rounds)
    at_once = max(1, min(len(kind), _VOTES_AT_ONCE // rounds))
    for first in range(0, len(kind), at_once):
        drawn = rng.integers(0, len(kind), size=(min(at_once, len(kind) - first), rounds))
        yield ends[drawn].transpose(0, 2, 1) + every_round, gain[drawn]


def _play(halves: FloatArray, places: IntArray, gains: FloatArray, step: float) -> None:
    """Update `halves` (C * B,) by votes, one after the other in all rounds at once."""
    size, _, rounds = places.shape
    # The halves of the two who meet in each round; `both` is the same memory, flat.
    values = np.empty((2, rounds))
    first, second, both = values[0], values[1], values.reshape(-1)
    moved = np.empty(rounds)
    for place, gain in zip(places.reshape(size, -1), gains, strict=True):
        # Places are within range; "raise" would go through a buffer.
        halves.take(place, out=both, mode="clip")
        np.subtract(second, first, moved)
        np.tanh(moved, moved)
        np.add(moved, gain, moved)
        np.multiply(moved, step, moved)
        np.add(first, moved, first)
        np.subtract(second, moved, second)
        halves[place] = both  # two contestants of each round: no place is there twice
