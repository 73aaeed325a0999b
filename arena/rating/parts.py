"""Contestants who can all be rated among each other: point, rounds, interval, rank.

Notation: C contestants, B rounds.
"""

from dataclasses import dataclass, replace

import numpy as np

from arena.rating import bootstrap, remarks
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    count_pairs,
)
from arena.rating.models import Meetings, fit, resample_elo, to_elo
from arena.rating.random_effects import find_quantiles
from arena.rating.ranking import (
    Separation,
    above_by_bounds,
    above_in_rounds,
    decide_ranks,
    judge_pairs,
    rank_sets,
)
from arena.rating.rules import Intervals, Method, Rules
from arena.rating.sandwich import Pulls, Spread, estimate_spread, pulls_of_model

_SAME = 1e-6
"""Points. Intervals that are narrower say nothing."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RatedGroup:
    """Ratings of contestants rated together; arrays are (C,), None where undetermined.

    What is called as a field of `lines.Line` goes into the lines of the table.

    Attributes:
        lower, upper: NaN where the votes set no such bound.
        rank: 0 where it is withheld.
        note: Why bounds or ranks are missing; empty for who has all.
        degenerate: Rounds that did not determine everybody.
    """

    rating: FloatArray | None = None
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    rank: IntArray | None = None
    rank_best: IntArray | None = None
    rank_worst: IntArray | None = None
    note: tuple[str, ...]
    separation: Separation | None = None
    tie_strength: float | None = None
    degenerate: int = 0
    explanation: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()


def rate_part(votes: Comparisons, rules: Rules) -> RatedGroup:
    """Rate contestants who have votes and can all be rated among each other."""
    if rules.method is Method.ELO:
        samples = resample_elo(votes, rounds=rules.rounds, seed=rules.seed)
        point = _Point(rating=np.median(samples, axis=1))
        rounds = bootstrap.RatedRounds.of_values(samples)
    else:
        counts = count_pairs(votes)
        met = Meetings(len(votes.names), counts)
        fitted = _fit_votes(votes, counts, met, rules)
        if fitted is None:
            note = (remarks.NOT_RATED,) * len(votes.names)
            return RatedGroup(note=note, explanation=(remarks.NO_DAVIDSON,))
        point, rounds = fitted, _rate_rounds(votes, counts, met, rules, fitted)
    plain = RatedGroup(
        rating=point.rating,
        tie_strength=point.tie_strength,
        degenerate=rounds.degenerate,
        note=(remarks.NO_INTERVAL,) * len(votes.names),
        warnings=(remarks.ELO_NOTE,) if rules.method is Method.ELO else (),
    )
    values, reference = bootstrap.place_on_one_scale(point.rating, rounds)
    intervals = _find_intervals(point, values, reference, rules)
    if intervals is None or (votes.score == 0.5).all():
        why = remarks.why_no_intervals(votes, rules.unit)
        if not np.isnan(bootstrap.percentile_interval(values)).all():
            plain = replace(plain, note=(remarks.NOTHING_DIFFERS,) * len(votes.names))
        return replace(plain, explanation=(why,))
    average = float(point.rating[reference].mean())
    remarks_said = remarks.warnings(
        votes, rules=rules, rounds=values.shape[1], degenerate=plain.degenerate
    )
    rated = _with_intervals(plain, intervals, average)
    is_open = np.array([bool(note) for note in rated.note])
    return replace(
        rated,
        explanation=(remarks.who_is_open(votes, is_open),) if is_open.any() else (),
        warnings=(*plain.warnings, *remarks_said),
    )


def _with_intervals(plain: RatedGroup, intervals: "_Intervals", average: float) -> RatedGroup:
    """Add bounds and ranks, and why some are missing."""
    rank = decide_ranks(intervals.lower, intervals.upper, average=average)
    best, worst = rank_sets(above_by_bounds(intervals.above, intervals.lower, intervals.upper))
    has_lower, has_upper = ~np.isnan(intervals.lower), ~np.isnan(intervals.upper)
    bounds = zip(has_lower.tolist(), has_upper.tolist(), (rank > 0).tolist(), strict=True)
    return replace(
        plain,
        lower=intervals.lower,
        upper=intervals.upper,
        rank=rank,
        rank_best=np.where(has_lower | has_upper, best, 0),
        rank_worst=np.where(has_lower | has_upper, worst, 0),
        note=tuple(
            remarks.note_on_bounds(has_lower=lower, has_upper=upper, has_rank=ranked)
            for lower, upper, ranked in bounds
        ),
        separation=intervals.separation,
    )


# --- Fits ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Point:
    """Ratings (C,) of the data, and what else the model says.

    Attributes:
        answer: (K,) of `models.fit`; none of online Elo.
    """

    rating: FloatArray
    answer: FloatArray | None = None
    pulls: Pulls | None = None
    tie_strength: float | None = None


def _fit_votes(
    votes: Comparisons, counts: PairCounts, met: Meetings, rules: Rules
) -> _Point | None:
    """Return the point estimate, None if the votes determine none in Davidson's model."""
    ties = counts.outcomes[:, 1].sum(keepdims=True).astype(np.float64)
    has_ties = rules.method is Method.DAVIDSON and 0 < ties[0] < votes.votes
    # (P, 1): the data are fitted as a single round.
    games, scores = counts.games[:, None], counts.scores[:, None]
    answer = fit(met, games, scores, ties if has_ties else None)[:, 0]
    if np.isnan(answer).any():
        return None
    return _Point(
        rating=to_elo(answer[: met.contestants]),
        answer=answer,
        pulls=None
        if rules.intervals is Intervals.RESAMPLES
        else pulls_of_model(votes, met, counts.games, answer),
        tie_strength=float(np.exp(answer[-1])) if has_ties else None,
    )


def _rate_rounds(
    votes: Comparisons, counts: PairCounts, met: Meetings, rules: Rules, point: _Point
) -> bootstrap.RatedRounds:
    """Rate resampled votes.

    But for single votes' intervals the rounds only say who is determined; their ratings are those
    of the data.
    """

    def refit(rounds: bootstrap.Rounds, together: BoolArray | None) -> FloatArray:
        if point.pulls is not None:
            return np.repeat(point.rating[:, None], rounds.games.shape[1], axis=1)
        if point.tie_strength is None:
            games, scores = rounds.games, rounds.scores
            return to_elo(fit(met, games, scores, start=point.answer, together=together))
        # Without ties, or with ties alone, v is 0 or infinite: such rounds stay NaN.
        is_fine = (rounds.ties > 0) & (rounds.ties < rounds.games.sum(axis=0))
        fine = rounds.select(np.flatnonzero(is_fine))
        inside = None if together is None else together[is_fine]
        values = np.full((met.contestants, len(is_fine)), np.nan)
        # The last row of (C + 1, B) is log v.
        values[:, is_fine] = fit(
            met, fine.games, fine.scores, fine.ties, start=point.answer, together=inside
        )[:-1]
        return to_elo(values)

    number = rules.rounds
    if point.pulls is not None:
        number = bootstrap.rounds_to_draw(votes, counts, number)
    blocks = bootstrap.resample(votes, counts, unit=rules.unit, rounds=number, seed=rules.seed)
    return bootstrap.rate_rounds(votes, counts, blocks, refit)


# --- Intervals -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Intervals:
    """Bounds (C,), NaN where open, and (C, C) whether the row is shown to be above the column."""

    lower: FloatArray
    upper: FloatArray
    above: BoolArray
    separation: Separation | None = None


def _find_intervals(
    point: _Point, values: FloatArray, reference: BoolArray, rules: Rules
) -> _Intervals | None:
    """Return the intervals, None if the votes set no bound or leave intervals without a width.

    Args:
        point: What the data say.
        values: (C, B) the rounds on one scale.
        reference: (C,) whom nearly every round determines; their pairs are judged all at once.
        rules: By which.
    """
    rating, members = point.rating, np.flatnonzero(reference)
    lower, upper = bootstrap.percentile_interval(values)
    if np.isnan([lower, upper]).all():
        return None
    spread = None
    if point.pulls is not None:
        spread = estimate_spread(point.pulls, rules.unit, reference)
        founders = reference & np.isin(point.pulls.votes.names, list(rules.founders))
        # Around one founder alone, that one's interval would have no width.
        is_anchored = founders.sum() > 1
        around = estimate_spread(point.pulls, rules.unit, founders) if is_anchored else spread
        half = _half_widths(point.pulls, around, founders if is_anchored else reference, rules)
        # A bound is missing where the rounds leave it open.
        lower = np.where(np.isnan(lower), np.nan, rating - half)
        upper = np.where(np.isnan(upper), np.nan, rating + half)
    width = upper - lower
    if (~np.isnan(width)).any() and np.nanmax(width) < _SAME:
        return None
    if spread is not None:
        separation = judge_pairs(
            rating[members], spread.among(members), rounds=rules.rounds, seed=rules.seed
        ).among(members, len(rating))
        return _Intervals(lower=lower, upper=upper, above=separation.above, separation=separation)
    above = np.zeros((len(rating), len(rating)), dtype=bool)
    samples = values[members]
    # (B,) rounds that determine every member; too few of them give no distribution.
    is_fine = np.asarray(np.isfinite(samples).all(axis=0))
    if 2 * is_fine.sum() >= len(is_fine):
        apart = above_in_rounds(rating[members], samples[:, is_fine])
        above[np.ix_(members, members)] = apart
    return _Intervals(lower=lower, upper=upper, above=above)


def _half_widths(pulls: Pulls, spread: Spread, reference: BoolArray, rules: Rules) -> FloatArray:
    """(C,) of the intervals around the mean of a reference (C,), in points."""
    if rules.intervals is Intervals.CLOSED_FORM or not spread.components:
        return spread.half_widths()
    quantiles = find_quantiles(
        pulls, spread, rules.unit, reference, rounds=rules.rounds, seed=rules.seed
    )
    return np.asarray(quantiles * np.sqrt(spread.covariance.diagonal()))
