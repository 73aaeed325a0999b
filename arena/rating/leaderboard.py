"""The rated table: which contestants, how strong, how sure, which rank. Read this file first.

In: `Comparisons` of named contestants, as arrays. Out: a `Leaderboard`: for each of them a `Line`
with rating, interval and rank, and what must be said with the numbers.

    votes = as_arrays(names, [Comparison(first="a", second="b", score=1.0, expert="e", ...), ...])
    board = rate(votes)  # the default: Bradley-Terry, two-way, intervals in closed form
    board = rate(votes, unit=Unit.VOTE, rounds=PAPER_ROUNDS)  # the paper's mode
    board.lines[i].rating, .lower, .upper, .rank  # None where the votes do not determine them
    board.status, board.explanation, board.warnings  # always shown with the numbers

Votes that were grouped elsewhere go into `Comparisons` directly, with their `count`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any, TypeVar

import numpy as np

from arena.rating import elo, remarks
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import MEAN_ELO
from arena.rating.chains import Diagnosis, Status, diagnose
from arena.rating.comparisons import (
    Comparisons,
    FloatArray,
    count_pairs,
    renumber_codes,
    restrict_to,
    split_votes,
    tally,
)
from arena.rating.lines import Line
from arena.rating.logistic import Coefficient
from arena.rating.parts import Rated, rate_part
from arena.rating.ranking import Separation
from arena.rating.rules import (
    MOST_CONTESTANTS,
    Intervals,
    Method,
    Order,
    Report,
    Rules,
    TooManyContestants,
    default_intervals,
)
from arena.rating.tiers import Tiers, outer_bounds, ranks_across, standing_order, tiers

__all__ = ["Intervals", "Leaderboard", "Line", "Method", "Order", "Unit", "anchor_board", "rate"]

T = TypeVar("T", bound=str)

ROUNDS = 10_000
PAPER_ROUNDS = 1000
_NO_VOTES = "no votes"
FEWEST_TO_JUDGE = 5
"""With three experts equals were told apart in up to 9 % of simulated studies."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Leaderboard:
    """All contestants, in the order of the comparisons' names, and how they were rated.

    Attributes:
        order: The numbers of the lines, best first; who has no votes comes last.
        reasons: Why ratings or intervals are missing, none if none is.
        warnings: What to keep in mind.
        seed: Of the draws; the same votes, rules and seed give the same board.
        votes: How many were counted.
        experts, scenarios: How many there are among the votes.
        tie_share: Ties among the votes, None without votes.
        tie_strength: v of Davidson's model, None with other methods.
        degenerate_rounds: Bootstrap rounds whose votes did not determine everybody's rating.
        covariance: (C, C) of the ratings in squared points, NaN where there is no rating: the
            sandwich of the unit for Bradley-Terry, that of the rounds for other methods. None
            without intervals or where details were not asked for.
        separation: All pairs judged at once, matrices (C, C), NaN for those without votes. None
            where there are no intervals, several parts, or details were not asked for.
        coefficients: Of the votes' covariates, in their order; none where these are not
            determined, or in several parts.
    """

    lines: tuple[Line, ...]
    order: tuple[int, ...]
    status: Status
    reasons: tuple[str, ...]
    warnings: tuple[str, ...] = ()
    method: Method
    unit: Unit
    intervals: Intervals
    rounds: int
    seed: int
    votes: int = 0
    experts: int = 0
    scenarios: int = 0
    tie_share: float | None = None
    tie_strength: float | None = None
    degenerate_rounds: int = 0
    covariance: FloatArray | None = field(default=None, compare=False)
    separation: Separation | None = field(default=None, compare=False)
    coefficients: tuple[Coefficient, ...] = ()

    @property
    def standings(self) -> tuple[Line, ...]:
        """The lines, best first."""
        return tuple(self.lines[index] for index in self.order)

    @property
    def told_apart(self) -> Separation | None:
        """The pairs where "at 5 % for the whole table" holds: docs/rating.md.

        Only intervals in closed form that know of experts or scenarios, at least five of each,
        hold it: votes that hang together unseen tell equals apart in every second study.
        """
        clusters = {Unit.EXPERT: self.experts, Unit.SCENARIO: self.scenarios}
        there = {unit: number for unit, number in clusters.items() if number > 1}
        seen = there if self.unit is Unit.TWO_WAY else {self.unit}
        holds = there.keys() <= set(seen) and min(there.values(), default=0) >= FEWEST_TO_JUDGE
        is_closed = self.intervals is Intervals.CLOSED_FORM
        return self.separation if holds and is_closed else None

    @property
    def explanation(self) -> str:
        """The reasons in one line, empty if nothing is missing."""
        return " ".join(self.reasons)


def rate(
    votes: Comparisons,
    *,
    method: Method = Method.BRADLEY_TERRY,
    rounds: int = ROUNDS,
    unit: Unit | None = None,
    intervals: Intervals | None = None,
    seed: int = 0,
    k: float = elo.K,
    order: Order = Order.SHUFFLED,
    details: bool = True,
    workers: int = 1,
    report: Report | None = None,
) -> Leaderboard:
    """Rate all contestants that have votes, with 95 % intervals on the Elo scale, mean 1000.

    Where not everybody can be rated together, those who can are rated among each other. Ranks
    then count those who only won against the rest as above it and those who only lost as below,
    as far as their number of votes shows it; groups that never met are ranked each by itself. The
    status and the explanation say so.

    Args:
        votes: What was voted; contestants without votes get a line without a rating. With
            covariates the ratings are those of contestants who are alike in them.
        method: Bradley-Terry, Davidson's tie model, or online Elo.
        rounds: Of the bootstrap; for intervals in closed form, of what is drawn to see who is
            determined and how far apart equals come to lie.
        unit: What hangs together: both ways by default, single votes for online Elo, which knows
            no other.
        intervals: In closed form by default, but resampled where the unit is single votes.
        seed: Of its draws; the same votes and seed give the same table.
        k: Points at stake in a vote, online Elo only.
        order: Online Elo's point: the median over shuffled rounds, or the recorded order.
        details: Also what costs extra: covariance, cross-check and separation.
        workers: Threads, where they help; the answer does not depend on how many.
        report: Is told how many rounds are done.

    Raises:
        TooManyContestants: More than 2000.
        ValueError: Fewer than one round, online Elo with a unit other than votes, or covariates
            with another method than Bradley-Terry or with resampled intervals.
    """
    if unit is None:
        unit = Unit.VOTE if method is Method.ELO else Unit.TWO_WAY
    if votes.covariates.shape[1]:
        intervals = _intervals_beside_covariates(method, intervals)
    rules = Rules(
        method=method,
        unit=unit,
        intervals=intervals or default_intervals(method, unit),
        rounds=rounds,
        seed=seed,
        k=k,
        order=order,
        details=details,
        workers=workers,
        report=report,
    )
    return _rate(votes, rules)


def _intervals_beside_covariates(method: Method, intervals: Intervals | None) -> Intervals:
    if method is not Method.BRADLEY_TERRY or intervals not in (None, Intervals.CLOSED_FORM):
        raise ValueError("covariates need Bradley-Terry with intervals in closed form")
    return Intervals.CLOSED_FORM


def _rate(votes: Comparisons, rules: Rules) -> Leaderboard:
    if len(votes.names) > MOST_CONTESTANTS:
        raise TooManyContestants(
            f"at most {MOST_CONTESTANTS} contestants can be rated together, not {len(votes.names)}"
        )
    counted = tally(votes)
    present = np.flatnonzero(counted.sum(axis=1)).tolist()
    counting = restrict_to(votes, present)
    diagnosis = _diagnose(votes, counting, rules.method)
    chains = diagnosis.chains
    across = tiers(counting, chains, rules.unit)
    above = chains.above()
    parts = sorted(
        (part for part in chains.parts() if len(part) > 1),
        key=lambda part: (chains.group_of[part[0]], above[part[0]], part),
    )
    rated = [rate_part(inside, rules, diagnosis.status) for inside in split_votes(counting, parts)]
    lines = _blank_lines(votes.names, counted.tolist(), present, diagnosis)
    for number, (part, found) in enumerate(zip(parts, rated, strict=True)):
        _fill(lines, [present[member] for member in part], number, found)
    if len(chains.sizes) > len(chains.groups()):
        _rank_across(lines, present, across, rules)
    order = standing_order(across, [lines[index] for index in present])
    whole = rated[0] if len(rated) == 1 and len(parts[0]) == len(present) else None
    return Leaderboard(
        lines=tuple(lines),
        order=(*(present[one] for one in order), *sorted(set(range(len(lines))) - set(present))),
        status=_status(diagnosis, rated),
        reasons=_once(diagnosis.explanation, *(found.explanation for found in rated)),
        warnings=_once(*(found.warnings for found in rated)),
        method=rules.method,
        unit=rules.unit,
        intervals=rules.intervals,
        rounds=rules.rounds,
        seed=rules.seed,
        votes=votes.votes,
        experts=len(renumber_codes(votes.expert)[0]),
        scenarios=len(renumber_codes(votes.scenario)[0]),
        tie_share=float(counted[:, 1].sum() / counted.sum()) if len(votes) else None,
        tie_strength=whole.tie_strength if whole else None,
        degenerate_rounds=max((found.degenerate for found in rated), default=0),
        covariance=_joined(len(lines), present, parts, rated),
        separation=whole.separation.among(np.array(present), len(lines))
        if whole and whole.separation
        else None,
        coefficients=whole.coefficients if whole else (),
    )


def anchor_board(board: Leaderboard, *, name: str, at: float) -> Leaderboard:
    """The same board with a contestant's rating shown as `at`, and all of its part moved alike.

    A shift of what is shown only: intervals keep their widths, and the anchor keeps its own.

    Raises:
        ValueError: Nobody of that name has a rating.
    """
    anchor = next((line for line in board.lines if line.name == name), None)
    if anchor is None or anchor.rating is None:
        raise ValueError(f"{name!r} has no rating to anchor the others to")
    shift = at - anchor.rating
    return replace(
        board,
        lines=tuple(
            _shifted(line, shift) if line.part == anchor.part else line for line in board.lines
        ),
    )


def _shifted(line: Line, shift: float) -> Line:
    columns = ("rating", "lower", "upper", "check_lower", "check_upper")
    values = {column: getattr(line, column) for column in columns}
    moved: dict[str, Any] = {
        column: value + shift for column, value in values.items() if value is not None
    }
    return replace(line, **moved)


def _diagnose(votes: Comparisons, counting: Comparisons, method: Method) -> Diagnosis:
    if len(votes.names) == 1:
        return Diagnosis(
            status=Status.ONE_CONTESTANT,
            explanation=(
                f"There is only one contestant, {votes.shown[0]}: nobody to compare with.",
            ),
        )
    # Online Elo's steps of at most K points stay finite whoever wins.
    return diagnose(counting.shown, count_pairs(counting), bounded_anyway=method is Method.ELO)


def _once(*said: tuple[T, ...]) -> tuple[T, ...]:
    return tuple(dict.fromkeys(one for sentences in said for one in sentences))


def _status(diagnosis: Diagnosis, rated: list[Rated]) -> Status:
    if diagnosis.status is Status.RATED and any(found.rating is None for found in rated):
        return Status.UNBOUNDED
    if diagnosis.status is Status.RATED and any(found.lower is None for found in rated):
        return Status.NO_INTERVALS
    if diagnosis.status is Status.RATED and any(found.is_open for found in rated):
        return Status.OPEN_INTERVALS
    return diagnosis.status


def _joined(
    contestants: int, present: list[int], parts: list[tuple[int, ...]], rated: list[Rated]
) -> FloatArray | None:
    """(C, C) of the parts' covariances, NaN between parts."""
    if all(found.covariance is None for found in rated):
        return None
    joined = np.full((contestants, contestants), np.nan)
    for part, found in zip(parts, rated, strict=True):
        members = [present[member] for member in part]
        if found.covariance is not None:
            joined[np.ix_(members, members)] = found.covariance
    return joined


# --- Lines, filled part by part ------------------------------------------------------------------


def _blank_lines(
    names: tuple[str, ...], counted: list[list[int]], present: list[int], diagnosis: Diagnosis
) -> list[Line]:
    """The lines without ratings; whoever is alone in a part keeps the note that says why."""
    notes = dict(zip(present, diagnosis.notes, strict=False))
    return [
        Line(
            name=name,
            votes=sum(row),
            wins=row[0],
            ties=row[1],
            losses=row[2],
            part=-1,
            note=notes.get(index, "") if any(row) else _NO_VOTES,
        )
        for index, (name, row) in enumerate(zip(names, counted, strict=True))
    ]


def _fill(lines: list[Line], members: list[int], number: int, found: Rated) -> None:
    """Put the numbers of a part into its lines."""
    names = [column.name for column in fields(Line)]
    columns = {name: getattr(found, name, None) for name in names}
    known = {name: column for name, column in columns.items() if column is not None}
    for place, index in enumerate(members):
        values: dict[str, Any] = {
            name: _known(name, column[place].item()) for name, column in known.items()
        }
        note = found.notes[place] if found.notes else ""
        lines[index] = replace(lines[index], part=number, note=note, **values)


def _known(column: str, value: float) -> float | None:
    """None for a bound that is not a number and a withheld rank."""
    missing = value == 0 if column.startswith("rank") else math.isnan(value)
    return None if missing else value


def _rank_across(lines: list[Line], present: list[int], across: Tiers, rules: Rules) -> None:
    """Ranks over all parts that met, and what the votes say of those who are alone in theirs."""
    counting = [lines[index] for index in present]
    inner = np.array([line.rank or 0 for line in counting])
    lower, upper = (
        np.array([_from_mean(line, bound) for line in counting]) for bound in ("lower", "upper")
    )
    ranks = ranks_across(across, inner, lower, upper).tolist()
    least, most = outer_bounds(across)
    for place, (index, line) in enumerate(zip(present, counting, strict=True)):
        rank = ranks[place] or None
        note = remarks.note_with_rank(line.note, rank)
        moved: dict[str, Any] = {
            "rank": rank, "rank_best": None, "rank_worst": None, "note": note
        }  # fmt: skip
        if line.rating is None and rules.method is Method.BRADLEY_TERRY:
            moved["lower"] = _known("lower", MEAN_ELO + least[place].item())
            moved["upper"] = _known("upper", MEAN_ELO + most[place].item())
        lines[index] = replace(line, **moved)


def _from_mean(line: Line, bound: str) -> float:
    """How far a bound is from the mean of its part; zero for who is alone in one."""
    if line.part < 0:
        return 0.0
    value: float | None = getattr(line, bound)
    return math.nan if value is None else value - MEAN_ELO
