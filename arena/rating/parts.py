"""Contestants who can all be rated among each other: point, rounds, interval, rank.

Notation: C contestants, B rounds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from arena.rating import remarks, sandwich
from arena.rating.bootstrap import Placed, Unit, interval, open_interval, place_on_one_scale
from arena.rating.chains import Status
from arena.rating.comparisons import Comparisons, FloatArray, count_pairs
from arena.rating.fits import Fitted, fit_votes
from arena.rating.logistic import Coefficient
from arena.rating.moderated import Spread, spread_of
from arena.rating.ranking import (
    Separation,
    above_by_bounds,
    judge_pairs,
    rank_sets,
    separation,
    shown_ranks,
)
from arena.rating.rules import Intervals, Method, Rules

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
    rank: np.ndarray | None = None
    rank_best: np.ndarray | None = None
    rank_worst: np.ndarray | None = None
    check_lower: FloatArray | None = None
    check_upper: FloatArray | None = None
    covariance: FloatArray | None = None
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
    counts = count_pairs(votes)
    found = fit_votes(votes, counts, rules)
    if found is None:
        notes = (remarks.NOT_RATED,) * len(votes.names)
        return Rated(explanation=(remarks.NO_DAVIDSON,), notes=notes)
    if status is Status.ALL_TIES:
        return _without_intervals(found, rules, remarks.ONLY_TIES, ())
    everywhere = place_on_one_scale(found.rating, found.samples, found.loose)
    spread: Spread | None = None
    if rules.intervals is Intervals.CLOSED_FORM and found.pulls is not None:
        spread = spread_of(votes, found.pulls, rules.unit, everywhere.reference)
    if _are_all_the_same(everywhere.values if spread is None else _ends(spread)):
        return _without_intervals(found, rules, remarks.NO_SPREAD, (remarks.why_no_spread(rules),))
    if everywhere.are_finite:
        bounds = interval(everywhere.values)
    else:
        bounds = open_interval(everywhere.values)
    if np.isnan(bounds).all():
        lost = found.loose.values.shape[1]
        said = remarks.why_no_interval(votes.shown, rules, lost=lost)
        return _without_intervals(found, rules, remarks.TOO_FEW, (said,))
    if spread is not None:
        return _in_closed_form(votes, rules, found, everywhere, bounds, spread)
    return _by_rounds(votes, rules, found, everywhere, bounds)


def _ends(spread: Spread) -> FloatArray:
    """(C, 2) both ends of the intervals, around zero."""
    half = spread.half_widths()
    return np.stack([-half, half], axis=1)


def _are_all_the_same(values: FloatArray) -> bool:
    """Whether no finite rating (C, B) differs from another one of the same contestant."""
    highest = np.where(np.isfinite(values), values, -np.inf).max(axis=1, initial=-np.inf)
    lowest = np.where(np.isfinite(values), values, np.inf).min(axis=1, initial=np.inf)
    known = np.isfinite(highest)
    return bool(known.any()) and bool((highest - lowest)[known].max() < _SAME)


def _without_intervals(
    fit: Fitted, rules: Rules, note: str, explanation: tuple[str, ...]
) -> Rated:
    return Rated(
        rating=fit.rating,
        tie_strength=fit.tie_strength,
        coefficients=fit.coefficients or (),
        degenerate=fit.loose.values.shape[1],
        notes=(note,) * len(fit.rating),
        explanation=explanation,
        warnings=_notes_on_method(rules),
    )


def _by_rounds(
    votes: Comparisons,
    rules: Rules,
    fit: Fitted,
    everywhere: Placed,
    bounds: tuple[FloatArray, FloatArray],
) -> Rated:
    """Intervals are percentiles of the resampled rounds."""
    few = remarks.few_clusters(votes, rules.unit)
    lower, upper = bounds
    if few and rules.unit is not Unit.TWO_WAY:
        wider = sandwich.factor(few) / sandwich.NORMAL
        lower = fit.rating + wider * (lower - fit.rating)
        upper = fit.rating + wider * (upper - fit.rating)
    covariance = None
    if rules.details:
        if rules.method is Method.BRADLEY_TERRY and fit.pulls is not None:
            covariance = sandwich.covariance(votes, fit.pulls, rules.unit)
        elif fit.samples.shape[1] > 1:
            covariance = np.cov(fit.samples)
    judged = _separation(fit.rating, everywhere)
    plain = None
    if rules.details and rules.method is Method.BRADLEY_TERRY and fit.pulls is not None:
        found = sandwich.covariance(votes, fit.pulls, rules.unit)
        plain = sandwich.relative_to(found, everywhere.reference)
    ends = (lower, upper)
    error = None if plain is None else _errors(plain)
    return _with_intervals(votes, rules, fit, everywhere, ends, judged, covariance, error)


def _errors(covariance: FloatArray) -> FloatArray:
    """(C,) standard errors."""
    return np.asarray(np.sqrt(np.maximum(covariance.diagonal(), 0.0)))


def _in_closed_form(
    votes: Comparisons,
    rules: Rules,
    fit: Fitted,
    everywhere: Placed,
    open_bounds: tuple[FloatArray, FloatArray],
    spread: Spread,
) -> Rated:
    """Student's t around the ratings; a bound is missing where the rounds leave it open."""
    half = spread.half_widths()
    below, above = (np.where(np.isnan(bound), np.nan, half) for bound in open_bounds)
    members = np.flatnonzero(everywhere.reference)
    judged = judge_pairs(
        fit.rating[members], spread.among(members), rounds=rules.rounds, seed=rules.seed
    ).among(members, len(fit.rating))
    bounds = (fit.rating - below, fit.rating + above)
    plain = _errors(spread.plain)
    return _with_intervals(votes, rules, fit, everywhere, bounds, judged, spread.covariance, plain)


def _with_intervals(
    votes: Comparisons,
    rules: Rules,
    fit: Fitted,
    everywhere: Placed,
    bounds: tuple[FloatArray, FloatArray],
    judged: Separation | None,
    covariance: FloatArray | None,
    plain_error: FloatArray | None,
) -> Rated:
    lower, upper = bounds
    rank = shown_ranks(lower, upper, average=float(fit.rating[everywhere.reference].mean()))
    nobody = np.zeros((len(lower), len(lower)), dtype=bool)
    apart = nobody if judged is None else judged.above
    best, worst = rank_sets(above_by_bounds(apart, lower, upper))
    unbounded = np.isnan(lower) & np.isnan(upper)
    best[unbounded] = worst[unbounded] = 0
    check = None
    if rules.details and plain_error is not None and rules.method is Method.BRADLEY_TERRY:
        few = remarks.few_clusters(votes, rules.unit)
        check = np.asarray(sandwich.factor(few) * plain_error)
        check[np.isnan(lower) | np.isnan(upper)] = np.nan
    degenerate, drawn = fit.loose.values.shape[1], everywhere.values.shape[1]
    notes = remarks.notes_on_bounds(lower, upper, rank)
    notes = remarks.why_too_few(votes, rules.unit, notes)
    return Rated(
        rating=fit.rating,
        lower=lower,
        upper=upper,
        rank=rank,
        rank_best=best,
        rank_worst=worst,
        check_lower=None if check is None else fit.rating - check,
        check_upper=None if check is None else fit.rating + check,
        covariance=covariance if rules.details else None,
        separation=judged if rules.details else None,
        tie_strength=fit.tie_strength,
        coefficients=fit.coefficients or (),
        degenerate=degenerate,
        notes=notes,
        explanation=_on_covariates(votes, fit) + remarks.who_is_open(votes.shown, notes),
        warnings=_notes_on_method(rules)
        + remarks.warnings(votes, rules=rules, rounds=drawn, degenerate=degenerate),
    )


def _separation(rating: FloatArray, everywhere: Placed) -> Separation | None:
    """All pairs of the reference, judged by the rounds that determine all of it."""
    members = np.flatnonzero(everywhere.reference)
    samples = everywhere.values[members]
    if not everywhere.are_finite:
        fine = np.asarray(np.isfinite(samples).all(axis=0))
        if 2 * fine.sum() < len(fine):
            return None
        samples = samples[:, fine]
    found = separation(rating[members], samples)
    return found.among(members, len(rating))


def _on_covariates(votes: Comparisons, fit: Fitted) -> tuple[str, ...]:
    missing = votes.covariates.shape[1] > 0 and fit.coefficients is None
    return (remarks.NOT_ADJUSTED,) if missing else ()


def _notes_on_method(rules: Rules) -> tuple[str, ...]:
    return (remarks.ELO_NOTE,) if rules.method is Method.ELO else ()
