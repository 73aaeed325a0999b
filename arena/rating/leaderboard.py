"""The rated table: which contestants, how strong, how sure, which rank. Read this file first."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from arena.rating import bradley_terry, elo
from arena.rating.bootstrap import LEVEL, Unit, interval, resample
from arena.rating.comparisons import (
    Comparisons,
    FloatArray,
    PairCounts,
    count_pairs,
    tally,
)
from arena.rating.connectivity import Diagnosis, Status, determined, diagnose
from arena.rating.ranking import ranks

MOST_DEGENERATE = (1.0 - LEVEL) / 2.0
"""The largest share of rounds without ratings that still leaves a percentile to read."""


class Method(StrEnum):
    """How votes become ratings."""

    BRADLEY_TERRY = "bt"
    ELO = "elo"


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One contestant; None where the votes do not determine a number, and the note says why."""

    name: str
    rating: float | None = None
    lower: float | None = None
    upper: float | None = None
    rank: int | None = None
    votes: int = 0
    wins: int = 0
    ties: int = 0
    losses: int = 0
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaderboard:
    """All contestants, in the order of the comparisons' names.

    Attributes:
        explanation: Why ratings or intervals are missing, empty if none is.
        degenerate_rounds: Bootstrap rounds whose votes determined no ratings, left out of the
            intervals.
    """

    lines: tuple[Line, ...]
    status: Status
    explanation: str
    degenerate_rounds: int = 0


def rate(
    votes: Comparisons,
    *,
    method: Method = Method.BRADLEY_TERRY,
    rounds: int = 1000,
    unit: Unit = Unit.VOTE,
    seed: int = 0,
) -> Leaderboard:
    """Rate all contestants that have votes, with 95 % intervals on the Elo scale, mean 1000.

    Args:
        votes: What was voted; contestants without votes get a line without a rating.
        method: Bradley-Terry, or online Elo, whose point is the median over the rounds.
        rounds: Of the bootstrap.
        unit: What it draws; online Elo draws votes only.
        seed: Of its draws; the same votes and seed give the same table.

    Raises:
        ValueError: Fewer than one round, or online Elo with a unit other than votes.
    """
    if rounds < 1:
        raise ValueError(f"a bootstrap needs at least 1 round, not {rounds}")
    if method is Method.ELO and unit is not Unit.VOTE:
        raise ValueError(f"online Elo resamples single votes only, not by {unit}")
    counted = tally(votes)
    present = counted.sum(axis=1) > 0
    lines = [
        Line(
            name=name,
            votes=int(row.sum()),
            wins=int(row[0]),
            ties=int(row[1]),
            losses=int(row[2]),
            note="" if row.any() else "no votes",
        )
        for name, row in zip(votes.names, counted, strict=True)
    ]
    among = _only(votes, present)
    counts = count_pairs(among)
    diagnosis = _diagnose(votes, among, counts, method)
    if not diagnosis.has_ratings:
        return Leaderboard(
            lines=tuple(lines), status=diagnosis.status, explanation=diagnosis.explanation
        )
    if method is Method.ELO:
        samples = elo.resampled(among, rounds=rounds, seed=seed)
        rating = np.median(samples, axis=0)
    else:
        rating, samples = _bradley_terry(among, counts, unit, rounds, seed)
    return _filled(lines, np.flatnonzero(present), rating, samples, rounds, diagnosis)


def _only(votes: Comparisons, present: np.ndarray) -> Comparisons:
    """The same votes with the contestants numbered without those who have none."""
    number = np.cumsum(present) - 1
    names = tuple(name for name, there in zip(votes.names, present, strict=True) if there)
    return replace(votes, names=names, first=number[votes.first], second=number[votes.second])


def _diagnose(
    votes: Comparisons, among: Comparisons, counts: PairCounts, method: Method
) -> Diagnosis:
    if len(votes.names) == 1:
        return Diagnosis(
            status=Status.ONE_CONTESTANT,
            explanation=f"There is only one contestant, {votes.names[0]}: nobody to compare with.",
        )
    found = diagnose(among.names, counts)
    if method is Method.ELO and found.status is Status.UNBOUNDED:
        return Diagnosis(status=Status.RATED)  # steps of at most K points stay finite
    return found


def _bradley_terry(
    votes: Comparisons, counts: PairCounts, unit: Unit, rounds: int, seed: int
) -> tuple[FloatArray, FloatArray]:
    """The ratings (C,) and those of every round that determines any (b, C)."""
    contestants, low, high = len(votes.names), counts.low, counts.high
    games, scores = counts.games[None], counts.scores[None]
    point = bradley_terry.fit(
        contestants=contestants, low=low, high=high, games=games, scores=scores
    )[0]
    samples = [np.empty((0, contestants))]
    for games, scores in resample(votes, counts, unit=unit, rounds=rounds, seed=seed):
        fine = determined(contestants=contestants, low=low, high=high, games=games, scores=scores)
        samples.append(
            bradley_terry.fit(
                contestants=contestants,
                low=low,
                high=high,
                games=games[fine],
                scores=scores[fine],
                start=point,
            )
        )
    return bradley_terry.to_elo(point), bradley_terry.to_elo(np.vstack(samples))


def _filled(
    lines: list[Line],
    rated: np.ndarray,
    rating: FloatArray,
    samples: FloatArray,
    rounds: int,
    diagnosis: Diagnosis,
) -> Leaderboard:
    """The lines with ratings, bounds where they mean something, and ranks."""
    degenerate = rounds - len(samples)
    explanation = diagnosis.explanation
    bounded = diagnosis.status is Status.RATED
    if degenerate > MOST_DEGENERATE * rounds:
        bounded = False
        explanation = (
            f"{explanation} In {degenerate} of {rounds} resamples the votes determined no "
            "ratings, so intervals can't be given: there are too few votes, or hardly any "
            "against some contestant."
        ).strip()
    lower, upper = np.full(len(rating), -np.inf), np.full(len(rating), np.inf)
    if bounded:
        lower, upper = interval(samples)
    for place, index in enumerate(rated):
        lines[index] = replace(
            lines[index],
            rating=float(rating[place]),
            lower=float(lower[place]) if bounded else None,
            upper=float(upper[place]) if bounded else None,
            rank=int(ranks(lower, upper)[place]),
        )
    return Leaderboard(
        lines=tuple(lines),
        status=diagnosis.status,
        explanation=explanation,
        degenerate_rounds=degenerate,
    )
