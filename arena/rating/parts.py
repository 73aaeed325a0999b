"""Contestants who can all be rated among each other: point, rounds, interval, rank.

Notation: C contestants, B rounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from arena.rating import bradley_terry, davidson, elo, remarks, sandwich
from arena.rating.bootstrap import Rounds, Unit, interval, resample
from arena.rating.bradley_terry import Meetings, to_elo
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    PairCounts,
    count_pairs,
)
from arena.rating.connectivity import Determined, Status
from arena.rating.ranking import Separation, rank_interval, ranks, separation
from augment.sentences import Sentence


class Method(StrEnum):
    """How votes become ratings."""

    BRADLEY_TERRY = "bt"
    DAVIDSON = "davidson"
    ELO = "elo"


class Order(StrEnum):
    """What online Elo shows as its point; its rounds are always shuffled."""

    SHUFFLED = "shuffled"
    RECORDED = "recorded"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """How to rate."""

    method: Method
    unit: Unit
    rounds: int
    seed: int
    k: float
    order: Order
    details: bool

    def __post_init__(self) -> None:
        if self.rounds < 1:
            raise ValueError(f"a bootstrap needs at least 1 round, not {self.rounds}")
        if self.method is Method.ELO and self.unit is not Unit.VOTE:
            raise ValueError(f"online Elo resamples single votes only, not by {self.unit}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rated:
    """What came out for contestants rated together; arrays are (C,), None where undetermined."""

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
    degenerate: int = 0
    explanation: tuple[Sentence, ...] = ()
    warnings: tuple[Sentence, ...] = ()

    def columns(self) -> dict[str, np.ndarray | None]:
        """What goes into the lines of the table, by the name that it has there."""
        names = ("rating", "lower", "upper", "rank", "rank_best", "rank_worst")
        checks = ("check_lower", "check_upper")
        return {name: getattr(self, name) for name in names + checks}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Fitted:
    """Ratings of the data (C,) and of the rounds that determine any (C, b)."""

    rating: FloatArray
    samples: FloatArray
    strengths: FloatArray | None = None
    tie_strength: float | None = None


def rate_part(votes: Comparisons, rules: Rules, status: Status, *, is_all: bool = True) -> Rated:
    """Rate contestants who have votes and can all be rated among each other.

    Args:
        votes: In which only they met.
        rules: How.
        status: Of the data; where every vote is a tie there are no intervals.
        is_all: Whether there is nobody else, so that sentences need not say whom they are about.
    """
    counts = count_pairs(votes)
    if rules.method is Method.ELO:
        fitted = _elo(votes, rules)
    elif rules.method is Method.DAVIDSON and 0 < counts.outcomes[:, 1].sum() < votes.votes:
        found = _davidson(votes, counts, rules)
        if found is None:
            return Rated(explanation=(remarks.NO_DAVIDSON,))
        fitted = found
    else:
        fitted = _bradley_terry(votes, counts, rules)
    degenerate = rules.rounds - fitted.samples.shape[1]
    among = () if is_all else votes.names
    missing = remarks.why_no_interval(
        fitted.samples, rounds=rules.rounds, unit=rules.unit, among=among
    )
    if missing or status is Status.ALL_TIES:
        return Rated(
            rating=fitted.rating,
            rank=np.ones(len(fitted.rating), dtype=np.int64),
            tie_strength=fitted.tie_strength,
            degenerate=degenerate,
            explanation=() if status is Status.ALL_TIES else missing,
            warnings=_notes_on_method(rules),
        )
    return _with_intervals(votes, counts, rules, fitted, degenerate)


def _with_intervals(
    votes: Comparisons, counts: PairCounts, rules: Rules, fitted: _Fitted, degenerate: int
) -> Rated:
    few = remarks.few_clusters(votes, rules.unit)
    lower, upper = interval(fitted.samples)
    if few and rules.unit is not Unit.TWO_WAY:
        wider = sandwich.factor(few) / sandwich.NORMAL
        lower = fitted.rating + wider * (lower - fitted.rating)
        upper = fitted.rating + wider * (upper - fitted.rating)
    best, worst = rank_interval(fitted.samples)
    covariance = check = None
    if rules.details and fitted.strengths is not None:
        covariance = sandwich.covariance(votes, counts, fitted.strengths, rules.unit)
        check = sandwich.factor(few) * np.sqrt(covariance.diagonal())
    elif rules.details:
        covariance = np.cov(fitted.samples)
    return Rated(
        rating=fitted.rating,
        lower=lower,
        upper=upper,
        rank=ranks(lower, upper),
        rank_best=best,
        rank_worst=worst,
        check_lower=None if check is None else fitted.rating - check,
        check_upper=None if check is None else fitted.rating + check,
        covariance=covariance,
        separation=separation(fitted.rating, fitted.samples) if rules.details else None,
        tie_strength=fitted.tie_strength,
        degenerate=degenerate,
        warnings=_notes_on_method(rules)
        + remarks.warnings(votes, unit=rules.unit, rounds=rules.rounds, degenerate=degenerate),
    )


def _notes_on_method(rules: Rules) -> tuple[Sentence, ...]:
    return (remarks.ELO_NOTE,) if rules.method is Method.ELO else ()


# --- The methods ---------------------------------------------------------------------------------


def _elo(votes: Comparisons, rules: Rules) -> _Fitted:
    samples = elo.resampled(votes, rounds=rules.rounds, seed=rules.seed, k=rules.k)
    if rules.order is Order.RECORDED:
        return _Fitted(rating=elo.replay(votes, k=rules.k), samples=samples)
    return _Fitted(rating=np.median(samples, axis=1), samples=samples)


def _bradley_terry(votes: Comparisons, counts: PairCounts, rules: Rules) -> _Fitted:
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    point = bradley_terry.newton(met, counts.games[:, None], counts.scores[:, None])[:, 0]
    inverse = bradley_terry.inverse_curvature(met, counts.games, point) * counts.games.sum()
    rating = to_elo(point)
    samples = [np.empty((len(rating), 0))]
    for drawn, fine in _rounds(votes, counts, rules):
        games, scores = drawn.games, drawn.scores
        if not fine.all():
            games, scores = games[:, fine], scores[:, fine]
        strengths = bradley_terry.fit_rounds(met, games, scores, start=point, inverse=inverse)
        samples.append(to_elo(strengths))
    return _Fitted(rating=rating, samples=np.hstack(samples), strengths=point)


def _davidson(votes: Comparisons, counts: PairCounts, rules: Rules) -> _Fitted | None:
    """None where the votes determine no ratings in this model."""
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    ties = counts.outcomes[:, 1].sum(keepdims=True).astype(np.float64)
    point = davidson.fit(met, counts.games[:, None], counts.scores[:, None], ties)[:, 0]
    if np.isnan(point).any():
        return None
    samples = [np.empty((len(votes.names), 0))]
    for drawn, fine in _rounds(votes, counts, rules):
        fine = fine & (drawn.ties > 0) & (drawn.ties < drawn.games.sum(axis=0))
        games, scores, ties = drawn.games[:, fine], drawn.scores[:, fine], drawn.ties[fine]
        answers = davidson.fit(met, games, scores, ties, start=point)[:-1]
        samples.append(to_elo(answers[:, ~np.isnan(answers[0])]))
    return _Fitted(
        rating=to_elo(point[:-1]),
        samples=np.hstack(samples),
        tie_strength=float(np.exp(point[-1])),
    )


def _rounds(
    votes: Comparisons, counts: PairCounts, rules: Rules
) -> Iterator[tuple[Rounds, BoolArray]]:
    """Blocks of rounds, and which of each block determine ratings."""
    determined = Determined(
        contestants=len(votes.names),
        low=counts.low,
        high=counts.high,
        games=counts.games,
        scores=counts.scores,
    )
    drawn = resample(votes, counts, unit=rules.unit, rounds=rules.rounds, seed=rules.seed)
    for block in drawn:
        yield block, determined.among(block.games, block.scores)
