"""Ratings of the data and of all resampled rounds, by each method.

Notation: C contestants, P pairs, b and n rounds.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from arena.rating import bradley_terry, davidson, elo
from arena.rating.bootstrap import Rounds, resample
from arena.rating.bradley_terry import Meetings, to_elo
from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, PairCounts, tally
from arena.rating.components import Loose, loose
from arena.rating.connectivity import Determined, heaviest_tree
from arena.rating.logistic import Coefficient, coefficients_of, fit_with_columns
from arena.rating.pulls import Pulls, bradley_terry_pulls, davidson_pulls
from arena.rating.reach import loose_rounds, rounds_to_draw
from arena.rating.rules import Intervals, Method, Order, Rules


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
    inverse = curvature * counts.games.sum()

    def whole(drawn: Rounds) -> FloatArray:
        return to_elo(
            bradley_terry.fit_rounds(met, drawn.games, drawn.scores, start=point, inverse=inverse)
        )

    def apart(drawn: Rounds, together: BoolArray) -> FloatArray:
        start = point[:, None]
        found = bradley_terry.newton(
            met, drawn.games, drawn.scores, start=start, together=together
        )
        return to_elo(found)

    samples, rest = _samples(votes, counts, rules, whole, apart)
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

    def whole(drawn: Rounds) -> FloatArray:
        return apart(drawn, None)

    def apart(drawn: Rounds, together: BoolArray | None) -> FloatArray:
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

    samples, rest = _samples(votes, counts, rules, whole, apart)
    return Fitted(
        rating=rating, samples=samples, loose=rest, pulls=pulls, tie_strength=tie_strength
    )


def _same_everywhere(
    votes: Comparisons, counts: PairCounts, rules: Rules, rating: FloatArray
) -> tuple[FloatArray, Loose]:
    """The data's ratings (C,) in every round: only who is determined differs."""
    tree = heaviest_tree(
        len(votes.names),
        counts.low,
        counts.high,
        np.minimum(counts.scores, counts.games - counts.scores),
    )
    fine, rest = loose_rounds(
        votes,
        counts,
        tree,
        rating,
        unit=rules.unit,
        rounds=rounds_to_draw(votes, counts, rules.rounds),
        seed=rules.seed,
        workers=rules.workers,
        report=rules.report,
    )
    return np.repeat(rating[:, None], fine, axis=1), rest


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
    determined = Determined(
        contestants=len(votes.names),
        low=counts.low,
        high=counts.high,
        games=counts.games,
        scores=counts.scores,
    )
    of_each = tally(votes).sum(axis=1).astype(np.float64)
    samples, rest = [np.empty((len(votes.names), 0))], [Loose.none(len(votes.names))]
    drawn = resample(votes, counts, unit=rules.unit, rounds=rules.rounds, seed=rules.seed)
    done = 0
    for block in drawn:
        done += block.games.shape[1]
        if rules.report is not None:
            rules.report(done, rules.rounds)
        fine = np.asarray(determined.among(block.games, block.scores))
        if fine.all():
            found = whole(block)
        else:
            found = whole(block.chosen(np.flatnonzero(fine)))
            loose_ones = np.flatnonzero(~fine)
            for some, reached in determined.chains(block.games, block.scores, loose_ones):
                together = reached & reached.transpose(0, 2, 1)
                inside = together[:, counts.low, counts.high].T
                values = apart(block.chosen(some).limited_to(inside), together)
                rest.append(loose(reached, values, votes=of_each))
        known = ~np.isnan(found[:1]).any(axis=0)
        if not known.all():
            unknown = int((~known).sum())
            size = len(votes.names)
            everybody = np.ones((unknown, size, size), dtype=bool)
            rest.append(loose(everybody, np.full((size, unknown), np.nan), votes=of_each))
            found = found[:, known]
        samples.append(found)
    return np.hstack(samples), Loose.joined(rest)
