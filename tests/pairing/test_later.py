from collections import Counter, defaultdict

import numpy as np
import pytest

from arena.errors import NothingToPlan
from arena.pairing.later import GridUnit, deal, follow_on, main_units
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.plan import PlannedMatchup, plan
from arena.pairing.rules import PlanRules, make_grid
from tests.pairing.studies import by_expert, pair, paper_rules, smallest_gap


def handed_over(
    rules: PlanRules, giver: str, done: int, to: list[str]
) -> dict[str, list[PlannedMatchup]]:
    """Everybody's showings after the giver stopped at a position."""
    made = by_expert(plan(rules))
    grid, rng = make_grid(rules.entries), np.random.default_rng(5)
    known: dict[str, list[PlannedMatchup]] = defaultdict(list, made)
    left = main_units(grid, made[giver][done:])
    known[giver] = made[giver][:done]
    dealt = deal(grid, known, to, left, rng)
    for name in to:
        more = follow_on(rules, grid, name, known[name], dealt[name], rng)
        known[name] = [*known[name], *more]
    return known


def pairs_of(showings: list[PlannedMatchup]) -> Counter[frozenset[str]]:
    return Counter(pair(one) for one in showings if one.kind == MAIN)


@pytest.mark.parametrize("to", [["expert-2", "expert-3", "expert-4"], ["newcomer"]])
def test_what_is_handed_over_keeps_every_pair_and_every_rule(to: list[str]) -> None:
    rules = paper_rules(3, votes=100, experts=6)
    before, after = by_expert(plan(rules)), handed_over(rules, "expert-1", 40, to)

    def total(known: dict[str, list[PlannedMatchup]]) -> Counter[frozenset[str]]:
        return sum(map(pairs_of, known.values()), Counter())

    assert total(after) == total(before), "every pair keeps its votes"
    shares = [len(after[name]) - len(before.get(name, [])) for name in to]
    assert max(shares) - min(shares) <= 3
    for name in to:
        mine = after[name]
        mains = [one for one in mine if one.kind == MAIN]
        assert [one.position for one in mine] == list(range(1, len(mine) + 1))
        assert len({(pair(one), one.scenario) for one in mains}) == len(mains)
        assert smallest_gap(mine) >= 5
        lead = Counter(pair(one) for one in mains if one.left == min(one.left, one.right))
        assert all(abs(2 * lead[key] - n) <= 1 for key, n in pairs_of(mine).items())
        repeats = [one for one in mine if one.kind == REPEAT]
        assert len(repeats) == round(0.05 * len(mains))
        for one in repeats:
            first = mine[(one.repeats or 0) - 1]
            assert (first.left, first.right, first.kind) == (one.right, one.left, MAIN)
        checks = [one for one in mine if one.kind == CHECK]
        assert len(checks) == round(0.02 * len(mains)) == len({one.scenario for one in checks})


def test_what_everybody_knows_is_judged_on_another_scenario() -> None:
    rules = paper_rules(1, votes=20, experts=2)
    grid = make_grid(rules.entries)
    known = by_expert(plan(rules))
    shared = main_units(grid, known["expert-1"])
    dealt = deal(grid, known, ["expert-1"], shared, np.random.default_rng(1))["expert-1"]
    assert Counter(u.pair for u in dealt) == Counter(u.pair for u in shared)
    assert not {(u.pair, u.scenario) for u in dealt} & {(u.pair, u.scenario) for u in shared}


def test_a_pair_that_everybody_has_judged_everywhere_is_refused_by_name() -> None:
    rules = paper_rules(1, votes=20, experts=1)
    grid = make_grid(rules.entries)
    first, second = grid.pairs[0]
    all_of_it = [
        PlannedMatchup(expert="eva", position=n + 1, scenario=scenario, left=first, right=second)
        for n, scenario in enumerate(grid.scenarios)
    ]
    more = [GridUnit(pair=0, scenario=0)]
    with pytest.raises(NothingToPlan, match=f"{first} against {second} on every scenario"):
        deal(grid, {"eva": all_of_it}, ["eva"], more, np.random.default_rng(1))
