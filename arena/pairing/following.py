"""What follows on an expert's order so far: units put in an order, with sides, repeats and checks.

A pure function of the rules, of what is planned so far and of a generator.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arena.pairing.later import Wanted
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.rules import Grid, PlannedMatchup, PlanRules


def follow_on(
    rules: PlanRules,
    grid: Grid,
    expert: str,
    so_far: Sequence[PlannedMatchup],
    units: Sequence[Wanted],
    rng: np.random.Generator,
) -> tuple[list[PlannedMatchup], int]:
    """One expert's next showings: the units in an order, with repeats and checks on top.

    Args:
        rules: Of the study.
        grid: What can be shown.
        expert: Whose order goes on.
        so_far: The expert's showings, by position.
        units: What comes now; none of it is known to the expert.
        rng: Shuffles.

    Returns:
        The showings, and the scenario gap that holds from the last known showing on.
    """
    items = [_Item(kind=MAIN, scenario=u.scenario, pair=u.pair, chance=u.chance) for u in units]
    items += _repeats(rules, grid, so_far, items, rng)
    items += _checks(rules, grid, so_far, len(units), rng)
    order, gap = _in_order(items, [one.scenario for one in so_far], grid, rules, rng)
    return _shown(rules, grid, expert, so_far, order, rng), gap


# --- Private -----------------------------------------------------------------------------------


@dataclass(slots=True, kw_only=True, eq=False)
class _Item:
    """Something to be shown, before it has a place.

    Attributes:
        again: Position of what a repeat shows again, if that is known already.
        of: The item that a repeat shows again, if that is new as well.
    """

    kind: str
    scenario: int
    pair: int
    chance: float
    again: int | None = None
    of: _Item | None = None


def _next_position(so_far: Sequence[PlannedMatchup]) -> int:
    """Behind everything; positions that were handed over leave holes."""
    return so_far[-1].position + 1 if so_far else 1


def _repeats(
    rules: PlanRules,
    grid: Grid,
    so_far: Sequence[PlannedMatchup],
    items: Sequence[_Item],
    rng: np.random.Generator,
) -> list[_Item]:
    """Hidden repeats: of what was shown long enough ago, else of what comes now."""
    done = {one.repeats for one in so_far if one.kind == REPEAT}
    mains = sum(one.kind == MAIN for one in so_far) + len(items)
    count = min(round(rules.repeat_share * mains) - len(done), len(items))
    if count < 1:
        return []
    places = {scenario: column for column, scenario in enumerate(grid.scenarios)}
    pairs = {frozenset(pair): row for row, pair in enumerate(grid.pairs)}
    soonest = _next_position(so_far) - rules.repeat_distance
    old = [
        _Item(
            kind=REPEAT,
            scenario=places[one.scenario],
            pair=pairs[frozenset((one.left, one.right))],
            chance=0.0,
            again=one.position,
        )
        for one in so_far
        if one.kind == MAIN and one.position <= soonest and one.position not in done
    ]
    new = [
        _Item(kind=REPEAT, scenario=item.scenario, pair=item.pair, chance=0.0, of=item)
        for item in items
    ]
    offered = old if len(old) >= count else new
    chosen = [offered[index] for index in rng.permutation(len(offered))[:count]]
    for item in chosen:
        item.chance = len(chosen) / len(offered)
    return chosen


def _checks(
    rules: PlanRules,
    grid: Grid,
    so_far: Sequence[PlannedMatchup],
    more: int,
    rng: np.random.Generator,
) -> list[_Item]:
    shown = {one.scenario for one in so_far if one.kind == CHECK}
    mains = sum(one.kind == MAIN for one in so_far) + more
    unused = [check for check in rules.checks if check.scenario not in shown]
    count = min(max(round(rules.check_share * mains) - len(shown), 0), len(unused))
    return [
        _Item(
            kind=CHECK,
            scenario=grid.scenarios.index(unused[index].scenario),
            pair=-1,
            chance=1.0 / len(unused),
        )
        for index in rng.permutation(len(unused))[:count]
    ]


def _in_order(
    items: Sequence[_Item],
    before: Sequence[str],
    grid: Grid,
    rules: PlanRules,
    rng: np.random.Generator,
) -> tuple[list[_Item], int]:
    """The items with the largest gap that can be kept, also to what was shown before."""
    bases = [int(base) for base in grid.bases]
    last = [bases[grid.scenarios.index(name)] for name in before[-rules.scenario_gap :]]
    for gap in range(rules.scenario_gap, -1, -1):
        for _ in range(5):
            order = _try_order(items, last[len(last) - min(gap, len(last)) :], gap, rng, bases)
            if order is not None:
                return order, gap
    raise AssertionError("without a gap any order will do")


def _try_order(
    items: Sequence[_Item],
    last: list[int],
    gap: int,
    rng: np.random.Generator,
    bases: Sequence[int],
) -> list[_Item] | None:
    """The fullest allowed scenario first; a repeat only after what it shows. None if it sticks."""
    waiting: dict[int, list[_Item]] = {}
    for index in rng.permutation(len(items)):
        waiting.setdefault(items[index].scenario, []).append(items[index])
    for queue in waiting.values():  # taken from the end: what is repeated comes before its repeat
        queue.sort(key=lambda item: item.of is None)
    recent, order = list(last), list[_Item]()
    for _ in items:
        barred = set(recent[-gap:]) if gap else set()
        open_ = [place for place in waiting if waiting[place] and bases[place] not in barred]
        if not open_:
            return None
        place = max(open_, key=lambda place: len(waiting[place]) + rng.random())
        order.append(waiting[place].pop())
        recent.append(bases[place])
    return order


def _shown(
    rules: PlanRules,
    grid: Grid,
    expert: str,
    so_far: Sequence[PlannedMatchup],
    order: Sequence[_Item],
    rng: np.random.Generator,
) -> list[PlannedMatchup]:
    """The items as showings, behind those so far."""
    first = _next_position(so_far)
    position_of = {id(item): position for position, item in enumerate(order, start=first)}
    again = [item.again if item.of is None else position_of[id(item.of)] for item in order]
    sides = _sides(rules, grid, so_far, order, again, rng)
    return [
        PlannedMatchup(
            expert=expert,
            position=position,
            scenario=grid.scenarios[item.scenario],
            left=left,
            right=right,
            draw_probability=item.chance,
            kind=item.kind,
            repeats=repeated if item.kind == REPEAT else None,
        )
        for position, (item, repeated, (left, right)) in enumerate(
            zip(order, again, sides, strict=True), start=first
        )
    ]


def _sides(
    rules: PlanRules,
    grid: Grid,
    so_far: Sequence[PlannedMatchup],
    order: Sequence[_Item],
    again: Sequence[int | None],
    rng: np.random.Generator,
) -> list[tuple[str, str]]:
    """Left and right of every item: what was on the left more often goes to the right.

    A repeat is turned around; checks have the broken picture on either side in turn.
    """
    ahead: Counter[frozenset[str]] = Counter()
    left_of = {one.position: one.left for one in so_far}
    for one in so_far:
        if one.kind == MAIN:
            ahead[frozenset((one.left, one.right))] += 1 if one.left < one.right else -1
    checks = {check.scenario: check for check in rules.checks}
    broken_left = bool(rng.random() < 0.5)
    made = []
    for position, (item, repeated) in enumerate(
        zip(order, again, strict=True), start=_next_position(so_far)
    ):
        if item.kind == CHECK:
            check = checks[grid.scenarios[item.scenario]]
            sides = (check.good, check.broken)
            turn, broken_left = broken_left, not broken_left
        elif item.kind == REPEAT:
            sides = grid.pairs[item.pair]
            turn = left_of[repeated or 0] == sides[0]
        else:
            sides = grid.pairs[item.pair]
            lead = ahead[frozenset(sides)]
            turn = lead > 0 or (lead == 0 and bool(rng.random() < 0.5))
            ahead[frozenset(sides)] += -1 if turn else 1
        left, right = sides[::-1] if turn else sides
        left_of[position] = left
        made.append((left, right))
    return made
