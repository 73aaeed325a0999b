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

import numpy as np

from arena.pairing.order import (
    CHECK,
    MAIN,
    REPEAT,
    BoolArray,
    Extras,
    FloatArray,
    Slot,
    deal_sides,
    put_in_order,
)
from arena.pairing.rules import (
    Check,
    Entry,
    Grid,
    MatchupPlan,
    PlannedMatchup,
    PlanRules,
    check_rules,
)
from arena.pairing.units import bring_together, choose_units, draw_probability

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
    experts, votes = len(rules.experts), rules.votes_at_once
    chosen = choose_units(grid.showable, experts, votes, rng)
    bring_together(chosen, grid.showable, rules.overlap_share, rng)
    probability = draw_probability(grid.showable, votes)
    extras = [_extras(rules, grid, mine, rng) for mine in chosen]
    orders, gap = put_in_order(
        chosen, extras, rules.scenario_gap, rules.repeat_distance, rng, grid.bases
    )
    mains = [
        [(slot.pair, slot.scenario) for slot in order if slot.kind == MAIN] for order in orders
    ]
    flipped = deal_sides(mains, len(grid.pairs), rng)
    matchups = [
        matchup
        for expert, order, flips in zip(rules.experts, orders, flipped, strict=True)
        for matchup in _matchups(rules, grid, probability, expert, order, flips, rng)
    ]
    return MatchupPlan(matchups=tuple(matchups), scenario_gap=gap, identical=grid.identical)


def _extras(rules: PlanRules, grid: Grid, mine: BoolArray, rng: np.random.Generator) -> Extras:
    """One expert's repeats and checks, by lot."""
    repeats = round(rules.repeat_share * rules.votes_at_once)
    checks = min(round(rules.check_share * rules.votes_at_once), len(rules.checks))
    if not repeats and not checks:
        return Extras()
    units = np.argwhere(mine)
    drawn = rng.permutation(len(units))[:repeats]
    shown = rng.permutation(len(rules.checks))[:checks]
    return Extras(
        repeated=tuple((int(units[row][0]), int(units[row][1])) for row in drawn),
        checks=tuple(grid.scenarios.index(rules.checks[number].scenario) for number in shown),
    )


def _matchups(
    rules: PlanRules,
    grid: Grid,
    probability: FloatArray,
    expert: str,
    order: list[Slot],
    flips: BoolArray,
    rng: np.random.Generator,
) -> list[PlannedMatchup]:
    """One expert's order as showings; checks have the broken picture on either side in turn."""
    repeats = sum(slot.kind == REPEAT for slot in order)
    turned: dict[int, bool] = {}
    waiting = list(flips)
    checks = {check.scenario: (check.good, check.broken) for check in rules.checks}
    broken_left = bool(rng.random() < 0.5) if rules.checks else False
    made = []
    for index, slot in enumerate(order):
        if slot.kind == CHECK:
            sides, flip = checks[grid.scenarios[slot.scenario]], broken_left
            broken_left = not broken_left
            chance = 1.0 / len(rules.checks)
        else:
            sides = grid.pairs[slot.pair]
            # A repeat is always later than what it repeats.
            flip = not turned[slot.of] if slot.of is not None else bool(waiting.pop(0))
            chance = float(probability[slot.pair, slot.scenario])
            if slot.kind == REPEAT:
                chance = repeats / (len(order) - repeats)
        turned[index] = flip
        left, right = sides[::-1] if flip else sides
        made.append(
            PlannedMatchup(
                expert=expert,
                position=index + 1,
                scenario=grid.scenarios[slot.scenario],
                left=left,
                right=right,
                draw_probability=chance,
                kind=slot.kind,
                repeats=None if slot.of is None else slot.of + 1,
            )
        )
    return made
