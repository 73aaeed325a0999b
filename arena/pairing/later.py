"""Plans that are made while votes come in: who judges which unit, and in which order.

For an expert whose remaining pairs are handed over, and for somebody who joins. Both are pure
functions of what is planned so far and of a generator.

Notation: P pairs, S scenarios.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from arena.errors import NothingToPlan
from arena.pairing.order import CHECK, MAIN, REPEAT, IntArray, Slot
from arena.pairing.plan import lay_out
from arena.pairing.rules import Grid, PlannedMatchup, PlanRules


class GridUnit(NamedTuple):
    """A row and a column of the grid: a pair on a scenario."""

    pair: int
    scenario: int


def main_units(grid: Grid, showings: Sequence[PlannedMatchup]) -> list[GridUnit]:
    """Return the units of the main showings."""
    rows, columns = grid.row_of_pair, grid.column_of_scenario
    return [
        GridUnit(rows[frozenset((showing.left, showing.right))], columns[showing.scenario])
        for showing in showings
        if showing.kind == MAIN
    ]


def judges(grid: Grid, so_far: Mapping[str, Sequence[PlannedMatchup]]) -> IntArray:
    """Return how many experts are to judge each unit (P, S)."""
    counts = np.zeros(grid.showable.shape, dtype=np.int64)
    for showings in so_far.values():
        for unit in main_units(grid, showings):
            counts[unit] += 1
    return counts


def deal(
    grid: Grid,
    so_far: Mapping[str, Sequence[PlannedMatchup]],
    to: Sequence[str],
    units: Sequence[GridUnit],
    rng: np.random.Generator,
) -> dict[str, list[GridUnit]]:
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
    columns_of = {name: set(main_units(grid, so_far[name])) for name in to}
    counts = judges(grid, so_far)
    dealt: dict[str, list[GridUnit]] = {name: [] for name in to}
    for index in rng.permutation(len(units)):
        wanted = units[index]
        # Who has least so far first, by lot among equals.
        order = sorted(to, key=lambda name: (len(dealt[name]), rng.random()))
        fits = [name for name in order if wanted not in columns_of[name]]
        taker, scenario = (
            (fits[0], wanted.scenario)
            if fits
            else _find_elsewhere(grid, counts, columns_of, order, wanted, rng)
        )
        dealt[taker].append(GridUnit(wanted.pair, scenario))
        columns_of[taker].add(dealt[taker][-1])
    return dealt


def _find_elsewhere(
    grid: Grid,
    counts: IntArray,
    columns_of: Mapping[str, set[GridUnit]],
    order: Sequence[str],
    wanted: GridUnit,
    rng: np.random.Generator,
) -> tuple[str, int]:
    """Return who judges the pair on which other scenario."""
    for name in order:
        columns = rng.permutation(np.flatnonzero(grid.showable[wanted.pair])).tolist()
        free = [column for column in columns if (wanted.pair, column) not in columns_of[name]]
        if free:
            best = min(free, key=lambda column: counts[wanted.pair, column])
            counts[wanted.pair, best] += 1
            return name, best
    first, second = grid.pairs[wanted.pair]
    raise NothingToPlan(
        f"Everybody who could take over has judged {first} against {second} on every "
        "scenario. Hand over to more experts."
    )


# --- Units one after the other -------------------------------------------------------------------


def choose_for_newcomer(
    grid: Grid, judges: IntArray, count: int, rng: np.random.Generator
) -> list[GridUnit]:
    """Choose units for somebody who joins, so that pairs and scenarios stay as equal as they can.

    One after the other: of the pairs that come least in this choice one of those that are planned
    least so far; then of its scenarios those with the fewest judges of the pair, of these one
    that comes least in this choice, then one that is planned least over all pairs.

    Args:
        grid: What can be shown.
        judges: (P, S) how many experts have each unit.
        count: How many; fewer where there are not so many units.
        rng: The lots.
    """
    free, counts = grid.showable.copy(), judges.copy()
    # (P,) votes planned of each pair before this choice.
    before = counts.sum(axis=1)
    # (S,) how often each scenario comes in this choice.
    used = np.zeros(free.shape[1], dtype=np.int64)
    chosen: list[GridUnit] = []
    while len(chosen) < count and free.any():
        pairs, planned = np.flatnonzero(free.any(axis=1)), counts.sum(axis=1)
        # First what comes least in this choice: every newcomer sees all pairs equally often.
        pairs = pairs[_least((planned - before)[pairs], planned[pairs])]
        pair = int(rng.choice(pairs))
        open_ = np.flatnonzero(free[pair])
        fewest = open_[_least(counts[pair, open_], used[open_], counts[:, open_].sum(axis=0))]
        scenario = int(rng.choice(fewest))
        chosen.append(GridUnit(pair, scenario))
        free[pair, scenario] = False
        counts[pair, scenario] += 1
        used[scenario] += 1
    return chosen


def _least(*keys: IntArray) -> IntArray:
    """Return where the first key is least, among those where the second is, and so on."""
    left = np.arange(len(keys[0]))
    for key in keys:
        left = left[key[left] == key[left].min()]
    return left


# --- What follows on an expert's order so far ----------------------------------------------------


def follow_on(
    rules: PlanRules,
    grid: Grid,
    expert: str,
    so_far: Sequence[PlannedMatchup],
    units: Sequence[GridUnit],
    rng: np.random.Generator,
) -> list[PlannedMatchup]:
    """Put one expert's next units in an order, with sides, and with repeats and checks on top.

    Args:
        rules: Of the study.
        grid: What can be shown.
        expert: Whose order goes on.
        so_far: The expert's showings, by position.
        units: What comes now; none of it is known to the expert.
        rng: Shuffles.
    """
    sequel = _Sequel(rules, grid, so_far, rng)
    items = [Slot(kind=MAIN, scenario=unit.scenario, pair=unit.pair) for unit in units]
    items += [*sequel.draw_repeats(units), *sequel.draw_checks(len(units))]
    order = sequel.find_order(items)
    start = so_far[-1].position + 1 if so_far else 1
    position_of = {index: position for position, index in enumerate(order, start=start)}
    slots = [
        item if item.of is None else replace(item, again=position_of[item.of])
        for item in (items[index] for index in order)
    ]
    flips = sequel.turn_mains(slots)
    return lay_out(rules, grid, expert, slots, flips, so_far, rng)


@dataclass(frozen=True, slots=True)
class _Sequel:
    """What an expert's next showings depend on beside their units."""

    rules: PlanRules
    grid: Grid
    so_far: Sequence[PlannedMatchup]
    rng: np.random.Generator

    def draw_repeats(self, units: Sequence[GridUnit]) -> list[Slot]:
        """Draw hidden repeats: of what was shown long enough ago, else of what comes now."""
        rules, so_far = self.rules, self.so_far
        done = {showing.repeats for showing in so_far if showing.kind == REPEAT}
        mains = [showing for showing in so_far if showing.kind == MAIN]
        # The share is of all the expert's main showings, so what was repeated is taken off.
        count = min(round(rules.repeat_share * (len(mains) + len(units))) - len(done), len(units))
        if count < 1:
            return []
        latest = (so_far[-1].position + 1 if so_far else 1) - rules.repeat_distance
        old = [s for s in mains if s.position <= latest and s.position not in done]
        offered = [
            Slot(kind=REPEAT, scenario=wanted.scenario, pair=wanted.pair, again=showing.position)
            for showing, wanted in zip(old, main_units(self.grid, old), strict=True)
        ]
        if len(offered) < count:
            offered = [
                Slot(kind=REPEAT, scenario=wanted.scenario, pair=wanted.pair, of=index)
                for index, wanted in enumerate(units)
            ]
        return [offered[index] for index in self.rng.permutation(len(offered))[:count]]

    def draw_checks(self, more: int) -> list[Slot]:
        """Draw attention checks that the expert has not seen, for so many more main showings."""
        shown = {showing.scenario for showing in self.so_far if showing.kind == CHECK}
        mains = sum(showing.kind == MAIN for showing in self.so_far) + more
        unused = [check.scenario for check in self.rules.checks if check.scenario not in shown]
        count = min(max(round(self.rules.check_share * mains) - len(shown), 0), len(unused))
        columns = self.grid.column_of_scenario
        drawn = [columns[unused[index]] for index in self.rng.permutation(len(unused))[:count]]
        return [Slot(kind=CHECK, scenario=n, pair=-1) for n in drawn]

    def find_order(self, items: Sequence[Slot]) -> list[int]:
        """Order the items with the largest gap that can be kept, also to what was shown before."""
        bases, most = [int(base) for base in self.grid.bases], self.rules.scenario_gap
        before = [showing.scenario for showing in self.so_far][-most:]
        last = [bases[self.grid.column_of_scenario[name]] for name in before]
        # Greedy orders depend on their lots: five of each gap, then a smaller one.
        for gap in range(most, -1, -1):
            for _ in range(5):
                shown = last[len(last) - min(gap, len(last)) :]
                order = _try_order(items, shown, gap, self.rng, bases)
                if order is not None:
                    return order
        raise AssertionError("without a gap any order will do")

    def turn_mains(self, slots: Sequence[Slot]) -> list[bool]:
        """Say which main showings to turn around: what was more often on the left goes right."""
        lead: Counter[frozenset[str]] = Counter()
        for showing in self.so_far:
            if showing.kind == MAIN:
                pair = frozenset((showing.left, showing.right))
                lead[pair] += 1 if showing.left < showing.right else -1
        flips = []
        for slot in slots:
            if slot.kind == MAIN:
                pair = frozenset(self.grid.pairs[slot.pair])
                flip = lead[pair] > 0 or (lead[pair] == 0 and bool(self.rng.random() < 0.5))
                lead[pair] += -1 if flip else 1
                flips.append(flip)
        return flips


def _try_order(
    items: Sequence[Slot],
    last: list[int],
    gap: int,
    rng: np.random.Generator,
    bases: Sequence[int],
) -> list[int] | None:
    """The fullest allowed scenario first; a repeat only after what it shows. None if it sticks."""
    waiting: dict[int, list[int]] = {}
    for index in rng.permutation(len(items)).tolist():
        waiting.setdefault(items[index].scenario, []).append(index)
    for queue in waiting.values():  # taken from the end: what is repeated comes before its repeat
        queue.sort(key=lambda index: items[index].of is None)
    recent, order = list(last), list[int]()
    for _ in items:
        barred = set(recent[-gap:]) if gap else set()
        open_ = [place for place in waiting if waiting[place] and bases[place] not in barred]
        if not open_:
            return None
        # The fullest first, or its showings would be left over side by side at the end.
        place = max(open_, key=lambda place: len(waiting[place]) + rng.random())
        order.append(waiting[place].pop())
        recent.append(bases[place])
    return order
