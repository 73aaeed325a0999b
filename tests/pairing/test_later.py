import math
from collections import Counter, defaultdict

import numpy as np
import pytest

from arena.errors import NothingToPlan
from arena.pairing.later import (
    PRIOR_SD,
    Wanted,
    contestants_of,
    deal,
    draw_units,
    follow_on,
    gains,
    judges,
    ratings_so_far,
    units_of,
)
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.plan import PlannedMatchup, plan
from arena.pairing.rules import PlanRules, grid_of
from tests.pairing.studies import by_expert, pair, paper_rules, smallest_gap


def handed_over(
    rules: PlanRules, giver: str, done: int, to: list[str]
) -> dict[str, list[PlannedMatchup]]:
    """Everybody's showings after the giver stopped at a position."""
    made = by_expert(plan(rules))
    grid, rng = grid_of(rules.entries), np.random.default_rng(5)
    known: dict[str, list[PlannedMatchup]] = defaultdict(list, made)
    left = units_of(grid, made[giver][done:])
    known[giver] = made[giver][:done]
    dealt = deal(grid, known, to, left, rng)
    for name in to:
        more, gap = follow_on(rules, grid, name, known[name], dealt[name], rng)
        assert gap == rules.scenario_gap
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
    grid = grid_of(rules.entries)
    known = by_expert(plan(rules))
    shared = units_of(grid, known["expert-1"])
    dealt = deal(grid, known, ["expert-1"], shared, np.random.default_rng(1))["expert-1"]
    assert Counter(u.pair for u in dealt) == Counter(u.pair for u in shared)
    assert not {(u.pair, u.scenario) for u in dealt} & {(u.pair, u.scenario) for u in shared}


def test_a_pair_that_everybody_has_judged_everywhere_is_refused_by_name() -> None:
    rules = paper_rules(1, votes=20, experts=1)
    grid = grid_of(rules.entries)
    first, second = grid.pairs[0]
    all_of_it = [
        PlannedMatchup(
            expert="eva",
            position=n + 1,
            scenario=scenario,
            left=first,
            right=second,
            draw_probability=1.0,
        )
        for n, scenario in enumerate(grid.scenarios)
    ]
    more = [Wanted(pair=0, scenario=0, chance=1.0)]
    with pytest.raises(NothingToPlan, match=f"{first} against {second} on every scenario"):
        deal(grid, {"eva": all_of_it}, ["eva"], more, np.random.default_rng(1))


# --- The adaptive part -------------------------------------------------------------------------


def test_ratings_so_far_agree_with_a_case_worked_by_hand() -> None:
    scores = np.array([[0.0, 30.0], [10.0, 0.0]])
    ratings, covariance = ratings_so_far(scores)
    # The slope is zero: 30 - 40 p - r / sd^2 = 0 with p the chance of the first.
    chance = 1 / (1 + math.exp(-(ratings[0] - ratings[1])))
    assert 30 - 40 * chance == pytest.approx(ratings[0] / PRIOR_SD**2)
    assert ratings.sum() == pytest.approx(0.0)
    weight = 40 * chance * (1 - chance)
    spread = covariance[0, 0] + covariance[1, 1] - 2 * covariance[0, 1]
    assert spread == pytest.approx(1 / (weight + 0.5 / PRIOR_SD**2))


def test_without_votes_every_pair_gains_the_same_and_less_where_much_is_known() -> None:
    ratings, covariance = ratings_so_far(np.zeros((3, 3)))
    pairs = [(0, 1), (0, 2), (1, 2)]
    assert gains(pairs, ratings, covariance) == pytest.approx(
        [gains(pairs, ratings, covariance)[0]] * 3
    )
    scores = np.array([[0.0, 50.0, 0.0], [50.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    first, second, third = gains(pairs, *ratings_so_far(scores))
    assert first < second == pytest.approx(third)


def test_the_gain_is_what_the_trace_loses_by_one_more_vote() -> None:
    rng = np.random.default_rng(2)
    scores = np.triu(rng.integers(1, 9, (4, 4)), 1).astype(float)
    scores += scores.T
    ratings, covariance = ratings_so_far(scores)
    along = np.array([1.0, 0.0, -1.0, 0.0])
    chance = 1 / (1 + math.exp(ratings[2] - ratings[0]))
    after = np.linalg.inv(
        np.linalg.inv(covariance) + chance * (1 - chance) * np.outer(along, along)
    )
    lost = np.trace(covariance) - np.trace(after)
    assert gains([(0, 2)], ratings, covariance)[0] == pytest.approx(lost)


def test_draws_go_to_what_is_known_least_and_leave_every_pair_a_chance() -> None:
    rules = paper_rules(1, votes=20, experts=1)
    grid = grid_of(rules.entries)
    names = contestants_of(grid)
    scores = np.full((9, 9), 40.0) - np.diag(np.full(9, 40.0))
    scores[0, :] = scores[:, 0] = 0.0
    ratings, covariance = ratings_so_far(scores)
    none = np.zeros(grid.showable.shape, dtype=np.int64)
    drawn = draw_units(grid, set(), none, ratings, covariance, 0.2, 400, np.random.default_rng(3))
    assert len({(unit.pair, unit.scenario) for unit in drawn}) == 400
    assert min(unit.chance for unit in drawn) >= 0.2 / 36 / 50
    early = [names[0] in grid.pairs[unit.pair] for unit in drawn[:60]]
    assert sum(early) > 30, "8 of 36 pairs by lot: 13"
    assert len({unit.pair for unit in drawn}) > 30


def test_the_scenario_with_the_fewest_judges_comes_first() -> None:
    rules = paper_rules(1, votes=20, experts=1)
    grid = grid_of(rules.entries)
    counts = np.ones(grid.showable.shape, dtype=np.int64)
    counts[:, [4, 9]] = 0
    ratings, covariance = ratings_so_far(np.zeros((9, 9)))
    known = {(pair_, 4) for pair_ in range(36)}
    drawn = draw_units(grid, known, counts, ratings, covariance, 0.2, 6, np.random.default_rng(3))
    assert {unit.scenario for unit in drawn} == {9}


def test_the_same_seed_draws_the_same_and_judges_are_counted_by_expert() -> None:
    rules = paper_rules(1, votes=50, experts=3)
    grid, made = grid_of(rules.entries), by_expert(plan(rules))
    counts = judges(grid, made)
    assert counts.sum() == 150
    ratings, covariance = ratings_so_far(np.zeros((9, 9)))
    one, again, other = (
        draw_units(grid, set(), counts, ratings, covariance, 0.2, 30, np.random.default_rng(seed))
        for seed in (1, 1, 2)
    )
    assert one == again
    assert one != other
