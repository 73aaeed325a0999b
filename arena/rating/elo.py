"""Online Elo, as the paper words it: after each vote the winner gains what the loser loses.

The rating depends on the order of the votes, and its bootstrap interval shrinks only until the
last few hundred votes of a contestant outweigh the earlier ones: more votes do not narrow it.
It is an option; the default method is Bradley-Terry.

Notation: B rounds, C contestants, V votes.
"""

from __future__ import annotations

import numpy as np

from arena.rating.bradley_terry import ELO_PER_LOGIT, MEAN_ELO
from arena.rating.comparisons import Comparisons, FloatArray, IntArray

K = 4.0
"""Points at stake in one vote."""

_VOTES_AT_ONCE = 1024


def replay(votes: Comparisons, *, k: float = K) -> FloatArray:
    """(C,) ratings after all votes in their recorded order, from 1000 each."""
    order = np.arange(len(votes))[:, None]
    ratings = np.full((1, len(votes.names)), MEAN_ELO)
    _play(ratings, votes, order, k)
    return ratings.reshape(-1)


def resampled(votes: Comparisons, *, rounds: int, seed: int, k: float = K) -> FloatArray:
    """(B, C) ratings after as many votes as there are, drawn with replacement in random order."""
    rng = np.random.default_rng(seed)
    ratings = np.full((rounds, len(votes.names)), MEAN_ELO)
    left = len(votes)
    while left:
        size = min(left, _VOTES_AT_ONCE)
        _play(ratings, votes, rng.integers(0, len(votes), size=(size, rounds)), k)
        left -= size
    return ratings


def _play(ratings: FloatArray, votes: Comparisons, order: IntArray, k: float) -> None:
    """Update ratings (B, C) in place by votes `order` (n, B), one row after the other."""
    flat = ratings.reshape(-1)
    offset = np.arange(len(ratings)) * ratings.shape[1]
    first = votes.first[order] + offset
    second = votes.second[order] + offset
    score = votes.score[order]
    for one, other, scored in zip(first, second, score, strict=True):
        mine, theirs = flat[one], flat[other]
        expected = 1.0 / (1.0 + np.exp((theirs - mine) / ELO_PER_LOGIT))
        gain = k * (scored - expected)
        flat[one] = mine + gain
        flat[other] = theirs - gain
