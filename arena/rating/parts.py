"""Contestants who can all be rated among each other: point, rounds, interval, rank.

Notation: C contestants, B rounds.
"""

from dataclasses import dataclass, replace

import numpy as np

from arena.rating import remarks
from arena.rating.bootstrap import (
    RatedRounds,
    Rounds,
    percentile_interval,
    place_on_one_scale,
    rate_rounds,
    resample,
    rounds_to_draw,
)
from arena.rating.chains import Status
from arena.rating.comparisons import BoolArray, Comparisons, FloatArray, IntArray, count_pairs
from arena.rating.logistic import Coefficient, coefficients_of, fit_with_columns
from arena.rating.models import Meetings, fit, resample_elo, to_elo
from arena.rating.ranking import (
    Separation,
    above_by_bounds,
    above_in_rounds,
    judge_pairs,
    rank_sets,
    shown_ranks,
)
from arena.rating.rules import Intervals, Method, Rules, Unit
from arena.rating.sandwich import NORMAL, Pulls, factor, pulls_of_model, spread_of

_SAME = 1e-6
"""Points. Rounds that all lie within this say nothing about the spread."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rated:
    """What came out for contestants rated together; arrays are (C,), None where undetermined.

    What is called as a field of `lines.Line` goes into the lines of the table.

    Attributes:
        lower, upper: NaN where the votes set no such bound.
        rank: 0 where it is withheld.
        notes: Why bounds or ranks are missing; empty for who has all.
        degenerate: Rounds that did not determine everybody.
    """

    rating: FloatArray | None = None
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    rank: IntArray | None = None
    rank_best: IntArray | None = None
    rank_worst: IntArray | None = None
    separation: Separation | None = None
    tie_strength: float | None = None
    coefficients: tuple[Coefficient, ...] = ()
    degenerate: int = 0
    notes: tuple[str, ...] = ()
    explanation: tuple[str, ...] = ()
    warnings: tuple[str, ...] = ()

    @property
    def is_open(self) -> bool:
        """Whether somebody has an interval without one of its ends, or none beside others'."""
        return self.lower is not None and any(self.notes)


def rate_part(votes: Comparisons, rules: Rules, status: Status) -> Rated:
    """Rate contestants who have votes and can all be rated among each other.

    Args:
        votes: In which only they met.
        rules: How.
        status: Of the data; where every vote is a tie there are no intervals.
    """
    fitted = _fit_votes(votes, rules)
    if fitted is None:
        notes = (remarks.NOT_RATED,) * len(votes.names)
        return Rated(explanation=(remarks.NO_DAVIDSON,), notes=notes)
    plain = Rated(
        rating=fitted.rating,
        tie_strength=fitted.tie_strength,
        coefficients=fitted.coefficients or (),
        degenerate=fitted.rounds.degenerate,
        warnings=(remarks.ELO_NOTE,) if rules.method is Method.ELO else (),
    )

    def without_intervals(note: str, *explanation: str) -> Rated:
        return replace(plain, notes=(note,) * len(votes.names), explanation=explanation)

    if status is Status.ALL_TIES:
        return without_intervals(remarks.ONLY_TIES)
    values, reference = place_on_one_scale(fitted.rating, fitted.rounds)
    bounds = percentile_interval(values)
    closed = None
    if rules.intervals is Intervals.CLOSED_FORM and fitted.pulls is not None:
        closed = _closed_form(fitted.rating, fitted.pulls, rules, reference)
    if _are_all_the_same(values if closed is None else closed.half_width[:, None] * [-1.0, 1.0]):
        return without_intervals(remarks.NO_SPREAD, remarks.why_no_spread(rules))
    if np.isnan(bounds).all():
        reason = remarks.why_no_interval(votes.shown, rules, lost=fitted.rounds.degenerate)
        return without_intervals(remarks.TOO_FEW, reason)
    if closed is None:
        found = _by_rounds(votes, rules, fitted, values, reference, bounds)
    else:  # a bound is missing where the rounds leave it open
        below, above = (np.where(np.isnan(bound), np.nan, closed.half_width) for bound in bounds)
        found = replace(closed, lower=fitted.rating - below, upper=fitted.rating + above)
    ranks = shown_ranks(found.lower, found.upper, average=float(fitted.rating[reference].mean()))
    notes = remarks.notes_on_bounds(votes, rules.unit, found.lower, found.upper, ranks)
    is_adjusted = fitted.coefficients is not None or not votes.covariates.size
    said = remarks.warnings(
        votes, rules=rules, rounds=values.shape[1], degenerate=plain.degenerate
    )
    return replace(
        _with_intervals(plain, found),
        rank=ranks,
        notes=notes,
        explanation=(
            *(() if is_adjusted else (remarks.NOT_ADJUSTED,)),
            *remarks.who_is_open(votes.shown, notes),
        ),
        warnings=plain.warnings + said,
    )


def _are_all_the_same(values: FloatArray) -> bool:
    """Whether no finite rating (C, B) differs from another one of the same contestant."""
    highest = np.where(np.isfinite(values), values, -np.inf).max(axis=1, initial=-np.inf)
    lowest = np.where(np.isfinite(values), values, np.inf).min(axis=1, initial=np.inf)
    known = np.isfinite(highest)
    return bool(known.any()) and bool((highest - lowest)[known].max() < _SAME)


# --- Fits ----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fitted:
    """Ratings (C,) of the data and those of the rounds.

    For intervals in closed form the rounds only say who is determined; their ratings are those of
    the data. Without covariates, or where the votes do not determine what these are worth, there
    are no coefficients.
    """

    rating: FloatArray
    rounds: RatedRounds
    pulls: Pulls | None = None
    tie_strength: float | None = None
    coefficients: tuple[Coefficient, ...] | None = None


def _fit_votes(votes: Comparisons, rules: Rules) -> _Fitted | None:
    """None where the votes determine no ratings in Davidson's model."""
    if rules.method is Method.ELO:
        samples = resample_elo(votes, rounds=rules.rounds, seed=rules.seed)
        rounds = RatedRounds.of_values(samples)
        return _Fitted(rating=np.median(samples, axis=1), rounds=rounds)
    counts = count_pairs(votes)
    met = Meetings(len(votes.names), counts)
    ties = counts.outcomes[:, 1].sum(keepdims=True).astype(np.float64)
    has_ties = rules.method is Method.DAVIDSON and 0 < ties[0] < votes.votes
    coefficients = tie_strength = None
    adjusted = fit_with_columns(votes, votes.covariates) if votes.covariates.size else None
    if adjusted is not None:
        rating, pulls = to_elo(adjusted.strengths), adjusted.pulls
        coefficients = coefficients_of(adjusted, rules.unit)
    else:
        games, scores = counts.games[:, None], counts.scores[:, None]
        answer = fit(met, games, scores, ties if has_ties else None)[:, 0]
        if np.isnan(answer).any():
            return None
        rating, pulls = (
            to_elo(answer[: met.contestants]),
            pulls_of_model(votes, met, counts.games, answer),
        )
        tie_strength = float(np.exp(answer[-1])) if has_ties else None

    def refit(rounds: Rounds, together: BoolArray | None) -> FloatArray:
        if rules.intervals is Intervals.CLOSED_FORM:
            return np.repeat(rating[:, None], rounds.games.shape[1], axis=1)
        if not has_ties:
            return to_elo(fit(met, rounds.games, rounds.scores, start=answer, together=together))
        is_fine = (rounds.ties > 0) & (rounds.ties < rounds.games.sum(axis=0))
        fine = rounds.chosen(np.flatnonzero(is_fine))
        inside = None if together is None else together[is_fine]
        found = np.full((met.contestants, len(is_fine)), np.nan)
        found[:, is_fine] = fit(
            met, fine.games, fine.scores, fine.ties, start=answer, together=inside
        )[:-1]
        return to_elo(found)

    number = rules.rounds
    if rules.intervals is Intervals.CLOSED_FORM:
        number = rounds_to_draw(votes, counts, number)
    blocks = resample(votes, counts, unit=rules.unit, rounds=number, seed=rules.seed)

    return _Fitted(
        rating=rating,
        rounds=rate_rounds(votes, counts, blocks, refit),
        pulls=pulls,
        tie_strength=tie_strength,
        coefficients=coefficients,
    )


# --- Intervals -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Intervals:
    """Bounds (C,), NaN where open, and what is told apart."""

    lower: FloatArray
    upper: FloatArray
    above: BoolArray
    half_width: FloatArray
    separation: Separation | None = None


def _closed_form(
    rating: FloatArray, pulls: Pulls, rules: Rules, reference: BoolArray
) -> _Intervals:
    """Student's t around the ratings; pairs of the reference are judged all at once."""
    spread = spread_of(pulls, rules.unit, reference)
    members = np.flatnonzero(reference)
    judged = judge_pairs(
        rating[members], spread.among(members), rounds=rules.rounds, seed=rules.seed
    ).among(members, len(rating))
    half = spread.half_widths()
    return _Intervals(
        lower=rating - half,
        upper=rating + half,
        above=judged.above,
        half_width=half,
        separation=judged,
    )


def _by_rounds(
    votes: Comparisons,
    rules: Rules,
    fitted: _Fitted,
    values: FloatArray,
    reference: BoolArray,
    bounds: tuple[FloatArray, FloatArray],
) -> _Intervals:
    """Percentiles of the resampled rounds, widened by Student's t where clusters are few."""
    few = remarks.few_clusters(votes, rules.unit)
    wider = 1.0
    if few and rules.unit is not Unit.TWO_WAY:
        wider = factor(few) / NORMAL
    lower, upper = (fitted.rating + wider * (bound - fitted.rating) for bound in bounds)
    above = np.zeros((len(lower), len(lower)), dtype=bool)
    members = np.flatnonzero(reference)
    samples = values[members]
    is_fine = np.asarray(np.isfinite(samples).all(axis=0))
    if 2 * is_fine.sum() >= len(is_fine):
        apart = above_in_rounds(fitted.rating[members], samples[:, is_fine])
        above[np.ix_(members, members)] = apart
    return _Intervals(lower=lower, upper=upper, above=above, half_width=upper - lower)


def _with_intervals(plain: Rated, found: _Intervals) -> Rated:
    lower, upper = found.lower, found.upper
    best, worst = rank_sets(above_by_bounds(found.above, lower, upper))
    unbounded = np.isnan(lower) & np.isnan(upper)
    best[unbounded] = worst[unbounded] = 0
    return replace(
        plain,
        lower=lower,
        upper=upper,
        rank_best=best,
        rank_worst=worst,
        separation=found.separation,
    )
