"""The planner of matchups: a pure function of seed and rules.

A unit is a scenario with a pair of contestants. The plan is made in four steps:

1. every expert gets a quota of each scenario and of each pair; quotas differ by at most 1 within
   an expert and over all experts, as far as there are enough units (units.py),
2. units are chosen that meet both quotas; what the first choice misses is mended by exchanges,
3. each expert's units are put in an order that keeps a scenario away from itself (order.py),
4. sides are dealt so that each pair is shown either way round equally often, to +-1.

Notation: E experts, P pairs, S scenarios.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from arena.errors import NothingToPlan
from arena.pairing.order import deal_sides, put_in_order
from arena.pairing.units import choose_units, draw_probability

BoolArray = NDArray[np.bool_]

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
class Rules:
    """Everything that a plan depends on.

    Attributes:
        scenario_gap: Matchups wanted between two showings of a scenario to one expert.
    """

    entries: tuple[Entry, ...]
    experts: tuple[str, ...]
    votes_per_expert: int
    seed: int
    scenario_gap: int = DEFAULT_SCENARIO_GAP


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedMatchup:
    """One showing; `left` and `right` name contestants, `position` counts from 1 per expert."""

    expert: str
    position: int
    scenario: str
    left: str
    right: str
    draw_probability: float


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
class _Grid:
    """The units as an array: `showable` (P, S) says which pair can be shown on which scenario."""

    scenarios: tuple[str, ...]
    pairs: tuple[tuple[str, str], ...]
    showable: BoolArray
    identical: tuple[tuple[str, str, str], ...]


def plan(rules: Rules) -> Plan:
    """Plan who sees which pair on which scenario, in which order and on which side.

    No expert sees a unit twice. The same rules give the same plan.

    Raises:
        NothingToPlan: The rules can't be met; the text has the numbers.
    """
    grid = _grid(rules.entries)
    _check(rules, grid)
    rng = np.random.default_rng(rules.seed)
    chosen = choose_units(grid.showable, len(rules.experts), rules.votes_per_expert, rng)
    orders, gap = put_in_order(chosen, rules.scenario_gap, rng)
    flipped = deal_sides(orders, len(grid.pairs), rng)
    probability = draw_probability(grid.showable, rules.votes_per_expert)
    matchups = []
    for expert, order, flips in zip(rules.experts, orders, flipped, strict=True):
        for index, ((pair, scenario), flip) in enumerate(zip(order, flips, strict=True)):
            first, second = grid.pairs[pair]
            matchups.append(
                PlannedMatchup(
                    expert=expert,
                    position=index + 1,
                    scenario=grid.scenarios[scenario],
                    left=second if flip else first,
                    right=first if flip else second,
                    draw_probability=float(probability[pair, scenario]),
                )
            )
    return Plan(matchups=tuple(matchups), scenario_gap=gap, identical=grid.identical)


# --- What can be shown -------------------------------------------------------------------------


def _grid(entries: tuple[Entry, ...]) -> _Grid:
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
    return _Grid(scenarios=scenarios, pairs=pairs, showable=showable, identical=tuple(identical))


def _check(rules: Rules, grid: _Grid) -> None:
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
    units = int(grid.showable.sum())
    if units < rules.votes_per_expert:
        same = f" (and {len(grid.identical)} with identical pictures)" if grid.identical else ""
        raise NothingToPlan(
            f"Nobody sees the same pair of a scenario twice: {len(grid.scenarios)} scenarios have "
            f"{units} different pairs to show{same}, but each expert is to judge "
            f"{rules.votes_per_expert}."
        )
