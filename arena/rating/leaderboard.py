"""The rated table: which contestants, how strong, how sure, which rank. Read this file first.

In: `Comparisons` of named contestants, as arrays. Out: a `Leaderboard`: for each of them a `Line`
with rating, interval and rank, and what must be said with the numbers.

    votes = Comparisons(names=("a", "b"), first=first, second=second, score=score, ...)  # arrays
    board = rate(votes)  # the default: Bradley-Terry, two-way, bootstrap intervals
    board = rate(votes, unit=Unit.VOTE, rounds=PAPER_ROUNDS)  # the paper's mode
    board.lines[i].rating, .lower, .upper, .rank  # None where the votes do not determine them
    board.status, board.explanation, board.warnings  # always shown with the numbers
"""

from collections.abc import Collection
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np

from arena.rating import remarks
from arena.rating.chains import Chains, Status, chains_among, diagnose, judge_across, ranks_across
from arena.rating.comparisons import (
    Comparisons,
    IntArray,
    count_codes,
    count_pairs,
    restrict_to,
    tally,
)
from arena.rating.lines import Line
from arena.rating.parts import RatedGroup, rate_part
from arena.rating.ranking import FEWEST_TO_JUDGE, Separation, join_separations
from arena.rating.rules import (
    MOST_CONTESTANTS,
    Intervals,
    Method,
    Rules,
    TooManyContestants,
    Unit,
    choose_rules,
)

__all__ = ["Intervals", "Leaderboard", "Line", "Method", "Unit", "rate"]

PAPER_ROUNDS = 1000


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
        separation: All pairs judged at once, matrices (C, C); NaN for those without votes and for
            pairs of different parts, who are above each other where direct votes show it. None
            where single votes were resampled.
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

    @property
    def standings(self) -> tuple[Line, ...]:
        """The lines, best first."""
        return tuple(self.lines[index] for index in self.order)

    @property
    def judged(self) -> Separation | None:
        """All pairs judged at once, if the intervals know of all by which votes are clustered.

        Votes clustered unseen tell equals apart in every second study, and those of one
        expert, or on one scenario, say nothing of others.
        """
        several = _several(self.experts, self.scenarios)
        return self.separation if several and several == set(self.unit.kinds) else None

    @property
    def is_few(self) -> bool:
        """Return whether so few experts or scenarios judged that the sentence on pairs hedges."""
        return 1 < self.experts < FEWEST_TO_JUDGE or 1 < self.scenarios < FEWEST_TO_JUDGE

    @property
    def told_apart(self) -> Separation | None:
        """The pairs where "at 5 % for the whole table" holds: docs/rating.md."""
        return None if self.is_few else self.judged

    @property
    def explanation(self) -> str:
        """The reasons in one line, empty if nothing is missing."""
        return " ".join(self.reasons)


def rate(
    votes: Comparisons,
    *,
    method: Method = Method.BRADLEY_TERRY,
    rounds: int | None = None,
    unit: Unit | None = None,
    intervals: Intervals | None = None,
    seed: int = 0,
    founders: Collection[str] = (),
) -> Leaderboard:
    """Rate all contestants that have votes, with 95 % intervals on the Elo scale, mean 1000.

    Where not everybody can be rated together, those who can are rated among each other. Ranks
    then count those who only won against the rest as above it and those who only lost as below,
    as far as their number of votes shows it; groups that never met are ranked each by itself. The
    status and the explanation say so.

    Args:
        votes: What was voted; contestants without votes get a line without a rating.
        method: Bradley-Terry, Davidson's tie model, or online Elo.
        rounds: Of the bootstrap, and of what is drawn to see who is determined and how far apart
            equals come to lie; by default as many as the intervals need.
        unit: Clusters of votes: both ways by default, single votes for online Elo, which knows
            no other.
        intervals: By random effects of clusters by default, but resampled where the unit is
            single votes.
        seed: Of its draws; the same votes and seed give the same table.
        founders: Names of those around whose mean intervals are, but for resampled ones; by
            default all that nearly every resample determines. Ratings stay around everybody's
            mean.

    Raises:
        TooManyContestants: More than 2000.
        ValueError: Fewer than one round, or intervals that the unit or online Elo does not have.
    """
    if len(votes.names) > MOST_CONTESTANTS:
        raise TooManyContestants(
            f"at most {MOST_CONTESTANTS} contestants can be rated together, not {len(votes.names)}"
        )
    numbers = {"contestants": len(votes.names), "votes": votes.votes}
    rules = choose_rules(method, unit, intervals, rounds=rounds, seed=seed, **numbers)
    return _rate(votes, replace(rules, founders=frozenset(founders)))


def _rate(votes: Comparisons, rules: Rules) -> Leaderboard:
    counted = tally(votes)
    present = np.flatnonzero(counted.sum(axis=1))
    counting = restrict_to(votes, present.tolist())
    # Online Elo's steps of at most K points stay finite whoever wins.
    is_bounded = rules.method is Method.ELO
    chains = chains_among(len(present), count_pairs(counting), together=is_bounded)
    status, reasons = diagnose(votes.shown, counting, chains)
    above = chains.above()
    parts = sorted(
        (members for members in chains.parts if len(members) > 1),
        # Group by group, within a group from the top down.
        key=lambda members: (chains.group_of[members[0]], above[members[0]], members[0]),
    )
    if len(parts) > 1:  # whose scales have nothing in common
        rules = replace(rules, founders=frozenset())
    rated = [rate_part(restrict_to(counting, part.tolist()), rules) for part in parts]
    lines = _blank_lines(votes.names, counted.tolist())
    across = np.zeros((len(lines), len(lines)), dtype=np.bool_)
    for number, (part, group) in enumerate(zip(parts, rated, strict=True)):
        fill_lines(lines, present[part], number, group)
    if chains.reaches.any():
        _rank_across(lines, present, counting, chains, rules)
        if rules.intervals is not Intervals.RESAMPLES:
            # (C, C) over all lines, from those who have votes.
            across[np.ix_(present, present)] = judge_across(counting, chains, rules.unit)
    order = _standing_order(chains, [lines[index] for index in present])
    absent = sorted(set(range(len(lines))) - set(present.tolist()))
    numbers = count_codes(votes.expert), count_codes(votes.scenario)
    if _several(*numbers) != set(rules.unit.kinds):  # places left hold for a whole table
        lines = [replace(line, rank_best=None, rank_worst=None) for line in lines]
    whole = rated[0] if len(rated) == 1 and len(parts[0]) == len(present) else None
    return Leaderboard(
        lines=tuple(lines),
        order=(*present[order].tolist(), *absent),
        status=_refine(status, rated),
        reasons=_unique(reasons, *(group.explanation for group in rated)),
        warnings=_unique(*(group.warnings for group in rated)),
        method=rules.method,
        unit=rules.unit,
        intervals=rules.intervals,
        rounds=rules.rounds,
        seed=rules.seed,
        votes=votes.votes,
        experts=numbers[0],
        scenarios=numbers[1],
        tie_share=float(counted[:, 1].sum() / counted.sum()) if len(votes) else None,
        tie_strength=whole.tie_strength if whole else None,
        degenerate_rounds=max((group.degenerate for group in rated), default=0),
        separation=join_separations(
            [
                group.separation.among(present[part], len(lines))
                for part, group in zip(parts, rated, strict=True)
                if group.separation
            ],
            across,
        ),
    )


def _several(experts: int, scenarios: int) -> set[str]:
    """Return the kinds of clusters of which there are at least two."""
    return {kind for kind, number in (("expert", experts), ("scenario", scenarios)) if number > 1}


def _unique(*sentences: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(sentence for some in sentences for sentence in some))


def _refine(status: Status, rated: list[RatedGroup]) -> Status:
    """Return the status by what came out where all could be rated together."""
    if status is not Status.RATED:
        return status
    if any(group.rating is None for group in rated):
        return Status.UNBOUNDED
    if any(group.lower is None for group in rated):
        return Status.NO_INTERVALS
    return Status.OPEN_INTERVALS if any(map(any, (x.note for x in rated))) else Status.RATED


# --- Lines, filled part by part ------------------------------------------------------------------


def _blank_lines(names: tuple[str, ...], counted: list[list[int]]) -> list[Line]:
    """The lines without ratings."""
    return [
        Line(
            name=name,
            votes=wins + ties + losses,
            wins=wins,
            ties=ties,
            losses=losses,
            part=-1,
            note="" if wins + ties + losses else "no votes",
        )
        for name, (wins, ties, losses) in zip(names, counted, strict=True)
    ]


def fill_lines(lines: list[Line], members: IntArray, number: int, group: RatedGroup) -> None:
    """Put what a part has under the names of a line's fields into its lines."""
    columns = {
        column.name: np.asarray(values).tolist()
        for column in fields(lines[members[0]])
        if (values := getattr(group, column.name, None)) is not None
    }
    for place, index in enumerate(members):
        values = {name: column[place] for name, column in columns.items()}
        for name, value in values.items():  # NaN is no bound, 0 no rank
            if value != value or (name.startswith("rank") and not value):
                values[name] = None
        lines[index] = replace(lines[index], part=number, **values)


def _rank_across(
    lines: list[Line], present: IntArray, counting: Comparisons, chains: Chains, rules: Rules
) -> None:
    """Put ranks over all parts that met into the lines, and why some are missing."""
    inner = np.array([lines[index].rank or 0 for index in present])
    ranks = ranks_across(counting, chains, rules.unit, inner).tolist()
    has_higher = chains.above() > 0
    has_lower = np.isin(chains.part_of, np.flatnonzero(chains.reaches.sum(axis=1)))
    for place, (index, rank) in enumerate(zip(present, ranks, strict=True)):
        line = lines[index]
        note = line.note
        if line.part < 0:
            note = remarks.note_on_limits(has_higher=has_higher[place], has_lower=has_lower[place])
        if not rank and "no rank" not in note:
            note = f"{note}; {remarks.NO_RANK}" if note else remarks.NO_RANK
        lines[index] = replace(line, rank=rank or None, rank_best=None, rank_worst=None, note=note)


def _standing_order(chains: Chains, lines: list[Line]) -> list[int]:
    """Return the contestants, best first, group by group.

    Whoever scored stands above those who never scored back, and within a part the rating decides.
    Who has neither rating nor rank comes last.
    """
    above = chains.above()

    def place(number: int) -> tuple[Any, ...]:
        line = lines[number]
        is_nowhere = line.rating is None and line.rank is None
        rating = -(line.rating or 0.0)
        group, part = chains.group_of[number], chains.part_of[number]
        return group, is_nowhere, above[number], part, rating, line.name

    return sorted(range(len(lines)), key=place)
