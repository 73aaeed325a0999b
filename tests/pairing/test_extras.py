from collections import Counter

import pytest

from arena.errors import NothingToPlan
from arena.pairing.order import MAIN
from arena.pairing.plan import Entry, PlanRules, plan
from tests.pairing.studies import (
    appearances,
    by_expert,
    check_extras,
    chi_square_of_sides,
    paper_rules,
    smallest_distance,
    smallest_gap,
)

NINE_DEGREES_ONE_IN_A_THOUSAND = 27.9


@pytest.mark.parametrize("seed", range(3))
def test_a_study_of_the_papers_size_keeps_every_rule(seed: int) -> None:
    asked = paper_rules(seed)
    made = plan(asked)
    check_extras(asked, made)
    assert set(appearances(made).values()) == {11_520 // 9}
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


@pytest.mark.slow
def test_smaller_studies_keep_every_rule() -> None:
    for seed in range(60):
        asked = paper_rules(seed, votes=100, experts=6)
        made = plan(asked)
        check_extras(asked, made)
        assert min(map(smallest_gap, by_expert(made).values())) >= 5
        assert chi_square_of_sides(made) < NINE_DEGREES_ONE_IN_A_THOUSAND


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


def test_rules_that_can_not_be_met_are_refused() -> None:
    for rules, sentence in (
        ({"repeat_share": 0.6}, "share of repeats goes from 0 to 50%, not 60.0%"),
        ({"check_share": -0.1}, "share of attention checks"),
    ):
        with pytest.raises(NothingToPlan, match=sentence):
            plan(small(**rules))


def test_few_scenarios_keep_repeats_as_far_away_as_they_can() -> None:
    asked = small(repeat_share=0.25)
    made = plan(asked)
    check_extras(asked, made)
    assert made.scenario_gap == 5
    assert min(map(smallest_distance, by_expert(made).values())) > 5
