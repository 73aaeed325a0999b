"""How many units two experts judge, by the rule and without it."""

import math
from collections import Counter, defaultdict
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from arena.errors import NothingToPlan
from arena.pairing.order import MAIN
from arena.pairing.plan import Entry, MatchupPlan, PlanRules, plan
from arena.pairing.units import bring_together
from tests.pairing.studies import check_extras, pair, paper_rules
from tests.properties import examples


def twelve_by_forty(share: float, seed: int = 1) -> PlanRules:
    """Nine contestants on fifty scenarios: 480 votes on 1,800 units."""
    return overlapping(9, 50, 12, 40, share, seed)


def overlapping(
    contestants: int, scenarios: int, experts: int, votes: int, share: float, seed: int = 1
) -> PlanRules:
    return PlanRules(
        entries=tuple(
            Entry(scenario=f"s{scenario:02}", contestant=f"c{one}", picture=f"{scenario} {one}")
            for scenario in range(scenarios)
            for one in range(contestants)
        ),
        experts=tuple(f"e{number:02}" for number in range(experts)),
        votes_per_expert=votes,
        seed=seed,
        overlap_share=share,
    )


def shared(made: MatchupPlan) -> tuple[int, int]:
    """Units that anybody judges, and those that two experts or more do."""
    judges = defaultdict(set)
    for one in made.matchups:
        if one.kind == MAIN:
            judges[one.scenario, pair(one)].add(one.expert)
    return len(judges), sum(len(experts) > 1 for experts in judges.values())


def quotas(made: MatchupPlan) -> Counter[tuple[str, object]]:
    """Votes of every expert on every scenario and on every pair."""
    found: Counter[tuple[str, object]] = Counter()
    for one in made.matchups:
        found[one.expert, one.scenario] += 1
        found[one.expert, pair(one)] += 1
    return found


@pytest.mark.parametrize("share", [0.05, 0.1, 0.3, 0.6])
def test_the_plan_honours_the_share_and_keeps_every_quota(share: float) -> None:
    asked = twelve_by_forty(share)
    made, plain = plan(asked), plan(replace(asked, overlap_share=0.0))
    judged, twice = shared(made)
    assert twice >= math.ceil(share * judged - 1e-9)
    assert twice <= share * judged + 2  # no more than asked for: breadth comes first
    assert quotas(made) == quotas(plain)
    check_extras(asked, made)


def test_the_same_seed_and_rules_give_the_same_plan() -> None:
    assert plan(twelve_by_forty(0.2)) == plan(twelve_by_forty(0.2))
    assert plan(twelve_by_forty(0.2)) != plan(twelve_by_forty(0.2, seed=2))


@pytest.mark.slow
def test_a_plan_that_has_more_keeps_it() -> None:
    """5,760 votes on 1,800 units: nearly every unit has three judges."""
    assert plan(paper_rules(1, overlap_share=0.1)) == plan(paper_rules(1))


@given(
    st.integers(2, 5), st.integers(3, 8), st.integers(2, 4), st.integers(4, 20), st.floats(0, 0.8)
)
@examples(60)
def test_it_is_honoured_wherever_there_are_votes_enough(
    contestants: int, scenarios: int, experts: int, votes: int, share: float
) -> None:
    votes = min(votes, scenarios * math.comb(contestants, 2))
    asked = overlapping(contestants, scenarios, experts, votes, share)
    made = plan(asked)
    judged, twice = shared(made)
    assert twice >= share * judged - 1e-9
    assert Counter(one.expert for one in made.matchups) == dict.fromkeys(asked.experts, votes)


@pytest.mark.parametrize(("votes", "share"), [(20, 0.3), (40, 0.1)])
def test_experts_with_scenarios_and_pairs_of_their_own_share_some(
    votes: int, share: float
) -> None:
    """Two on ninety scenarios: no exchange within their quotas brings anything together."""
    made = plan(overlapping(8, 90, 2, votes, share))
    judged, twice = shared(made)
    assert share * judged <= twice < share * (judged + 1) + 1, "as many as asked for, not one more"
    found = quotas(made)
    assert max(number for (_, what), number in found.items() if isinstance(what, str)) == 1
    of_pairs = Counter(pair(one) for one in made.matchups)
    assert max(of_pairs.values()) - min(of_pairs.values()) <= 2


def test_what_can_not_be_is_refused_with_numbers() -> None:
    for wrong, said in (
        ({"overlap_share": 0.81}, "from 0 to 80%, not 81.0%"),
        ({"overlap_share": 0.1, "experts": ("e1",)}, "there must be two"),
    ):
        with pytest.raises(NothingToPlan, match=said):
            plan(replace(twelve_by_forty(0.0), **wrong))


def test_what_one_expert_alone_judges_can_not_be_brought_together() -> None:
    chosen = np.zeros((2, 1, 8), dtype=bool)
    chosen[0, 0, :6] = chosen[1, 0, :2] = True
    with pytest.raises(NothingToPlan, match=r"50% are .* 2 of 6 are reached"):
        bring_together(chosen, np.ones((1, 8), dtype=bool), 0.5, np.random.default_rng(1))
