"""In which order an expert sees the chosen units, and which side each picture is on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

BoolArray = NDArray[np.bool_]
FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

MAIN, REPEAT, CHECK = "main", "repeat", "check"
"""What a showing is for; the words of the stored rows."""

TRIES = 20
"""So many orders are tried until every repeat is far enough from what it shows again."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """One place in an expert's order.

    Attributes:
        kind: "main", "repeat" or "check".
        pair: The row of the pair, -1 for a check.
        of: For a repeat, the index of the slot that it shows again.
        again: The same as a position in the expert's order, once it is known.
    """

    kind: str
    pair: int
    scenario: int
    of: int | None = None
    again: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Extras:
    """Showings of an expert on top of the units of the plan.

    Attributes:
        repeated: Units (pair, scenario) that come a second time.
        checks: Scenarios of attention checks.
    """

    repeated: tuple[tuple[int, int], ...] = ()
    checks: tuple[int, ...] = ()


def order_units(
    chosen: BoolArray,
    extras: Sequence[Extras],
    gap: int,
    distance: int,
    rng: np.random.Generator,
    bases: IntArray,
) -> tuple[list[list[Slot]], int]:
    """Each expert's units and extras in order, and the gap that all orders keep.

    Args:
        chosen: (E, P, S) the units.
        extras: For every expert, what comes on top.
        gap: Others wanted between two showings of a scenario.
        distance: Places wanted between a unit and its repeat.
        rng: Shuffles.
        bases: (S,) columns with the same number are samples of one scenario, which are kept apart
            like one column.
    """
    # (E, S) showings of each scenario, units first, then repeats and checks.
    counts = chosen.sum(axis=1)
    for row, more in zip(counts, extras, strict=True):
        for scenario in [scenario for _, scenario in more.repeated] + list(more.checks):
            row[scenario] += 1
    # One gap for all experts: what the plan promises holds for each of them.
    best_gap = min(largest_gap(_sum_samples(row, bases), gap) for row in counts)
    orders = []
    for mine, more, row in zip(chosen, extras, counts, strict=True):
        waiting = [rng.permutation(np.flatnonzero(column)).tolist() for column in mine.T]
        for pair, scenario in more.repeated:
            # Repeats and what they show get places of their own, before the others are filled in.
            waiting[scenario].remove(pair)
        best: list[Slot] = []
        nearest = -1
        # Where a repeat comes too early, other orders are tried and the best kept.
        for _ in range(TRIES if more.repeated else 1):
            scenarios = sequence(_sum_samples(row, bases), best_gap, rng)
            columns = _columns(scenarios, row, bases, rng)
            slots = _fill_places(waiting, more, columns, distance, rng)
            # Of the best order its nearest repeat is furthest from what it shows.
            gaps = [index - slot.of for index, slot in enumerate(slots) if slot.of is not None]
            if min(gaps, default=distance) > nearest:
                best, nearest = slots, min(gaps, default=distance)
            if nearest >= distance:
                break
        orders.append(best)
    return orders, best_gap


def _sum_samples(counts: IntArray, bases: IntArray) -> IntArray:
    """Showings of each scenario, over its samples."""
    return np.bincount(bases, weights=counts, minlength=int(bases.max()) + 1).astype(np.int64)


def _columns(
    scenarios: list[int], counts: IntArray, bases: IntArray, rng: np.random.Generator
) -> list[int]:
    """Return the column of each place of a scenario: its only one, or its samples by lot."""
    if len(set(bases.tolist())) == len(bases):
        return scenarios
    waiting = {
        base: rng.permutation(np.repeat(np.arange(len(bases)), counts * (bases == base))).tolist()
        for base in set(bases.tolist())
    }
    return [waiting[scenario].pop() for scenario in scenarios]


def _fill_places(
    waiting: list[list[int]],
    more: Extras,
    scenarios: list[int],
    distance: int,
    rng: np.random.Generator,
) -> list[Slot]:
    """Return the unit or extra at each place of a scenario; repeats far from the first."""
    places: dict[int, list[int]] = {}
    for index, scenario in enumerate(scenarios):
        places.setdefault(scenario, []).append(index)
    slots: dict[int, Slot] = {}
    for pair, scenario in more.repeated:
        first, again = _two_places(places[scenario], distance, rng)
        slots[first] = Slot(kind=MAIN, pair=pair, scenario=scenario)
        slots[again] = Slot(kind=REPEAT, pair=pair, scenario=scenario, of=first, again=first + 1)
        places[scenario] = [index for index in places[scenario] if index not in (first, again)]
    for scenario in more.checks:
        index = places[scenario].pop(int(rng.integers(len(places[scenario]))))
        slots[index] = Slot(kind=CHECK, pair=-1, scenario=scenario)
    left = [list(pairs) for pairs in waiting]
    for index, scenario in enumerate(scenarios):
        if index not in slots:
            slots[index] = Slot(kind=MAIN, pair=left[scenario].pop(), scenario=scenario)
    return [slots[index] for index in range(len(scenarios))]


def _two_places(places: list[int], distance: int, rng: np.random.Generator) -> tuple[int, int]:
    """Two of these places that far apart, by lot; the first and the last where none are."""
    options = [(first, again) for first in places for again in places if again - first >= distance]
    if not options:
        return places[0], places[-1]
    return options[int(rng.integers(len(options)))]


def deal_sides(
    orders: list[list[tuple[int, int]]], pairs: int, rng: np.random.Generator
) -> list[BoolArray]:
    """Return the showings to turn around: half of each expert's of a pair, odd ones in turn."""
    flipped = [np.zeros(len(order), dtype=bool) for order in orders]
    # (P,) whether the next odd showing is turned: in turn over experts, for +-1 over all.
    odd_turn = rng.random(pairs) < 0.5
    for expert in rng.permutation(len(orders)):
        showings: dict[int, list[int]] = {}
        for index, (pair, _) in enumerate(orders[expert]):
            showings.setdefault(pair, []).append(index)
        for pair, places in showings.items():
            turned = len(places) // 2
            if len(places) % 2:
                turned += int(odd_turn[pair])
                odd_turn[pair] = not odd_turn[pair]
            flipped[expert][rng.permutation(places)[:turned]] = True
    return flipped


def largest_gap(counts: IntArray, gap: int) -> int:
    """The most matchups up to `gap` that can lie between two of a scenario.

    The fullest scenarios span (most - 1) blocks of gap + 1 and need one more place each.
    """
    most = int(counts.max())
    if most < 2:
        return gap
    fullest = int((counts == most).sum())
    # (most - 1) (gap + 1) + fullest <= all showings, solved for the gap.
    return min(gap, (int(counts.sum()) - fullest) // (most - 1) - 1)


def sequence(counts: IntArray, gap: int, rng: np.random.Generator) -> list[int]:
    """Scenarios in an order with at least `gap` others in between: always the fullest allowed."""
    left = counts.astype(float)
    order: list[int] = []
    for _ in range(int(counts.sum())):
        # (S,) what is left, lots below 1 among equals; minus infinity where the gap bars it.
        score = left + rng.random(len(left))
        score[left < 1] = -np.inf
        if gap:
            score[order[-gap:]] = -np.inf
        scenario = int(np.argmax(score))
        order.append(scenario)
        left[scenario] -= 1
    return order
