"""What can be said of each expert: pace, habits, and agreement with the others.

Nothing here removes a vote: who differs from the others may be the one who looks closest.

Notation: V votes, E experts, C contestants.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, IntArray, count_pairs
from arena.rating.estimate import Estimate
from arena.rating.reliability import VALUES
from arena.rating.shares import wilson

FAST_MS = 1000.0
"""Quicker than this nobody compares two pictures."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Rater:
    """One expert; shares go from 0 to 1, None where there is nothing to count.

    Attributes:
        median_ms: How long a pair was on screen, over the votes that were timed.
        fast: The share of timed votes below a second.
        ties: The share of votes that call both equal.
        left: The share of decided votes for the left picture.
        agreement: The mean share of other experts' judgements of the same units that are equal
            to this expert's, and `shared` the votes that have any.
        favourites: The share of decided votes for the contestant that the other experts' votes
            rate higher, and `decided` how many votes that is.
    """

    expert: int
    votes: int
    median_ms: float | None
    fast: float | None
    ties: float
    left: Estimate
    agreement: Estimate
    shared: int
    favourites: Estimate
    decided: int


def raters(votes: Comparisons, *, ms: FloatArray, without: FloatArray) -> tuple[Rater, ...]:
    """One line per expert who has votes.

    Args:
        votes: `first` was shown on the left; without planned repeats.
        ms: (V,) how long each pair was on screen, not a number where that is unknown.
        without: (E, C) strengths by the votes of all others, not a number where those determine
            none; see `arena.rating.influence`.
    """
    agreed, others = agreement_with_others(votes)
    return tuple(
        _rater(votes, expert, ms, without[expert], agreed, others)
        for expert in np.unique(votes.expert).tolist()
    )


def agreement_with_others(votes: Comparisons) -> tuple[FloatArray, BoolArray]:
    """(V,) the share of the others' judgements of a unit that equal this; (V,) if there are any.

    What the same expert said of the same unit again is not another's judgement.
    """
    counts = count_pairs(votes)
    pairs = max(len(counts.low), 1)
    experts = int(votes.expert.max(initial=0)) + 1
    unit = votes.scenario * pairs + counts.pair_of
    total = _how_many(unit) - _how_many(unit * experts + votes.expert)
    value = unit * VALUES + counts.outcome_of
    equal = _how_many(value) - _how_many(value * experts + votes.expert)
    return np.asarray(equal / np.maximum(total, 1)), np.asarray(total > 0)


# --- Private -----------------------------------------------------------------------------------


def _rater(
    votes: Comparisons,
    expert: int,
    ms: FloatArray,
    strengths: FloatArray,
    agreed: FloatArray,
    others: BoolArray,
) -> Rater:
    own = votes.expert == expert
    timed = ms[own & ~np.isnan(ms)]
    decided = own & (votes.score != 0.5)
    won_left = votes.score == 1.0
    lead = strengths[votes.first] - strengths[votes.second]
    foreseen = decided & ~np.isnan(lead) & (lead != 0.0)
    shared = own & others
    return Rater(
        expert=expert,
        votes=int(own.sum()),
        median_ms=float(np.median(timed)) if len(timed) else None,
        fast=float((timed < FAST_MS).mean()) if len(timed) else None,
        ties=float((votes.score[own] == 0.5).mean()),
        left=_of(won_left[decided]),
        agreement=_mean(agreed[shared]),
        shared=int(shared.sum()),
        favourites=_of(won_left[foreseen] == (lead[foreseen] > 0)),
        decided=int(foreseen.sum()),
    )


def _how_many(keys: IntArray) -> IntArray:
    """(V,) how many votes have the same key."""
    _, place, number = np.unique(keys, return_inverse=True, return_counts=True)
    return np.asarray(number[place])


def _mean(values: FloatArray) -> Estimate:
    """A mean of shares with the normal interval of independent units."""
    if not len(values):
        return Estimate(value=None)
    value = float(values.mean())
    if len(values) < 2:
        return Estimate(value=value)
    half = 1.96 * float(values.std(ddof=1)) / float(np.sqrt(len(values)))
    return Estimate(value=value, lower=max(value - half, 0.0), upper=min(value + half, 1.0))


def _of(hits: BoolArray) -> Estimate:
    return wilson(int(hits.sum()), len(hits)) if len(hits) else Estimate(value=None)
