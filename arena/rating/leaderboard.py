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

import math
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from arena.rating import models, remarks
from arena.rating.chains import (
    Diagnosis,
    Status,
    diagnose,
    find_levels,
    outer_bounds,
    ranks_across,
    standing_order,
)
from arena.rating.comparisons import Comparisons, count_pairs, restrict_to, tally
from arena.rating.lines import Line
from arena.rating.logistic import Coefficient
from arena.rating.parts import Rated, rate_part
from arena.rating.ranking import Separation
from arena.rating.rules import (
    MOST_CONTESTANTS,
    Intervals,
    Method,
    Rules,
    TooManyContestants,
    Unit,
    default_intervals,
)

__all__ = ["Intervals", "Leaderboard", "Line", "Method", "Unit", "rate"]

ROUNDS = 10_000
PAPER_ROUNDS = 1000
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
        separation: All pairs judged at once, matrices (C, C), NaN for those without votes. None
            where there are no intervals, or several parts.
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
        numbers = {"expert": self.experts, "scenario": self.scenarios}
        several = {kind: number for kind, number in numbers.items() if number > 1}
        is_known = several.keys() <= set(self.unit.kinds)
        holds = is_known and min(several.values(), default=0) >= FEWEST_TO_JUDGE
        return self.separation if holds and self.intervals is Intervals.CLOSED_FORM else None

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

    Raises:
        TooManyContestants: More than 2000.
        ValueError: Fewer than one round, online Elo with a unit other than votes, or covariates
            with another method than Bradley-Terry or with resampled intervals.
    """
    if len(votes.names) > MOST_CONTESTANTS:
        raise TooManyContestants(
            f"at most {MOST_CONTESTANTS} contestants can be rated together, not {len(votes.names)}"
        )
    if unit is None:
        unit = Unit.VOTE if method is Method.ELO else Unit.TWO_WAY
    if votes.covariates.shape[1]:
        intervals = intervals or Intervals.CLOSED_FORM
        if method is not Method.BRADLEY_TERRY or intervals is not Intervals.CLOSED_FORM:
            raise ValueError("covariates need Bradley-Terry with intervals in closed form")
    intervals = intervals or default_intervals(method, unit)
    return _rate(votes, Rules(method, unit, intervals, rounds, seed))


def _rate(votes: Comparisons, rules: Rules) -> Leaderboard:
    counted = tally(votes)
    present = np.flatnonzero(counted.sum(axis=1)).tolist()
    counting = restrict_to(votes, present)
    # Online Elo's steps of at most K points stay finite whoever wins.
    diagnosis = diagnose(
        counting.shown, count_pairs(counting), bounded_anyway=rules.method is Method.ELO
    )
    if len(votes.names) == 1:
        reason = f"There is only one contestant, {votes.shown[0]}: nobody to compare with."
        diagnosis = replace(diagnosis, status=Status.ONE_CONTESTANT, explanation=(reason,))
    chains = diagnosis.chains
    above = chains.above()
    parts = sorted(
        (part for part in chains.parts() if len(part) > 1),
        key=lambda part: (chains.group_of[part[0]], above[part[0]], part),
    )
    rated = [rate_part(restrict_to(counting, part), rules, diagnosis.status) for part in parts]
    lines = _blank_lines(votes.names, counted.tolist(), present, diagnosis)
    for number, (part, found) in enumerate(zip(parts, rated, strict=True)):
        _fill(lines, [present[member] for member in part], number, found)
    if len(chains.sizes) > len(chains.groups()):
        _rank_across(lines, present, counting, diagnosis, rules)
    order = standing_order(chains, [lines[index] for index in present])
    absent = sorted(set(range(len(lines))) - set(present))
    whole = rated[0] if len(rated) == 1 and len(parts[0]) == len(present) else Rated()
    separation = whole.separation and whole.separation.among(np.array(present), len(lines))
    return Leaderboard(
        lines=tuple(lines),
        order=(*(present[place] for place in order), *absent),
        status=_status(diagnosis, rated),
        reasons=_unique(diagnosis.explanation, *(found.explanation for found in rated)),
        warnings=_unique(*(found.warnings for found in rated)),
        method=rules.method,
        unit=rules.unit,
        intervals=rules.intervals,
        rounds=rules.rounds,
        seed=rules.seed,
        votes=votes.votes,
        experts=len(np.unique(votes.expert)),
        scenarios=len(np.unique(votes.scenario)),
        tie_share=float(counted[:, 1].sum() / counted.sum()) if len(votes) else None,
        tie_strength=whole.tie_strength,
        degenerate_rounds=max((found.degenerate for found in rated), default=0),
        separation=separation,
        coefficients=whole.coefficients,
    )


def _unique(*sentences: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(sentence for some in sentences for sentence in some))


def _status(diagnosis: Diagnosis, rated: list[Rated]) -> Status:
    if diagnosis.status is Status.RATED:
        if any(found.rating is None for found in rated):
            return Status.UNBOUNDED
        if any(found.lower is None for found in rated):
            return Status.NO_INTERVALS
        if any(found.is_open for found in rated):
            return Status.OPEN_INTERVALS
    return diagnosis.status


# --- Lines, filled part by part ------------------------------------------------------------------


def _blank_lines(
    names: tuple[str, ...], counted: list[list[int]], present: list[int], diagnosis: Diagnosis
) -> list[Line]:
    """The lines without ratings; whoever is alone in a part keeps the note that says why."""
    notes = dict(zip(present, diagnosis.notes, strict=False))
    return [
        Line(
            name=name,
            votes=wins + ties + losses,
            wins=wins,
            ties=ties,
            losses=losses,
            part=-1,
            note=notes.get(index, "") if wins + ties + losses else "no votes",
        )
        for index, (name, (wins, ties, losses)) in enumerate(zip(names, counted, strict=True))
    ]


def _fill(lines: list[Line], members: list[int], number: int, found: Rated) -> None:
    """Put the numbers of a part into its lines."""
    columns = {column.name: getattr(found, column.name, None) for column in fields(Line)}
    for place, index in enumerate(members):
        values: dict[str, Any] = {
            name: _known(name, column[place].item())
            for name, column in columns.items()
            if column is not None
        }
        note = found.notes[place] if found.notes else ""
        lines[index] = replace(lines[index], part=number, note=note, **values)


def _known(column: str, value: float) -> float | None:
    """None for a bound that is not a number and a withheld rank."""
    missing = value == 0 if column.startswith("rank") else math.isnan(value)
    return None if missing else value


def _rank_across(
    lines: list[Line],
    present: list[int],
    counting: Comparisons,
    diagnosis: Diagnosis,
    rules: Rules,
) -> None:
    """Ranks over all parts that met, and what the votes say of those who are alone in theirs."""
    levels = find_levels(counting, diagnosis.chains, rules.unit)
    counted = [lines[index] for index in present]
    bounds = np.array([(line.lower, line.upper) for line in counted], dtype=np.float64)
    bounds -= models.MEAN_ELO
    bounds[[line.part < 0 for line in counted]] = 0.0
    inner = np.array([line.rank or 0 for line in counted])
    ranks = ranks_across(diagnosis.chains, levels, inner, bounds[:, 0], bounds[:, 1]).tolist()
    least, most = outer_bounds(diagnosis.chains, levels)
    for place, (index, line) in enumerate(zip(present, counted, strict=True)):
        rank = ranks[place] or None
        note = remarks.note_with_rank(line.note, rank)
        moved = replace(line, rank=rank, rank_best=None, rank_worst=None, note=note)
        if line.rating is None and rules.method is Method.BRADLEY_TERRY:
            moved = replace(
                moved,
                lower=_known("lower", models.MEAN_ELO + least[place].item()),
                upper=_known("upper", models.MEAN_ELO + most[place].item()),
            )
        lines[index] = moved
