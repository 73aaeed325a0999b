"""What is foretold of a study, against simulated ones and against what is known by hand."""

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri

from arena.rating.influence import estimate_effects
from arena.rating.leaderboard import rate
from arena.rating.ranking import CAUTION
from arena.studies.services.outlook import StudyEstimate, _largest_of, foretell, prospect
from augment.errors import InvalidDocument
from bench.worlds import World, paper_ratings

NINE = StudyEstimate(
    spread=0.0, ties=40.0, expert_sd=0.0, scenario_sd=0.0, repeats=5.0, checks=2.0, overlap=0.0
)


@pytest.mark.parametrize(
    ("effects", "votes"), [((0.0, 0.0), 200), ((100.0, 40.0), 200), ((0.0, 80.0), 40)]
)
def test_half_widths_are_those_of_simulated_studies(
    effects: tuple[float, float], votes: int
) -> None:
    world = World(
        ratings=np.asarray(1000.0 + 15.0 * np.arange(9), dtype=np.float64),
        scenario_sd=effects[0],
        expert_sd=effects[1],
        votes_per_expert=votes,
    )
    pulled = np.ptp(world.truth()) / np.ptp(world.ratings)
    design = replace(
        NINE,
        spread=float(np.ptp(world.truth())),
        ties=100 * world.tie_share(),
        expert_sd=world.shown_expert_sd(),
        scenario_sd=float(pulled * world.scenario_sd),
    )
    found = []
    for seed in range(12):
        board = rate(world.votes(np.random.default_rng(seed)), rounds=200, seed=seed)
        found += [(line.upper or 0.0) - (line.lower or 0.0) for line in board.lines]
    foretold = prospect(design, votes).half_width
    assert np.mean(found) / 2.0 == pytest.approx(foretold, rel=0.08)


def test_independent_votes_of_equals_have_the_variance_known_by_hand() -> None:
    """4 (1 - t) (C - 1)^2 / (C^2 n) squared logits, n votes a contestant."""
    of_each = 2 * 100_000
    logits = np.sqrt(4.0 * 0.6 * (8 / 9) ** 2 / of_each)
    by_hand = 1.96 * logits * 400.0 / np.log(10.0)
    many = replace(NINE, experts=1000, scenarios=10_000)
    found = prospect(many, 9 * 100).half_width
    assert found == pytest.approx(by_hand, rel=3e-3)


def test_no_number_of_votes_makes_up_for_few_experts() -> None:
    asked = replace(NINE, experts=4, expert_sd=60.0, half_width=40.0, gap=500.0)
    assert prospect(asked, asked.most_votes).widest > 40.0 > 60.0 * np.sqrt(8 / 9 / 4)
    goal = foretell(asked)[0]
    assert goal.prospect is None
    needed = re.search(r"(\d+) experts would do\.$", goal.obstacle)
    assert needed is not None, "more scenarios do not help"

    def widest(experts: int) -> float:
        return prospect(replace(asked, experts=experts), asked.most_votes).widest

    assert widest(int(needed[1])) <= 40.0 < widest(int(needed[1]) - 1)


def test_the_votes_asked_for_are_the_fewest() -> None:
    found = foretell(replace(NINE, gap=60.0))
    for goal, name, limit in zip(found, ("widest", "gap"), (25.0, 60.0), strict=True):
        assert goal.prospect is not None
        fewer = prospect(NINE, goal.prospect.votes_per_expert - 1)
        assert getattr(goal.prospect, name) <= limit < getattr(fewer, name)


@given(
    st.integers(2, 20),
    st.integers(2, 20),
    st.floats(0.0, 400.0),
    st.floats(0.0, 100.0),
    st.integers(1, 500),
)
def test_more_votes_never_tell_less(
    contestants: int, experts: int, spread: float, effect: float, votes: int
) -> None:
    asked = replace(
        NINE,
        contestants=contestants,
        experts=experts,
        scenarios=20,
        spread=spread,
        ties=10.0,
        expert_sd=effect,
        scenario_sd=effect,
    )
    fewer, more = prospect(asked, votes), prospect(asked, 2 * votes)
    assert more.half_width <= fewer.half_width * 1.0001
    assert more.widest <= fewer.widest * 1.0001


def test_one_pair_of_known_variance_is_found_where_a_normal_value_has_it() -> None:
    design = replace(NINE, contestants=2, experts=400, scenarios=4000, ties=0.0)
    found = prospect(design, 1000)
    error = 2.0 * found.half_width / ndtri(0.975)  # the two differ by twice what one is off
    wanted = (ndtri(1.0 - 0.05 / CAUTION / 2.0) + ndtri(0.8)) * error
    assert found.gap == pytest.approx(wanted, rel=0.01)
    many = prospect(replace(design, contestants=9), 36_000)
    assert many.gap / many.half_width > found.gap / found.half_width


def test_the_largest_of_normal_values_is_the_tabled_one() -> None:
    """Order statistics of Harter 1961."""
    assert [round(_largest_of(n), 4) for n in (2, 5, 9)] == [0.5642, 1.1630, 1.4850]


def test_repeats_and_checks_take_time_on_top() -> None:
    found = prospect(NINE, 100)
    assert found.votes == 900
    assert found.minutes == pytest.approx(21.4)


def test_ties_that_contestants_so_far_apart_can_not_reach_are_refused() -> None:
    with pytest.raises(InvalidDocument, match="ties: is below 31 for contestants so far apart"):
        foretell(replace(NINE, ties=90.0, spread=900.0))


@pytest.mark.parametrize(("scenario_sd", "expert_sd"), [(0.0, 80.0), (100.0, 0.0)])
def test_effects_of_past_votes_are_found_where_they_are(
    scenario_sd: float, expert_sd: float
) -> None:
    world = World(
        ratings=paper_ratings(), scenario_sd=scenario_sd, expert_sd=expert_sd, votes_per_expert=200
    )
    pulled = np.ptp(world.truth()) / np.ptp(world.ratings)
    found = [estimate_effects(world.votes(np.random.default_rng(seed))) for seed in range(6)]
    seen = [(one["scenario"], one["expert"]) for one in found if one is not None]
    scenarios, experts = np.mean(seen, axis=0)
    assert scenarios == pytest.approx(pulled * scenario_sd, abs=22.0)
    assert experts == pytest.approx(pulled * expert_sd, abs=15.0)
