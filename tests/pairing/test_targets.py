from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.errors import NothingToPlan
from arena.pairing.order import MAIN
from arena.pairing.plan import Entry, PlanRules, plan
from arena.pairing.units import votes_by_appearances
from tests.pairing.studies import (
    APPEARANCES,
    appearances,
    by_expert,
    check_extras,
    chi_square_of_sides,
    pair,
    paper_rules,
    smallest_distance,
    smallest_gap,
)
from tests.properties import examples

NINE_DEGREES_ONE_IN_A_THOUSAND = 27.9


@pytest.mark.parametrize("seed", range(3))
def test_the_papers_counts_are_met_exactly(seed: int) -> None:
    asked = paper_rules(seed)
    made = plan(asked)
    check_extras(asked, made)
    assert appearances(made) == APPEARANCES
    assert sum(APPEARANCES.values()) == 11_520
    mains = [matchup for matchup in made.matchups if matchup.kind == MAIN]
    assert len(mains) == 5_760
    assert made.scenario_gap == 5
    assert min(map(smallest_distance, by_expert(made).values())) >= 30
    assert chi_square_of_sides(made) < NINE_DEGREES_ONE_IN_A_THOUSAND
    per_scenario = Counter(matchup.scenario for matchup in mains)
    assert max(per_scenario.values()) - min(per_scenario.values()) <= 1
    for expert in by_expert(made).values():
        scenarios = Counter(matchup.scenario for matchup in expert if matchup.kind == MAIN)
        assert set(scenarios.values()) == {12, 13}


def test_two_hundred_smaller_studies_keep_every_rule() -> None:
    for seed in range(200):
        asked = paper_rules(seed, votes=100, experts=6)
        made = plan(asked)
        check_extras(asked, made)
        assert appearances(made) == dict(asked.appearances)
        assert min(map(smallest_gap, by_expert(made).values())) >= 5
        assert chi_square_of_sides(made) < NINE_DEGREES_ONE_IN_A_THOUSAND


def test_pairs_meet_as_often_as_independence_has_it() -> None:
    made = plan(paper_rules(1))
    met = Counter(pair(matchup) for matchup in made.matchups if matchup.kind == MAIN)
    assert met[frozenset(("interplan", "gpt-4o-otm"))] > met[frozenset(("interplan", "llama-fc"))]
    twins = [met[frozenset(("interplan", name))] for name in ("gemini-otm", "llama-otm")]
    assert abs(twins[0] - twins[1]) <= 1


@given(st.integers(3, 9), st.integers(1, 12), st.integers(0, 10_000))
@examples(60)
def test_sums_that_some_votes_have_are_reached(size: int, most: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    capacity = np.triu(rng.integers(0, most + 1, (size, size)), 1)
    some = np.triu(rng.integers(0, capacity + 1), 1)
    capacity, some = capacity + capacity.T, some + some.T
    votes = votes_by_appearances([str(n) for n in range(size)], some.sum(axis=1), capacity)
    assert (votes.sum(axis=1) == some.sum(axis=1)).all()
    assert (votes == votes.T).all()
    assert (votes >= 0).all()
    assert (votes <= capacity).all()


def small(**rules: object) -> PlanRules:
    """Four contestants, eight scenarios, two experts with twelve votes each."""
    given: dict[str, object] = {
        "entries": tuple(
            Entry(scenario=f"s{s}", contestant=name, picture=f"{s}{name}")
            for s in range(8)
            for name in "abcd"
        ),
        "experts": ("eva", "finn"),
        "votes_per_expert": 12,
        "seed": 1,
    }
    return PlanRules(**{**given, **rules})  # type: ignore[arg-type]


def test_targets_by_pair_are_met_exactly() -> None:
    wanted = (("a", "b", 12), ("d", "c", 9), ("a", "d", 3))
    made = plan(small(pair_votes=wanted))
    met = Counter("".join(sorted((m.left, m.right))) for m in made.matchups)
    assert met == {"ab": 12, "cd": 9, "ad": 3}
    for mine in by_expert(made).values():
        own = Counter("".join(sorted((m.left, m.right))) for m in mine)
        assert own["ab"] == 6
        assert own["cd"] in {4, 5}


def test_holes_in_the_pictures_do_not_spoil_the_counts() -> None:
    asked = small(appearances=(("a", 18), ("b", 10), ("c", 10), ("d", 10)))
    holes = tuple(
        replace(entry, picture="same") if entry.scenario in {"s1", "s2"} else entry
        for entry in asked.entries
        if (entry.scenario, entry.contestant) != ("s3", "b")
    )
    made = plan(replace(asked, entries=holes))
    assert appearances(made) == dict(asked.appearances)
    assert not {"s1", "s2"} & {matchup.scenario for matchup in made.matchups}


@pytest.mark.parametrize(
    ("rules", "sentence"),
    [
        ({"appearances": (("a", 24), ("b", 24))}, "needs one target: c, d"),
        (
            {"appearances": tuple((name, 13) for name in "abcd")},
            "add up to 52 appearances, but the experts' quotas to 48",
        ),
        (
            {"appearances": (("a", 30), ("b", 6), ("c", 6), ("d", 6))},
            "can't be reached with the pairs that can be shown: a 30",
        ),
        ({"pair_votes": (("a", "b", 24),)}, "a against b is to get 24 votes, .* can give 16"),
        ({"pair_votes": (("a", "e", 24),)}, "a against e is no pair"),
        ({"pair_votes": (("a", "b", 4),)}, "add up to 4 votes, .* to 24"),
        (
            {"pair_votes": (("a", "b", 24),), "appearances": (("a", 24),)},
            "by contestant or by pair, not both",
        ),
        ({"repeat_share": 0.6}, "share of repeats goes from 0 to 50%, not 60.0%"),
        ({"check_share": -0.1}, "share of attention checks"),
        ({"adaptive_share": 0.95}, "share of the adaptive part"),
        ({"uniform_share": 0.1}, "At least 20 %"),
        (
            {"pair_votes": (("a", "b", 24),), "adaptive_share": 0.4},
            "none are left for an adaptive",
        ),
    ],
)
def test_targets_that_can_not_be_met_are_refused_with_numbers(
    rules: dict[str, object], sentence: str
) -> None:
    with pytest.raises(NothingToPlan, match=sentence):
        plan(small(**rules))


def test_few_scenarios_keep_repeats_as_far_away_as_they_can() -> None:
    asked = small(repeat_share=0.25)
    made = plan(asked)
    check_extras(asked, made)
    assert made.scenario_gap == 5
    assert min(map(smallest_distance, by_expert(made).values())) > 5


def test_every_unit_of_the_pair_is_as_likely_as_its_share_says() -> None:
    made = plan(small(pair_votes=(("a", "b", 16), ("c", "d", 8))))
    chances = {"".join(sorted((m.left, m.right))): m.draw_probability for m in made.matchups}
    assert chances == pytest.approx({"ab": 16 / 24 / 8, "cd": 8 / 24 / 8})
