"""Ratings of the data and of all resampled rounds, by each method.

Notation: C contestants, P pairs, b and n rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from arena.rating import bradley_terry, davidson, elo
from arena.rating.bootstrap import Loose, Rounds, is_certain, loose, resample, rounds_to_draw
from arena.rating.bradley_terry import Meetings, to_elo
from arena.rating.chains import are_determined, chains_in_sets
from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, PairCounts, tally
from arena.rating.logistic import Coefficient, coefficients_of, fit_with_columns
from arena.rating.rules import Intervals, Method, Order, Rules
from arena.rating.sandwich import Pulls, bradley_terry_pulls, davidson_pulls

_NUMBERS_AT_ONCE = 4_000_000


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Fitted:
    """Ratings of the data (C,), of the rounds that determine everybody (C, b), and the others.

    For intervals in closed form the rounds only say who is determined; their ratings are those of
    the data. Without covariates, or where the votes do not determine what these are worth, there
    are no coefficients.
    """

    rating: FloatArray
    samples: FloatArray
    loose: Loose
    pulls: Pulls | None = None
    strengths: FloatArray | None = None
    tie_strength: float | None = None
    coefficients: tuple[Coefficient, ...] | None = None


def fit_votes(votes: Comparisons, counts: PairCounts, rules: Rules) -> Fitted | None:
    """The ratings of contestants who can all be rated among each other.

    Returns:
        None where the votes determine no ratings in Davidson's model.
    """
    if rules.method is Method.ELO:
        return _elo(votes, rules)
    if rules.method is Method.DAVIDSON and 0 < counts.outcomes[:, 1].sum() < votes.votes:
        return _davidson(votes, counts, rules)
    return _bradley_terry(votes, counts, rules)


# --- Private -----------------------------------------------------------------------------------


def _elo(votes: Comparisons, rules: Rules) -> Fitted:
    samples = elo.resample_elo(votes, rounds=rules.rounds, seed=rules.seed, k=rules.k)
    if rules.order is Order.RECORDED:
        rating = elo.replay(votes, k=rules.k)
    else:
        rating = np.median(samples, axis=1)
    return Fitted(rating=rating, samples=samples, loose=Loose.none(len(votes.names)))


def _bradley_terry(votes: Comparisons, counts: PairCounts, rules: Rules) -> Fitted:
    if votes.covariates.shape[1]:
        adjusted = _adjusted(votes, counts, rules)
        if adjusted is not None:
            return adjusted
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    point = bradley_terry.newton(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    curvature = bradley_terry.inverse_curvature(met, counts.games, point)
    pulls = bradley_terry_pulls(votes, point, curvature)
    if rules.intervals is Intervals.CLOSED_FORM:
        samples, rest = _same_everywhere(votes, counts, rules, to_elo(point))
        return Fitted(
            rating=to_elo(point), samples=samples, loose=rest, pulls=pulls, strengths=point
        )

    def fitted(drawn: Rounds, together: BoolArray | None = None) -> FloatArray:
        start = point[:, None]
        return to_elo(
            bradley_terry.newton(met, drawn.games, drawn.scores, start=start, together=together)
        )

    samples, rest = _samples(votes, counts, rules, fitted, fitted)
    return Fitted(rating=to_elo(point), samples=samples, loose=rest, pulls=pulls, strengths=point)


def _adjusted(votes: Comparisons, counts: PairCounts, rules: Rules) -> Fitted | None:
    """With covariates in the fit; None where the votes do not determine what these are worth."""
    found = fit_with_columns(votes, votes.covariates)
    if found is None:
        return None
    rating = to_elo(found.strengths)
    samples, rest = _same_everywhere(votes, counts, rules, rating)
    return Fitted(
        rating=rating,
        samples=samples,
        loose=rest,
        pulls=found.pulls,
        strengths=found.strengths,
        coefficients=coefficients_of(votes, found, rules.unit),
    )


def _davidson(votes: Comparisons, counts: PairCounts, rules: Rules) -> Fitted | None:
    """None where the votes determine no ratings in this model."""
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    ties = counts.outcomes[:, 1].sum(keepdims=True).astype(np.float64)
    point = davidson.fit(met, counts.games[:, None], counts.scores[:, None], ties)[:, 0]
    if np.isnan(point).any():
        return None
    tie_strength = float(np.exp(point[-1]))
    pulls = davidson_pulls(votes, met, counts.games, point)
    rating = to_elo(point[:-1])
    if rules.intervals is Intervals.CLOSED_FORM:
        samples, rest = _same_everywhere(votes, counts, rules, rating)
        return Fitted(
            rating=rating, samples=samples, loose=rest, pulls=pulls, tie_strength=tie_strength
        )

    def fitted(drawn: Rounds, together: BoolArray | None = None) -> FloatArray:
        found: FloatArray = np.full((len(votes.names), drawn.games.shape[1]), np.nan)
        fine = np.asarray((drawn.ties > 0) & (drawn.ties < drawn.games.sum(axis=0)))
        some = drawn.chosen(np.flatnonzero(fine))
        found[:, fine] = davidson.fit(
            met,
            some.games,
            some.scores,
            some.ties,
            start=point,
            together=None if together is None else together[fine],
        )[:-1]
        return to_elo(found)

    samples, rest = _samples(votes, counts, rules, fitted, fitted)
    return Fitted(
        rating=rating, samples=samples, loose=rest, pulls=pulls, tie_strength=tie_strength
    )


def _same_everywhere(
    votes: Comparisons, counts: PairCounts, rules: Rules, rating: FloatArray
) -> tuple[FloatArray, Loose]:
    """The data's ratings (C,) in every round: only who is determined differs."""
    rounds = rounds_to_draw(votes, counts, rules.rounds)
    if is_certain(votes, counts):
        return np.repeat(rating[:, None], rounds, axis=1), Loose.none(len(rating))

    def unchanged(drawn: Rounds, *_: BoolArray) -> FloatArray:
        return np.repeat(rating[:, None], drawn.games.shape[1], axis=1)

    return _samples(votes, counts, replace(rules, rounds=rounds), unchanged, unchanged)


def _samples(
    votes: Comparisons,
    counts: PairCounts,
    rules: Rules,
    whole: Callable[[Rounds], FloatArray],
    apart: Callable[[Rounds, BoolArray], FloatArray],
) -> tuple[FloatArray, Loose]:
    """Ratings of the rounds that determine everybody, and what the others say.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        rules: How to rate.
        whole: (C, b) ratings of rounds in which everybody is connected; NaN for none.
        apart: (C, n) ratings within the components (n, C, C) of other rounds.
    """
    size = len(votes.names)
    pairs: dict[str, Any] = {"contestants": size, "low": counts.low, "high": counts.high}
    of_each = tally(votes).sum(axis=1).astype(np.float64)
    samples, rest = [np.empty((size, 0))], [Loose.none(size)]
    done = 0
    for block in resample(votes, counts, unit=rules.unit, rounds=rules.rounds, seed=rules.seed):
        done += block.games.shape[1]
        if rules.report is not None:
            rules.report(done, rules.rounds)
        fine = are_determined(**pairs, games=block.games, scores=block.scores)
        found = whole(block.chosen(np.flatnonzero(fine)))
        known = ~np.isnan(found[:1]).any(axis=0)
        samples.append(found[:, known])
        unknown = int((~known).sum())
        everybody = np.ones((unknown, size, size), dtype=bool)
        rest.append(loose(everybody, np.full((size, unknown), np.nan), votes=of_each))
        left = np.flatnonzero(~fine)
        at_once = max(1, _NUMBERS_AT_ONCE // size**2)
        for some in (left[first : first + at_once] for first in range(0, len(left), at_once)):
            rounds = block.chosen(some)
            reached = chains_in_sets(**pairs, games=rounds.games, scores=rounds.scores)
            together = reached & reached.transpose(0, 2, 1)
            inside = together[:, counts.low, counts.high].T
            rest.append(loose(reached, apart(rounds.limited_to(inside), together), votes=of_each))
    return np.hstack(samples), Loose.joined(rest)
