"""How much the table hangs on single experts and single votes.

Notation: C contestants, P pairs that met, E experts, V votes. Strengths are natural logarithms of
odds; "first" is the contestant with the highest rating.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import expit

from arena.rating import bradley_terry
from arena.rating.chains import are_determined
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, PairCounts, count_pairs

MOST_RIVALS = 12
"""So many of the next contestants are tried as the new first one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Removal:
    """The fewest votes whose removal puts somebody else first.

    Attributes:
        votes: How many.
        exact: Whether fewer are proved not to do; else it is an upper bound, found by removing
            the votes with the greatest influence.
        rival: Who comes first then, as an index.
    """

    votes: int
    exact: bool
    rival: int


def without_each_expert(votes: Comparisons, start: FloatArray) -> FloatArray:
    """(E, C) strengths by the votes of all experts but one; not a number where undetermined.

    Args:
        votes: Of everybody, experts numbered from 0 without gaps.
        start: (C,) strengths by all votes, to begin at.
    """
    counts = count_pairs(votes)
    experts = int(votes.expert.max(initial=-1)) + 1
    pairs = len(counts.low)
    place = votes.expert * pairs + counts.pair_of
    games = np.bincount(place, minlength=experts * pairs).reshape(experts, pairs)
    score = 1.0 - 0.5 * counts.outcome_of
    scores = np.bincount(place, weights=score, minlength=experts * pairs).reshape(experts, pairs)
    left_games = counts.games[None] - games
    left_scores = counts.scores[None] - scores
    return _fits(len(votes.names), counts, left_games, left_scores, start)


def rank_changes(strengths: FloatArray, without: FloatArray) -> list[int | None]:
    """By expert the largest change of a place in the order when their votes are left out.

    Args:
        strengths: (C,) by all votes.
        without: (E, C) by all votes but one expert's; None comes of rows that are not numbers.
    """
    places = _places(strengths[None])[0]
    changes = np.abs(_places(without) - places).max(axis=1, initial=0)
    unknown = np.flatnonzero(np.isnan(without).any(axis=1)).tolist()
    found: list[int | None] = [int(change) for change in changes]
    for expert in unknown:
        found[expert] = None
    return found


def fewest_votes_to_change_first(votes: Comparisons, strengths: FloatArray) -> Removal | None:
    """The fewest votes whose removal gives another contestant the highest rating.

    Votes of one pair and outcome are alike, so what is searched are counts of such kinds. Every
    single vote is tried; beyond that kinds are removed in the order of their first-order
    influence on the difference to each rival, and the smallest number that does it is an upper
    bound. With two contestants that is exact.

    Args:
        votes: They must determine the ratings.
        strengths: (C,) by all of them.

    Returns:
        None if the two highest are equal already, or no number of votes found does it.
    """
    order = np.argsort(-strengths, kind="stable").tolist()
    if len(order) < 2 or strengths[order[0]] - strengths[order[1]] < _EQUAL:
        return None
    counts = count_pairs(votes)
    kinds = np.flatnonzero(counts.outcomes.ravel())
    leader = order[0]
    singles = np.eye(counts.outcomes.size)[kinds]
    best = _first_that_does(counts, strengths, leader, singles)
    if best is not None:
        return Removal(votes=1, exact=True, rival=best[1])
    found: list[tuple[int, int]] = []
    for rival in order[1 : MOST_RIVALS + 1]:
        one = _greedy(counts, strengths, leader, _by_influence(counts, strengths, leader, rival))
        if one is not None:
            found.append(one)
    if not found:
        return None
    number, rival = min(found)
    return Removal(votes=number, exact=number == 2 or len(order) == 2, rival=rival)


# --- Private -----------------------------------------------------------------------------------

_EQUAL = 1e-9
_AT_ONCE = 48


def _by_influence(counts: PairCounts, strengths: FloatArray, leader: int, rival: int) -> IntArray:
    """(n,) kinds of votes, one entry a vote, those first that hold the leader up the most."""
    gap = strengths[counts.low] - strengths[counts.high]
    expected = expit(gap)
    curvature = np.zeros((len(strengths), len(strengths)))
    weight = counts.games * expected * (1.0 - expected)
    np.add.at(curvature, (counts.low, counts.high), -weight)
    np.add.at(curvature, (counts.high, counts.low), -weight)
    curvature -= np.diag(curvature.sum(axis=1))
    inverse = np.linalg.pinv(curvature, hermitian=True)
    lift = inverse[leader] - inverse[rival]
    surprise = np.array([1.0, 0.5, 0.0])[None, :] - expected[:, None]
    held = ((lift[counts.low] - lift[counts.high])[:, None] * surprise).ravel()
    order = np.argsort(-held, kind="stable")
    order = order[held[order] > 0.0]
    return np.asarray(np.repeat(order, counts.outcomes.ravel()[order]))


def _greedy(
    counts: PairCounts, strengths: FloatArray, leader: int, sequence: IntArray
) -> tuple[int, int] | None:
    """How many of the sequence's votes have to go, and who is first then; None if none do."""
    low, high = 0, len(sequence)
    rival = None
    while high - low > (0 if rival is None else 1):
        numbers = np.unique(np.linspace(low + 1, high, min(_AT_ONCE, high - low)).astype(int))
        taken = np.stack(
            [np.bincount(sequence[:number], minlength=counts.outcomes.size) for number in numbers]
        ).astype(np.float64)
        pair = _first_that_does(counts, strengths, leader, taken)
        if pair is None:
            return None
        place, rival = pair
        low, high = (int(numbers[place - 1]) if place else low), int(numbers[place])
    return None if rival is None else (high, rival)


def _first_that_does(
    counts: PairCounts, strengths: FloatArray, leader: int, taken: FloatArray
) -> tuple[int, int] | None:
    """(row, who is first then) of the first row of `taken` (n, 3P) that ends the lead."""
    kept = (counts.outcomes.ravel()[None] - taken).reshape(len(taken), -1, 3)
    games = kept.sum(axis=2)
    scores = kept[:, :, 0] + 0.5 * kept[:, :, 1]
    fitted = _fits(len(strengths), counts, games, scores, strengths)
    others = np.where(np.arange(len(strengths)) == leader, -np.inf, fitted)
    with np.errstate(invalid="ignore"):
        ended = others.max(axis=1, initial=-np.inf) - fitted[:, leader] > _EQUAL
    rows = np.flatnonzero(ended)
    return (int(rows[0]), int(np.argmax(others[rows[0]]))) if len(rows) else None


def _fits(
    contestants: int, counts: PairCounts, games: FloatArray, scores: FloatArray, start: FloatArray
) -> FloatArray:
    """(n, C) strengths of each row of counts, not a number where it determines none."""
    low, high = counts.low, counts.high
    fine = are_determined(
        contestants=contestants, low=low, high=high, games=games.T, scores=scores.T
    )
    strengths = np.full((len(games), contestants), np.nan)
    strengths[fine] = bradley_terry.fit(
        contestants=contestants,
        low=low,
        high=high,
        games=games[fine],
        scores=scores[fine],
        start=start,
    )
    return strengths


def _places(strengths: FloatArray) -> IntArray:
    """(n, C) places in the order of strengths, 0 the highest."""
    return np.asarray(np.argsort(np.argsort(-strengths, axis=1, kind="stable"), axis=1))
