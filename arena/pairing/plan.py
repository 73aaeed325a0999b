"""The planner of matchups: a pure function of seed and rules.

In: `PlanRules`: experts, what can be shown, numbers and a seed. Out: a `MatchupPlan`: for each
expert the matchups in their order, each with its two sides.

A unit is a scenario with a pair of contestants. The plan is made in five steps:

1. every expert gets a quota of each scenario and of each pair; quotas differ by at most 1 within
   an expert and over all experts, as far as there are enough units,
2. units are chosen that meet both quotas (units.py); what the first choice misses is mended by
   exchanges, and so is what the rules want two experts to judge,
3. hidden repeats and attention checks are drawn on top,
4. each expert's units are put in an order that keeps a scenario away from itself (order.py),
5. sides are dealt so that each pair is shown either way round equally often, to +-1; a repeat is
   shown the other way round.

Notation: E experts, P pairs, S scenarios.
"""

from collections.abc import Iterable, Sequence

import numpy as np

from arena.pairing.order import CHECK, MAIN, BoolArray, Extras, Slot, deal_sides, order_units
from arena.pairing.rules import (
    Check,
    Entry,
    Grid,
    MatchupPlan,
    PlannedMatchup,
    PlanRules,
    check_rules,
)
from arena.pairing.units import bring_together, choose_units

__all__ = ["Check", "Entry", "MatchupPlan", "PlanRules", "PlannedMatchup", "plan"]


def plan(rules: PlanRules) -> MatchupPlan:
    """Plan who sees which pair on which scenario, in which order and on which side.

    No expert sees a unit twice but in a hidden repeat. The same rules give the same plan.

    Raises:
        NothingToPlan: The rules can't be met; the text has the numbers.
    """
    grid = rules.grid
    check_rules(rules, grid)
    rng = np.random.default_rng(rules.seed)
    experts, votes = len(rules.experts), rules.votes_per_expert
    # (E, P, S). All steps draw from one generator: their order is part of the plan.
    chosen = choose_units(grid.showable, experts, votes, rng)
    bring_together(chosen, grid.showable, rules.overlap_share, rng)
    extras = [_extras(rules, grid, mine, rng) for mine in chosen]
    orders, gap = order_units(
        chosen, extras, rules.scenario_gap, rules.repeat_distance, rng, grid.bases
    )
    mains = [
        [(slot.pair, slot.scenario) for slot in order if slot.kind == MAIN] for order in orders
    ]
    flipped = deal_sides(mains, len(grid.pairs), rng)
    matchups = [
        matchup
        for expert, order, flips in zip(rules.experts, orders, flipped, strict=True)
        for matchup in lay_out(rules, grid, expert, order, flips, (), rng)
    ]
    return MatchupPlan(matchups=tuple(matchups), scenario_gap=gap, identical=grid.identical)


def _extras(rules: PlanRules, grid: Grid, mine: BoolArray, rng: np.random.Generator) -> Extras:
    """One expert's repeats and checks, by lot."""
    repeats, checks = rules.count_extras(rules.votes_per_expert)
    if not repeats and not checks:
        return Extras()
    # (units, 2): pair and scenario of each.
    units = np.argwhere(mine)
    drawn = rng.permutation(len(units))[:repeats]
    shown = rng.permutation(len(rules.checks))[:checks]
    return Extras(
        repeated=tuple((int(units[row][0]), int(units[row][1])) for row in drawn),
        checks=tuple(grid.scenarios.index(rules.checks[number].scenario) for number in shown),
    )


def lay_out(
    rules: PlanRules,
    grid: Grid,
    expert: str,
    slots: Sequence[Slot],
    flips: Iterable[bool],
    so_far: Sequence[PlannedMatchup],
    rng: np.random.Generator,
) -> list[PlannedMatchup]:
    """Make an expert's next showings.

    A repeat is turned around; checks have the broken picture on either side in turn.

    Args:
        rules: Of the study.
        grid: What can be shown.
        expert: Who sees them.
        slots: In their order.
        flips: Whether each main showing is turned around.
        so_far: What the expert has been shown.
        rng: Says on which side the first broken picture is.
    """
    left_of = {showing.position: showing.left for showing in so_far}
    # Behind everything; positions that were handed over leave holes.
    start = so_far[-1].position + 1 if so_far else 1
    waiting = iter(flips)
    checks = {check.scenario: (check.good, check.broken) for check in rules.checks}
    broken_left = bool(rng.random() < 0.5) if rules.checks else False
    made = []
    for position, slot in enumerate(slots, start=start):
        if slot.kind == CHECK:
            sides, flip = checks[grid.scenarios[slot.scenario]], broken_left
            broken_left = not broken_left
        else:
            sides = grid.pairs[slot.pair]
            is_repeat = slot.again is not None
            # A repeat is turned around: who prefers a side must not look steady.
            flip = left_of[slot.again or 0] == sides[0] if is_repeat else bool(next(waiting))
        left, right = sides[::-1] if flip else sides
        left_of[position] = left
        made.append(
            PlannedMatchup(
                expert=expert,
                position=position,
                scenario=grid.scenarios[slot.scenario],
                left=left,
                right=right,
                kind=slot.kind,
                repeats=slot.again,
            )
        )
    return made
