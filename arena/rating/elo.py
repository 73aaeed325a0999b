"""Online Elo, as the paper words it: after each vote the winner gains what the loser loses.

The rating depends on the order of the votes, so every round of the bootstrap plays a resample in
random order. Its interval shrinks only until the last few hundred votes of a contestant outweigh
the earlier ones: more votes do not narrow it. It is an option; the default is Bradley-Terry.

Notation: C contestants, R rows, V votes, B rounds, G kinds of votes (pair and outcome).
"""

from __future__ import annotations

from collections.abc import Iterator
from math import tanh

import numpy as np
from numpy.typing import NDArray

from arena.rating.bradley_terry import ELO_PER_LOGIT, MEAN_ELO
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, count_pairs

K = 4.0
"""Points at stake in one vote."""

INTERVAL_NOTE = (
    "Online Elo follows the latest votes: its interval does not shrink with more votes, and the "
    "order of the votes matters."
)

# With h for half a strength in logits, a vote moves both by a quarter of the stake in logits times
# tanh(h of the second - h of the first) + 1 (won), 0 (tied) or -1 (lost).
_ELO_PER_HALF = 2.0 * ELO_PER_LOGIT

_NUMBERS_AT_ONCE = 32_000
"""How many votes are drawn ahead in all rounds together: what stays in a core's second cache."""
_FEW = 10_000
"""Up to so many votes each has its own place in the tables; more are looked up by their kind, of
which there are fewer, so that the tables stay in the caches."""


def replay(votes: Comparisons, *, k: float = K) -> FloatArray:
    """(C,) ratings after all votes in the order of their rows, from 1000 each."""
    step = 0.5 * k / _ELO_PER_HALF
    halves = [0.0] * len(votes.names)
    columns = (votes.first, votes.second, 2.0 * votes.score - 1.0)
    rows = (np.repeat(column, votes.count).tolist() for column in columns)
    for first, second, gain in zip(*rows, strict=True):
        moved = step * (tanh(halves[second] - halves[first]) + gain)
        halves[first] += moved
        halves[second] -= moved
    return MEAN_ELO + _ELO_PER_HALF * np.array(halves)


def resample_elo(votes: Comparisons, *, rounds: int, seed: int, k: float = K) -> FloatArray:
    """(C, B) ratings after as many votes as there are, drawn with replacement in random order."""
    halves = np.zeros(len(votes.names) * rounds)
    for places, gains in _drawn(votes, rounds, seed):
        _play(halves, places, gains, 0.5 * k / _ELO_PER_HALF)
    return np.asarray(MEAN_ELO + _ELO_PER_HALF * halves.reshape(-1, rounds))


def _drawn(votes: Comparisons, rounds: int, seed: int) -> Iterator[tuple[IntArray, FloatArray]]:
    """Resampled votes, some at a time: the places (n, 2, B) of those who met, and gains (n, B).

    A place is contestant * B + round; a gain is 1, 0 or -1. Both are overwritten by the next.
    """
    rng = np.random.default_rng(seed)
    kind_of, ends, gain = _kinds(votes)
    if few := len(kind_of) <= _FEW:
        ends, gain = ends[:, kind_of], gain[kind_of]
    low, high = ends * rounds
    at_once = max(1, min(len(kind_of), _NUMBERS_AT_ONCE // rounds))
    places, gains = np.empty((at_once, 2, rounds), dtype=np.int64), np.empty((at_once, rounds))
    kinds, found = np.empty((2, at_once, rounds), dtype=np.int64)
    every_round = np.arange(rounds)
    for first in range(0, len(kind_of), at_once):
        some = slice(min(at_once, len(kind_of) - first))
        drawn = rng.integers(0, len(kind_of), size=kinds[some].shape)
        # "clip" spares numpy a check of every index.
        if not few:
            kinds[some] = kind_of.take(drawn, mode="clip")
            drawn = kinds[some]
        for side, contestant in enumerate((low, high)):
            contestant.take(drawn, out=found[some], mode="clip")
            np.add(found[some], every_round, out=places[some, side])
        gain.take(drawn, out=gains[some], mode="clip")
        yield places[some], gains[some]


def _kinds(votes: Comparisons) -> tuple[NDArray[np.unsignedinteger], IntArray, FloatArray]:
    """(V,) the kind of each vote, (2, G) who met in each kind, and (G,) what the first gains."""
    counts = count_pairs(votes)
    ends = np.repeat([counts.low, counts.high], 3, axis=1)
    gain = np.tile([1.0, 0.0, -1.0], len(counts.low))
    kind_of = np.repeat(counts.pair_of * 3 + counts.outcome_of, votes.count)
    kind_of.sort()  # so that no order of lines counts
    return kind_of.astype(np.min_scalar_type(len(gain))), ends, gain


def _play(halves: FloatArray, places: IntArray, gains: FloatArray, step: float) -> None:
    """Update `halves` (C * B,) by votes, one after the other in all rounds at once."""
    size, _, rounds = places.shape
    values = np.empty((2, rounds))
    first, second, both = values[0], values[1], values.reshape(-1)
    moved = np.empty(rounds)
    for place, gain in zip(places.reshape(size, -1), gains, strict=True):
        halves.take(place, out=both, mode="clip")
        np.subtract(second, first, moved)
        np.tanh(moved, moved)
        np.add(moved, gain, moved)
        np.multiply(moved, step, moved)
        np.add(first, moved, first)
        np.subtract(second, moved, second)
        halves[place] = both  # two contestants of each round: no place is there twice
