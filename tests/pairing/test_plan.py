from collections import Counter
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.errors import NothingToPlan
from arena.pairing.order import _two_places
from arena.pairing.plan import Entry, MatchupPlan, PlanRules, plan
from tests.pairing.studies import by_expert, check_extras, pair
from tests.properties import examples


def rules(
    contestants: int = 3,
    scenarios: int = 10,
    experts: int = 2,
    votes: int = 12,
    seed: int = 1,
    without: frozenset[tuple[int, int]] = frozenset(),
    same: frozenset[tuple[int, int]] = frozenset(),
) -> PlanRules:
    """All cells but those (contestant, scenario) in `without`; those in `same` look alike."""
    entries = tuple(
        Entry(
            scenario=f"s{s}",
            contestant=f"c{c}",
            picture=f"empty-{s}" if (c, s) in same else f"{c}-{s}",
        )
        for s in range(scenarios)
        for c in range(contestants)
        if (c, s) not in without
    )
    names = tuple(f"e{number}" for number in range(experts))
    return PlanRules(entries=entries, experts=names, votes_per_expert=votes, seed=seed)


def spread(counts: Counter[object], places: int) -> int:
    """Most minus least, places that never occur counting as zero."""
    values = list(counts.values()) + [0] * (places - len(counts))
    return max(values) - min(values)


def check_rules_hold(asked: PlanRules, made: MatchupPlan) -> None:
    """What holds for every plan, whatever was available."""
    check_extras(asked, made)
    assert by_expert(made).keys() == set(asked.experts)
    pictures = {(entry.scenario, entry.contestant): entry.picture for entry in asked.entries}
    for matchup in made.matchups:
        left = pictures[matchup.scenario, matchup.left]
        assert left != pictures[matchup.scenario, matchup.right]


sizes = st.tuples(
    st.integers(2, 6), st.integers(1, 9), st.integers(1, 5), st.integers(1, 60), st.integers(0, 9)
)


@given(sizes)
@examples(60)
def test_a_full_plan_is_balanced_to_one(size: tuple[int, int, int, int, int]) -> None:
    contestants, scenarios, experts, votes, seed = size
    pairs = contestants * (contestants - 1) // 2
    votes = min(votes, pairs * scenarios)
    asked = rules(contestants, scenarios, experts, votes, seed)

    made = plan(asked)

    check_rules_hold(asked, made)
    assert spread(Counter(pair(m) for m in made.matchups), pairs) <= 1
    assert spread(Counter(m.scenario for m in made.matchups), scenarios) <= 1
    for expert in asked.experts:
        mine = [m for m in made.matchups if m.expert == expert]
        assert spread(Counter(pair(m) for m in mine), pairs) <= 1
        assert spread(Counter(m.scenario for m in mine), scenarios) <= 1


cells = st.frozensets(st.tuples(st.integers(0, 4), st.integers(0, 7)), max_size=14)


@given(cells, cells, st.integers(1, 40), st.integers(1, 4), st.integers(0, 5))
@examples(60)
def test_a_plan_with_holes_keeps_every_rule(
    without: frozenset[tuple[int, int]],
    same: frozenset[tuple[int, int]],
    votes: int,
    experts: int,
    seed: int,
) -> None:
    asked = rules(5, 8, experts, votes, seed, without, same)
    try:
        made = plan(asked)
    except NothingToPlan:
        assert units(asked) < votes
        return
    check_rules_hold(asked, made)


def units(asked: PlanRules) -> int:
    count = 0
    for one, other in combinations(asked.entries, 2):
        count += one.scenario == other.scenario and one.picture != other.picture
    return count


@given(st.lists(st.integers(1, 6), min_size=2, max_size=7), st.integers(0, 3))
@examples(60)
def test_the_scenario_gap_is_the_largest_possible(counts: list[int], seed: int) -> None:
    """Contestants per scenario differ, all units are shown: the fullest scenario sets the gap."""
    entries = tuple(
        Entry(scenario=f"s{number}", contestant=f"c{c}", picture=f"{number}-{c}")
        for number, contestants in enumerate(counts)
        for c in range(contestants + 1)
    )
    showings = [(n + 1) * n // 2 for n in counts]
    asked = PlanRules(entries=entries, experts=("e",), votes_per_expert=sum(showings), seed=seed)

    made = plan(asked)

    check_rules_hold(asked, made)
    most, total = max(showings), sum(showings)
    if most > 1:
        fullest = showings.count(most)
        fits = [g for g in range(6) if (most - 1) * (g + 1) + fullest <= total]
        assert made.scenario_gap == max(fits)


def test_the_same_rules_give_the_same_plan_and_another_seed_another() -> None:
    assert plan(rules(seed=3)) == plan(rules(seed=3))
    assert plan(rules(seed=3)) != plan(rules(seed=4))


def test_identical_pictures_are_listed_and_never_shown() -> None:
    asked = rules(3, 4, 1, 5, same=frozenset({(0, 2), (1, 2)}))
    made = plan(asked)
    assert made.identical == (("s2", "c0", "c1"),)
    check_rules_hold(asked, made)


def test_units_are_spread_over_the_experts_before_any_is_repeated() -> None:
    made = plan(rules(3, 10, 2, 15))
    judged = Counter((pair(m), m.scenario) for m in made.matchups)
    assert sum(count > 1 for count in judged.values()) <= 4, "a quarter by chance: 7 or 8 of 30"


def test_an_odd_number_of_showings_leaves_no_side_ahead_over_all_experts() -> None:
    made = plan(rules(2, 3, 6, 3))
    assert Counter(m.left for m in made.matchups)["c0"] == 9


def test_too_few_units_are_refused_with_both_numbers() -> None:
    with pytest.raises(NothingToPlan, match=r"5 different pairs .*and 1 with.* is to judge 6"):
        plan(rules(3, 2, 1, 6, same=frozenset({(0, 1), (1, 1)})))


def test_rules_that_make_no_sense_are_refused() -> None:
    for changes, sentence in (
        ({"votes": 0}, "Votes per expert must be 1 or more, not 0"),
        ({"experts": 0}, "at least one expert"),
        ({"contestants": 1}, "two contestants with pictures, not 1"),
        ({"seed": -1}, "seed must be 0 or more"),
    ):
        with pytest.raises(NothingToPlan, match=sentence):
            plan(rules(**changes))  # type: ignore[arg-type]


def test_a_repeat_may_come_exactly_at_the_distance_that_is_asked_for() -> None:
    seen = {_two_places([0, 5, 7], 5, np.random.default_rng(seed)) for seed in range(40)}
    assert seen == {(0, 5), (0, 7)}
    too_near = {_two_places([0, 2, 4], 5, np.random.default_rng(seed)) for seed in range(5)}
    assert too_near == {(0, 4)}, "where none is far enough, as far as can be"
