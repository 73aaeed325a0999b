"""Plans that are made while votes come in: who judges which unit.

Used for an expert whose remaining pairs are handed over, and for the adaptive part. Both are pure
functions of what is planned so far and of a generator.

Notation: P pairs, S scenarios.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.arrays import IntArray
from arena.pairing.order import MAIN
from arena.pairing.rules import Grid, PlannedMatchup

Unit = tuple[int, int]
"""A row and a column of the grid: a pair on a scenario."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """A unit that somebody is to judge, and how likely it was drawn."""

    pair: int
    scenario: int
    chance: float


def units_of(grid: Grid, showings: Sequence[PlannedMatchup]) -> list[Wanted]:
    """The units of the main showings."""
    pairs = {frozenset(pair): row for row, pair in enumerate(grid.pairs)}
    places = {scenario: column for column, scenario in enumerate(grid.scenarios)}
    return [
        Wanted(
            pair=pairs[frozenset((showing.left, showing.right))],
            scenario=places[showing.scenario],
            chance=showing.draw_probability,
        )
        for showing in showings
        if showing.kind == MAIN
    ]


def judges(grid: Grid, so_far: Mapping[str, Sequence[PlannedMatchup]]) -> IntArray:
    """How many experts are to judge each unit (P, S)."""
    counts = np.zeros(grid.showable.shape, dtype=np.int64)
    for showings in so_far.values():
        for unit in units_of(grid, showings):
            counts[unit.pair, unit.scenario] += 1
    return counts


def deal(
    grid: Grid,
    so_far: Mapping[str, Sequence[PlannedMatchup]],
    to: Sequence[str],
    units: Sequence[Wanted],
    rng: np.random.Generator,
) -> dict[str, list[Wanted]]:
    """Share units out equally among experts, none twice to one of them.

    Where everybody has judged a unit, its pair is judged on another scenario, one with few
    judges, so that every pair keeps its votes.

    Args:
        grid: What can be shown.
        so_far: Every expert's showings.
        to: Who takes the units.
        units: What is to be judged by others.
        rng: Says who takes what.

    Raises:
        NothingToPlan: A pair has no scenario left for any of them.
    """
    known = {name: {(u.pair, u.scenario) for u in units_of(grid, so_far[name])} for name in to}
    counts = judges(grid, so_far)
    dealt: dict[str, list[Wanted]] = {name: [] for name in to}
    for index in rng.permutation(len(units)):
        unit = units[index]
        order = sorted(to, key=lambda name: (len(dealt[name]), rng.random()))
        fits = [name for name in order if (unit.pair, unit.scenario) not in known[name]]
        taker, scenario = (
            (fits[0], unit.scenario) if fits else _elsewhere(grid, counts, known, order, unit, rng)
        )
        dealt[taker].append(Wanted(pair=unit.pair, scenario=scenario, chance=unit.chance))
        known[taker].add((unit.pair, scenario))
    return dealt


def _elsewhere(
    grid: Grid,
    counts: IntArray,
    known: Mapping[str, set[Unit]],
    order: Sequence[str],
    unit: Wanted,
    rng: np.random.Generator,
) -> tuple[str, int]:
    """Who judges the pair on which other scenario."""
    for name in order:
        free = [
            int(column)
            for column in rng.permutation(np.flatnonzero(grid.showable[unit.pair]))
            if (unit.pair, int(column)) not in known[name]
        ]
        if free:
            best = min(free, key=lambda column: counts[unit.pair, column])
            counts[unit.pair, best] += 1
            return name, best
    first, second = grid.pairs[unit.pair]
    raise NothingToPlan(
        f"Everybody who could take over has judged {first} against {second} on every "
        "scenario. Hand over to more experts."
    )
