"""What a plan is made from, and what it is made of: plain values."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.arrays import BoolArray, IntArray
from arena.pairing.order import MAIN
from arena.pairing.targets import votes_by_appearances

DEFAULT_SCENARIO_GAP = 5
"""How many other matchups an expert judges before a scenario comes again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """What can be shown: a contestant's picture of a scenario.

    Attributes:
        picture: Names the picture's content; two entries with the same picture look the same, so
            they are never shown against each other.
    """

    scenario: str
    contestant: str
    picture: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """An attention check: a good picture of a scenario against an obviously broken one."""

    scenario: str
    good: str
    broken: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """Everything that a plan depends on.

    Attributes:
        votes_per_expert: The quota; repeats and checks come on top of it.
        scenario_gap: Matchups wanted between two showings of a scenario to one expert.
        appearances: (contestant, n): in how many votes each contestant is to appear over all
            experts. Empty for a balanced plan.
        pair_votes: (contestant, contestant, n): how many votes each pair gets over all experts.
            Empty for a balanced plan; not beside `appearances`.
        repeat_share: Hidden repeats as a share of the quota.
        repeat_distance: Matchups wanted between a pair and its repeat.
        check_share: Attention checks as a share of the quota, as far as there are `checks`.
        checks: What can be checked with.
        adaptive_share: The last share of the quota, which is planned in batches by the votes.
        uniform_share: The share of the adaptive draws that is uniform over the pairs.
        batch_size: Votes of one expert that are planned at once in the adaptive part.
    """

    entries: tuple[Entry, ...]
    experts: tuple[str, ...]
    votes_per_expert: int
    seed: int
    scenario_gap: int = DEFAULT_SCENARIO_GAP
    appearances: tuple[tuple[str, int], ...] = ()
    pair_votes: tuple[tuple[str, str, int], ...] = ()
    repeat_share: float = 0.0
    repeat_distance: int = 30
    check_share: float = 0.0
    checks: tuple[Check, ...] = ()
    adaptive_share: float = 0.0
    uniform_share: float = 0.2
    batch_size: int = 20

    @property
    def votes_later(self) -> int:
        """Votes of each expert that the adaptive part plans."""
        return round(self.adaptive_share * self.votes_per_expert)

    @property
    def votes_at_once(self) -> int:
        """Votes of each expert that are planned before the first vote."""
        return self.votes_per_expert - self.votes_later


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedMatchup:
    """One showing; `left` and `right` name contestants, `position` counts from 1 per expert.

    Attributes:
        kind: "main", "repeat" or "check".
        repeats: The position of the same expert's matchup that a repeat shows again.
    """

    expert: str
    position: int
    scenario: str
    left: str
    right: str
    draw_probability: float
    kind: str = MAIN
    repeats: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """All showings, by expert and position.

    Attributes:
        scenario_gap: The gap that holds for every expert; less than the rules asked for where the
            scenarios do not suffice.
        identical: (scenario, contestant, contestant) with the same picture, never shown.
    """

    matchups: tuple[PlannedMatchup, ...]
    scenario_gap: int
    identical: tuple[tuple[str, str, str], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """The units as an array: `showable` (P, S) says which pair can be shown on which scenario."""

    scenarios: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    showable: BoolArray
    identical: tuple[tuple[str, str, str], ...]


def grid_of(entries: tuple[Entry, ...]) -> Grid:
    """The units that can be shown, and the identical pairs that can't."""
    pictures = {(entry.scenario, entry.contestant): entry.picture for entry in entries}
    scenarios = tuple(sorted({entry.scenario for entry in entries}))
    contestants = sorted({entry.contestant for entry in entries})
    pairs = tuple(combinations(contestants, 2))
    showable = np.zeros((len(pairs), len(scenarios)), dtype=bool)
    identical = []
    for row, (first, second) in enumerate(pairs):
        for column, scenario in enumerate(scenarios):
            a, b = pictures.get((scenario, first)), pictures.get((scenario, second))
            if a is None or b is None:
                continue
            if a == b:
                identical.append((scenario, first, second))
            else:
                showable[row, column] = True
    return Grid(scenarios=scenarios, pairs=pairs, showable=showable, identical=tuple(identical))


def check_rules(rules: Rules, grid: Grid) -> None:
    """Whether the rules make sense.

    Raises:
        NothingToPlan: They do not; the text has the numbers.
    """
    if rules.seed < 0:
        raise NothingToPlan(f"The seed must be 0 or more, not {rules.seed}.")
    if rules.votes_per_expert < 1:
        raise NothingToPlan(f"Votes per expert must be 1 or more, not {rules.votes_per_expert}.")
    if not rules.experts:
        raise NothingToPlan("There is nobody to vote: name at least one expert.")
    if len(set(rules.experts)) < len(rules.experts):
        raise NothingToPlan("An expert is named twice.")
    if not grid.pairs:
        contestants = len({entry.contestant for entry in rules.entries})
        raise NothingToPlan(
            f"A comparison needs two contestants with pictures, not {contestants}."
        )
    _check_extras(rules, grid)
    units = int(grid.showable.sum())
    if units < rules.votes_per_expert:
        same = f" (and {len(grid.identical)} with identical pictures)" if grid.identical else ""
        raise NothingToPlan(
            f"Nobody sees the same pair of a scenario twice: {len(grid.scenarios)} scenarios have "
            f"{units} different pairs to show{same}, but each expert is to judge "
            f"{rules.votes_per_expert}."
        )


def pair_totals(rules: Rules, grid: Grid) -> IntArray:
    """Votes of every pair (P,) over all experts, where the rules say how often.

    Raises:
        NothingToPlan: The wanted numbers can't be met; the text has them.
    """
    experts, votes = len(rules.experts), len(rules.experts) * rules.votes_per_expert
    capacity = experts * grid.showable.sum(axis=1)
    totals = (
        _by_pair(rules, grid, votes)
        if rules.pair_votes
        else _by_contestant(rules, grid, votes, capacity)
    )
    for pair, wanted, most in zip(grid.pairs, totals, capacity, strict=True):
        if wanted > most:
            raise NothingToPlan(
                f"{pair[0]} against {pair[1]} is to get {wanted} votes, but {experts} experts on "
                f"{most // experts} scenarios can give {most}."
            )
    return totals


# --- Private -----------------------------------------------------------------------------------


def _check_extras(rules: Rules, grid: Grid) -> None:
    shares = {
        "repeats": (rules.repeat_share, 0.5),
        "attention checks": (rules.check_share, 0.5),
        "the adaptive part": (rules.adaptive_share, 0.9),
    }
    for name, (share, most) in shares.items():
        if not 0 <= share <= most:
            raise NothingToPlan(f"The share of {name} goes from 0 to {most:.0%}, not {share:.1%}.")
    if not 0.2 <= rules.uniform_share <= 1:
        raise NothingToPlan(
            "At least 20 % of the adaptive draws are uniform, else no vote could be weighted; "
            f"not {rules.uniform_share:.0%}."
        )
    if rules.appearances and rules.pair_votes:
        raise NothingToPlan("Targets are given by contestant or by pair, not both.")
    if rules.adaptive_share and (rules.appearances or rules.pair_votes):
        raise NothingToPlan("Targets fix every vote, so none are left for an adaptive part.")
    places = [given.scenario for given in rules.checks]
    if set(places) - set(grid.scenarios) or len(set(places)) < len(places):
        raise NothingToPlan("Each check is on a scenario of its own out of those of the study.")


def _by_pair(rules: Rules, grid: Grid, votes: int) -> IntArray:
    totals = np.zeros(len(grid.pairs), dtype=np.int64)
    places = {pair: row for row, pair in enumerate(grid.pairs)}
    for first, second, wanted in rules.pair_votes:
        row = places.get((first, second), places.get((second, first)))
        if row is None:
            raise NothingToPlan(f"{first} against {second} is no pair of this study.")
        totals[row] += wanted
    _check_sum(int(totals.sum()), votes, "votes")
    return totals


def _by_contestant(rules: Rules, grid: Grid, votes: int, capacity: IntArray) -> IntArray:
    names = sorted({name for pair in grid.pairs for name in pair})
    wanted = dict(rules.appearances)
    if set(wanted) != set(names) or len(wanted) < len(rules.appearances):
        odd = ", ".join(sorted(set(wanted) ^ set(names))) or "one is named twice"
        raise NothingToPlan(f"Each contestant of the study needs one target: {odd}.")
    _check_sum(sum(wanted.values()), 2 * votes, "appearances")
    most = np.zeros((len(names), len(names)), dtype=np.int64)
    rows, columns = np.triu_indices(len(names), 1)  # in the order of the pairs
    most[rows, columns] = most[columns, rows] = capacity
    sums = np.array([wanted[name] for name in names], dtype=np.int64)
    found: IntArray = votes_by_appearances(names, sums, most)[rows, columns]
    return found


def _check_sum(given: int, needed: int, what: str) -> None:
    if given != needed:
        raise NothingToPlan(
            f"The targets add up to {given:,} {what}, but the experts' quotas to {needed:,}."
        )
