"""What is foretold of a study, against simulated ones and against what is known by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri

from arena.rating.leaderboard import rate
from arena.rating.ranking import CAUTION
from arena.studies.services.outlook import (
    Prospect,
    StudyEstimate,
    _expect_largest,
    compare_votes,
    prospect,
)
from bench.worlds import World

NINE = StudyEstimate(
    contestants=9,
    experts=9,
    scenarios=50,
    votes_per_expert=100,
    overlap=0.0,
    spread=0.0,
    ties=40.0,
    expert_sd=0.0,
    scenario_sd=0.0,
)


def of(design: StudyEstimate, votes: int) -> Prospect:
    return prospect(replace(design, votes_per_expert=votes))


@pytest.mark.parametrize(
    ("effects", "votes"), [((0.0, 0.0), 200), ((100.0, 40.0), 200), ((0.0, 80.0), 40)]
)
def test_half_widths_are_those_of_simulations(effects: tuple[float, float], votes: int) -> None:
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
    foretold = of(design, votes).half_width
    assert np.mean(found) / 2.0 == pytest.approx(foretold, rel=0.08)


def test_independent_votes_of_equals_have_the_variance_known_by_hand() -> None:
    """4 (1 - t) (C - 1)^2 / (C^2 n) squared logits, n votes a contestant."""
    of_each = 2 * 100_000
    logits = np.sqrt(4.0 * 0.6 * (8 / 9) ** 2 / of_each)
    by_hand = 1.96 * logits * 400.0 / np.log(10.0)
    many = replace(NINE, experts=1000, scenarios=10_000)
    found = of(many, 9 * 100).half_width
    assert found == pytest.approx(by_hand, rel=3e-3)


def test_no_number_of_votes_makes_up_for_few_experts() -> None:
    asked = replace(NINE, experts=4, expert_sd=60.0)
    assert of(asked, asked.most_votes).half_width > 60.0 * np.sqrt(8 / 9 / 4)


def test_half_to_four_times_the_votes_are_compared_and_never_more_than_there_are() -> None:
    few = replace(NINE, contestants=2, votes_per_expert=20)
    assert [one.votes_per_expert for one, _ in compare_votes(few)] == [10, 20, 40, 50]
    assert not compare_votes(replace(few, experts=1))


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
    fewer, more = of(asked, votes), of(asked, 2 * votes)
    assert more.half_width <= fewer.half_width * 1.0001
    assert more.widest <= fewer.widest * 1.0001


def test_one_pair_of_known_variance_is_found_where_a_normal_value_has_it() -> None:
    design = replace(NINE, contestants=2, experts=400, scenarios=4000, ties=0.0)
    found = of(design, 1000)
    error = 2.0 * found.half_width / ndtri(0.975)  # the two differ by twice what one is off
    wanted = (ndtri(1.0 - 0.05 / CAUTION / 2.0) + ndtri(0.8)) * error
    assert found.gap == pytest.approx(wanted, rel=0.01)
    many = of(replace(design, contestants=9), 36_000)
    assert many.gap / many.half_width > found.gap / found.half_width


def test_the_largest_of_normal_values_is_the_tabled_one() -> None:
    """Order statistics of Harter 1961."""
    assert [round(_expect_largest(n), 4) for n in (2, 5, 9)] == [0.5642, 1.1630, 1.4850]


def test_repeats_and_checks_take_time_on_top() -> None:
    assert NINE.votes == 900
    assert NINE.minutes == pytest.approx(21.4)
