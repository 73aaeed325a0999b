"""Influence of single experts and of single votes on a table.

Notation: C contestants, P pairs that met, E experts. Strengths are natural logarithms of odds.
"""

from dataclasses import dataclass

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
from arena.rating.models import Meetings, chances, fit, inverse_curvature

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


# --- Single votes --------------------------------------------------------------------------------

RIVALS, REFITTED, _EVEN = 20, 3, 1e-6
"""So many of the next places are tried by influence, and so many of these by refits; who is ahead
by less is level."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Fragility:
    """The fewest votes found whose loss changes the first place.

    Attributes:
        votes: How many; `cast` is the number of votes that could be dropped.
        first: Who is first without them.
    """

    votes: int
    cast: int
    first: str


def votes_behind_first(votes: Comparisons, is_cast: BoolArray) -> Fragility | None:
    """Return how few votes, dropped at worst, change the first place of Bradley-Terry ratings.

    Influence functions order the votes, refits count them (Broderick, Giordano, Meager 2020):
    fewer may do as well, but those found do. None where no loss of votes changes it, or the votes
    determine no ratings.

    Args:
        votes: A row a vote.
        is_cast: (R,) those that somebody gave; others are never dropped.
    """
    strengths = bradley_terry(votes)
    if strengths is None:
        return None
    counts = count_pairs(votes)
    back = inverse_curvature(Meetings(len(strengths), counts), counts.games, strengths)
    expected, _ = chances(len(strengths), strengths, votes.first, votes.second)
    first, *rivals = np.argsort(-strengths, kind="stable").tolist()
    orders: list[tuple[int, IntArray]] = []
    for rival in rivals[:RIVALS]:
        # A vote moves the gap by its surprise times the gap's slope, H^-1 (e_first - e_rival).
        slope = back[first] - back[rival]
        effect = (votes.score - expected) * (slope[votes.first] - slope[votes.second])
        order = np.argsort(-effect, kind="stable")
        order = order[(is_cast & (effect > 0.0))[order]]
        gap = strengths[first] - strengths[rival]
        orders.append((int(np.searchsorted(np.cumsum(effect[order]), gap)) + 1, order))
    found: list[Fragility] = []
    for guess, order in sorted(orders, key=lambda one: one[0])[:REFITTED]:
        number, fewest, leader = guess, 0, None
        # Doubled until the first place changes, then bisected down to where it just does.
        while leader is None and fewest < len(order):
            number = min(number, len(order))
            leader = _first_without(votes, counts, order[:number], strengths)
            fewest, number = (fewest, number) if leader is not None else (number, 2 * number)
        while leader is not None and number - fewest > 1:
            middle = (fewest + number) // 2
            new = _first_without(votes, counts, order[:middle], strengths)
            fewest, number, leader = (
                (middle, number, leader) if new is None else (fewest, middle, new)
            )
        if leader is not None:
            cast = int(is_cast.sum())
            found.append(Fragility(votes=number, cast=cast, first=votes.names[leader]))
    return min(found, key=lambda one: one.votes, default=None)


def _first_without(
    votes: Comparisons, counts: PairCounts, dropped: IntArray, start: FloatArray
) -> int | None:
    """Return the new first without some rows; None for the old one, or without ratings."""
    pairs, score = counts.pair_of[dropped], 1.0 - 0.5 * counts.outcome_of[dropped]
    games = counts.games - np.bincount(pairs, minlength=len(counts.low))
    scores = counts.scores - np.bincount(pairs, score, minlength=len(counts.low))
    strengths = _fits(counts, games[None], scores[None], start)[0]
    lead = strengths.max() - strengths[start.argmax()]
    return int(strengths.argmax()) if lead > _EVEN else None


# --- Private -------------------------------------------------------------------------------------


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
