"""Influence of single experts on a table.

Notation: C contestants, P pairs that met, E experts. Strengths are natural logarithms of odds.
"""

import numpy as np

from arena.rating.chains import are_determined
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    count_pairs,
)
from arena.rating.models import Meetings, fit

SLIGHT = 0.75
"""What a contestant who is slightly preferred scores, where that is weighed."""


def bradley_terry(votes: Comparisons, is_slight: BoolArray | None = None) -> FloatArray | None:
    """(C,) strengths of two contestants or more; None where the votes do not determine them.

    Args:
        votes: What was voted.
        is_slight: (R,) preferences that count as three quarters of a win; by default none.
    """
    if len(votes.names) < 2:
        return None
    counts = count_pairs(votes)
    scores: FloatArray = counts.scores
    if is_slight is not None:
        score = 1.0 - 0.5 * counts.outcome_of
        # From 1 and 0 to 3/4 and 1/4; a tie stays a half.
        graded = np.where(is_slight, 0.5 + (2.0 * SLIGHT - 1.0) * (score - 0.5), score)
        scores = np.bincount(counts.pair_of, weights=votes.count * graded).astype(np.float64)
    start = np.zeros(len(votes.names))
    strengths = _fits(counts, counts.games[None], scores[None], start)[0]
    return None if np.isnan(strengths).any() else strengths


def without_each_expert(votes: Comparisons, start: FloatArray) -> FloatArray:
    """(E, C) strengths by the votes of all experts but one; not a number where undetermined.

    Args:
        votes: Of everybody, experts numbered from 0 without gaps.
        start: (C,) strengths by all votes, to begin at.
    """
    counts = count_pairs(votes)
    experts = int(votes.expert.max(initial=-1)) + 1
    shape = (experts, len(counts.low))
    # Flat places of (E, P): what each expert gave, to be taken off everybody's.
    place = votes.expert * shape[1] + counts.pair_of
    games = np.bincount(place, minlength=shape[0] * shape[1]).reshape(shape)
    score = 1.0 - 0.5 * counts.outcome_of
    scores = np.bincount(place, weights=score, minlength=shape[0] * shape[1]).reshape(shape)
    return _fits(counts, counts.games - games, counts.scores - scores, start)


def rank_changes(strengths: FloatArray, without: FloatArray) -> list[int | None]:
    """Return by expert the largest change of a place in the order without their votes.

    Args:
        strengths: (C,) by all votes.
        without: (E, C) by all votes but one expert's; None comes of rows that are not numbers.
    """
    changes = np.abs(_places(without) - _places(strengths[None])).max(axis=1, initial=0)
    unknown = set(np.flatnonzero(np.isnan(without).any(axis=1)).tolist())
    return [None if expert in unknown else int(change) for expert, change in enumerate(changes)]


def _places(strengths: FloatArray) -> IntArray:
    """(n, C) places in the order of strengths, 0 the highest."""
    # The order of the order is each one's own place.
    return np.asarray(np.argsort(np.argsort(-strengths, axis=1, kind="stable"), axis=1))


def _fits(
    counts: PairCounts, games: FloatArray, scores: FloatArray, start: FloatArray
) -> FloatArray:
    """(n, C) strengths of each row of counts (n, P), not a number where it determines none."""
    met = Meetings(len(start), counts)
    fine = are_determined(met, games.T, scores.T)
    strengths = np.full((len(games), len(start)), np.nan)
    strengths[fine] = fit(met, games[fine].T, scores[fine].T, start=start).T
    return strengths
