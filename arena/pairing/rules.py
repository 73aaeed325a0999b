"""Plain values that a plan is made from and made of."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from random import Random

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.order import MAIN, BoolArray, IntArray

DEFAULT_SCENARIO_GAP = 5
"""How many other matchups an expert judges before a scenario comes again."""


_SAMPLE = "#"
"""Between a scenario and the number of a sample; no slug has one."""


def sample_place(scenario: str, sample: int) -> str:
    """The name of one sample of a scenario, where each is judged on its own."""
    return f"{scenario}{_SAMPLE}{sample}"


def scenario_at(place: str) -> str:
    """The scenario of a place: itself, or what its sample is one of."""
    return place.partition(_SAMPLE)[0]


def sample_at(place: str) -> int:
    """The sample of a place, 0 where its scenario is judged as a whole."""
    return int(place.partition(_SAMPLE)[2] or 0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """Contestant's picture of a scenario, which can be shown.

    Attributes:
        scenario: Or one sample of it, by `sample_place`.
        sample: Which of the contestant's answers it is.
        picture: Names the picture's content; two entries with the same picture look the same, so
            they are never shown against each other.
    """

    scenario: str
    contestant: str
    picture: str
    sample: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """An attention check: a good picture of a scenario against an obviously broken one."""

    scenario: str
    good: str
    broken: str


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanRules:
    """Everything that a plan depends on.

    Attributes:
        votes_per_expert: The quota; repeats and checks come on top of it.
        scenario_gap: Matchups wanted between two showings of a scenario to one expert.
        repeat_share: Hidden repeats as a share of the quota.
        repeat_distance: Matchups wanted between a pair and its repeat.
        overlap_share: Of the judged units, those that two experts or more judge at least.
        check_share: Attention checks as a share of the quota, as far as there are `checks`.
        checks: What can be checked with.
        alike: (scenario, contestant, contestant) that nobody can tell apart, whose pictures
            differ all the same; settled as a tie like identical ones.
        challengers: Contestants of whom every pair has one; empty for all pairs.
    """

    entries: tuple[Entry, ...]
    experts: tuple[str, ...]
    votes_per_expert: int
    seed: int
    scenario_gap: int = DEFAULT_SCENARIO_GAP
    repeat_share: float = 0.0
    repeat_distance: int = 30
    overlap_share: float = 0.0
    check_share: float = 0.0
    checks: tuple[Check, ...] = ()
    alike: tuple[tuple[str, str, str], ...] = ()
    challengers: tuple[str, ...] = ()

    @property
    def grid(self) -> Grid:
        """Pairs of entries that can be shown."""
        return make_grid(self.entries, self.alike, self.challengers)

    def count_extras(self, votes: int) -> tuple[int, int]:
        """Return how many repeats and checks come on top of that many votes of one expert."""
        checks = min(round(self.check_share * votes), len(self.checks))
        return round(self.repeat_share * votes), checks


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
    kind: str = MAIN
    repeats: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class MatchupPlan:
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

    @property
    def row_of_pair(self) -> dict[frozenset[str], int]:
        """The row of each pair, either way round."""
        return {frozenset(pair): row for row, pair in enumerate(self.pairs)}

    @property
    def column_of_scenario(self) -> dict[str, int]:
        """The column of each scenario."""
        return {scenario: column for column, scenario in enumerate(self.scenarios)}

    @property
    def bases(self) -> IntArray:
        """(S,) which columns are samples of one scenario: those with the same number."""
        names = [scenario_at(place) for place in self.scenarios]
        numbers = {name: number for number, name in enumerate(dict.fromkeys(names))}
        return np.array([numbers[name] for name in names], dtype=np.int64)


def make_grid(
    entries: tuple[Entry, ...],
    alike: tuple[tuple[str, str, str], ...] = (),
    challengers: Sequence[str] = (),
) -> Grid:
    """The units that can be shown, and the identical and alike pairs that can't.

    Pairs without a challenger are neither, where there are challengers.
    """
    settled = {(scenario, *sorted((first, other))) for scenario, first, other in alike}
    pictures = {(entry.scenario, entry.contestant): entry.picture for entry in entries}
    scenarios = tuple(sorted({entry.scenario for entry in entries}))
    contestants = sorted({entry.contestant for entry in entries})
    pairs = tuple(
        pair
        for pair in combinations(contestants, 2)
        if not challengers or not set(challengers).isdisjoint(pair)
    )
    showable = np.zeros((len(pairs), len(scenarios)), dtype=bool)
    identical = []
    for row, (first, second) in enumerate(pairs):
        for column, scenario in enumerate(scenarios):
            a, b = pictures.get((scenario, first)), pictures.get((scenario, second))
            if a is None or b is None:
                continue
            if a == b or (scenario, first, second) in settled:
                identical.append((scenario, first, second))
            else:
                showable[row, column] = True
    return Grid(scenarios=scenarios, pairs=pairs, showable=showable, identical=tuple(identical))


Triple = tuple[str, str, str]
"""Scenario (or sample of one) and two contestants."""

SHOWN_SHARE = 0.1
"""Of the pairs alike within the tolerance: whether experts take these for equal is seen there."""


def draw_shown(alike: Sequence[Triple], entries: Sequence[Entry], *, seed: int) -> list[Triple]:
    """Return the pairs to show, a tenth of those whose pictures differ at all, sorted."""
    pictures = {(entry.scenario, entry.contestant): entry.picture for entry in entries}
    differing = sorted(
        (place, first, other)
        for place, first, other in alike
        if pictures[place, first] != pictures[place, other]
    )
    number = round(SHOWN_SHARE * len(differing))
    return sorted(Random(f"shown {seed}").sample(differing, number))


def draw_ties(
    settled: Sequence[Triple], votes_by_judge: Mapping[str, int], *, showable: int, seed: int
) -> list[tuple[Triple, str]]:
    """Return who gives a tie on which settled pair.

    Args:
        settled: Pairs that nobody was shown.
        votes_by_judge: Decided votes on shown pairs.
        showable: How many pairs could be shown.
        seed: Of the lots that round the average and choose the judges.
    """
    average = sum(votes_by_judge.values()) / showable if showable else 0.0
    drawn = []
    for triple in settled:
        # By the pair itself: what is drawn for one depends on no other.
        dice = Random(f"ties {seed} {triple}")
        number = math.floor(average) + (dice.random() < average % 1.0)
        # Each judge's place in line: without replacement, in proportion to the votes.
        turn = {judge: dice.random() ** (1.0 / n) for judge, n in sorted(votes_by_judge.items())}
        chosen = sorted(turn, key=lambda judge: -turn[judge])[:number]
        drawn += [(triple, judge) for judge in sorted(chosen)]
    return drawn


MOST_OVERLAP = 0.8
"""More can't be brought together where all pairs and scenarios stay balanced for everybody."""

# Shares of an expert's quota.
MOST_CHECKS = 0.5
MOST_REPEATS = 0.5
ATTENTION_CHECKS = "attention checks"


def check_rules(rules: PlanRules, grid: Grid) -> None:
    """Refuse rules that no plan can meet.

    Raises:
        NothingToPlan: The text has the numbers.
    """
    check_share("repeats", rules.repeat_share, MOST_REPEATS)
    check_share("what two experts judge", rules.overlap_share, MOST_OVERLAP)
    check_share(ATTENTION_CHECKS, rules.check_share, MOST_CHECKS)
    contestants = len({entry.contestant for entry in rules.entries})
    checked = [check.scenario for check in rules.checks]
    votes, units, same = rules.votes_per_expert, int(grid.showable.sum()), len(grid.identical)
    refusals = {
        f"The seed must be 0 or more, not {rules.seed}.": rules.seed < 0,
        f"Votes per expert must be 1 or more, not {votes}.": votes < 1,
        "There is nobody to vote: name at least one expert.": not rules.experts,
        "An expert is named twice.": len(set(rules.experts)) < len(rules.experts),
        f"A comparison needs two contestants with pictures, not {contestants}.": not grid.pairs,
        "For pairs that two experts judge there must be two.": rules.overlap_share > 0
        and len(rules.experts) < 2,
        "Each check is on a scenario of its own out of those of the study.": len(set(checked))
        < len(checked)
        or not set(checked) <= set(grid.scenarios),
        f"Nobody sees the same pair of a scenario twice: {len(grid.scenarios)} scenarios have "
        f"{units} different pairs to show (and {same} with identical pictures), but each expert "
        f"is to judge {votes}.": units < votes,
    }
    for sentence, is_refused in refusals.items():
        if is_refused:
            raise NothingToPlan(sentence)


def check_share(part: str, share: float, most: float) -> None:
    """Refuse a share that is not from 0 to the most that there can be.

    Raises:
        NothingToPlan: It is none.
    """
    if not 0 <= share <= most:
        raise NothingToPlan(f"The share of {part} goes from 0 to {most:.0%}, not {share:.1%}.")
