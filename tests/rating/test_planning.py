"""What is foretold of a study, against simulated ones and against what is known by hand."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtri

from arena.rating.leaderboard import rate
from arena.rating.planning import (
    Question,
    StudyDesign,
    _largest_of,
    estimate_effects,
    foretell,
    prospect,
)
from arena.rating.ranking import CAUTION
from bench.worlds import World, paper_ratings

NINE = StudyDesign(contestants=9, experts=9, scenarios=50, tie_share=0.4)
ASKED = Question(design=NINE, half_width=25.0, gap=40.0)


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
        tie_share=world.tie_share(),
        expert_sd=world.shown_expert_sd(),
        scenario_sd=float(pulled * world.scenario_sd),
    )
    found = []
    for seed in range(12):
        board = rate(world.votes(np.random.default_rng(seed)), rounds=200, seed=seed)
        found += [(line.upper or 0.0) - (line.lower or 0.0) for line in board.lines]
    foretold = prospect(replace(ASKED, design=design), votes).half_width
    assert np.mean(found) / 2.0 == pytest.approx(foretold, rel=0.08)


def test_independent_votes_of_equals_have_the_variance_known_by_hand() -> None:
    """4 (1 - t) (C - 1)^2 / (C^2 n) squared logits, n votes a contestant."""
    of_each = 2 * 100_000
    logits = np.sqrt(4.0 * 0.6 * (8 / 9) ** 2 / of_each)
    by_hand = 1.96 * logits * 400.0 / np.log(10.0)
    many = replace(NINE, experts=1000, scenarios=10_000)
    found = prospect(replace(ASKED, design=many), 9 * 100).half_width
    assert found == pytest.approx(by_hand, rel=3e-3)


def test_no_number_of_votes_makes_up_for_few_experts() -> None:
    design = StudyDesign(contestants=9, experts=4, scenarios=50, expert_sd=60.0)
    asked = Question(design=design, half_width=40.0, gap=500.0)
    wish = foretell(asked).narrow
    assert wish.prospect is None
    assert wish.most.widest > 40.0 > 60.0 * np.sqrt(8 / 9 / 4)
    assert wish.scenarios is None
    assert wish.experts is not None

    def widest(experts: int) -> float:
        larger = replace(asked, design=replace(design, experts=experts))
        return prospect(larger, design.units).widest

    assert widest(wish.experts) <= 40.0 < widest(wish.experts - 1)


def test_the_votes_asked_for_are_the_fewest() -> None:
    found = foretell(replace(ASKED, gap=60.0))
    for wish, numbers in ((found.narrow, "widest"), (found.apart, "gap")):
        assert wish.prospect is not None
        fewer = prospect(ASKED, wish.prospect.votes_per_expert - 1)
        limit = 25.0 if numbers == "widest" else 60.0
        assert getattr(wish.prospect, numbers) <= limit < getattr(fewer, numbers)


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
    design = StudyDesign(
        contestants=contestants,
        experts=experts,
        scenarios=20,
        spread=spread,
        tie_share=0.1,
        expert_sd=effect,
        scenario_sd=effect,
    )
    asked = replace(ASKED, design=design)
    fewer, more = prospect(asked, votes), prospect(asked, 2 * votes)
    assert more.half_width <= fewer.half_width * 1.0001
    assert more.widest <= fewer.widest * 1.0001


def test_one_pair_of_known_variance_is_found_where_a_normal_value_has_it() -> None:
    design = StudyDesign(contestants=2, experts=400, scenarios=4000, tie_share=0.0)
    found = prospect(replace(ASKED, design=design), 1000)
    error = 2.0 * found.half_width / ndtri(0.975)  # the two differ by twice what one is off
    wanted = (ndtri(1.0 - 0.05 / CAUTION / 2.0) + ndtri(0.8)) * error
    assert found.gap == pytest.approx(wanted, rel=0.01)
    many = prospect(replace(ASKED, design=replace(design, contestants=9)), 36_000)
    assert many.gap / many.half_width > found.gap / found.half_width


def test_the_largest_of_normal_values_is_the_tabled_one() -> None:
    """Order statistics of Harter 1961."""
    assert [round(_largest_of(n), 4) for n in (2, 5, 9)] == [0.5642, 1.1630, 1.4850]


def test_agreement_needs_pairs_that_two_judge() -> None:
    assert prospect(ASKED, 100).agreement is None
    some = replace(ASKED, design=replace(NINE, overlap_share=0.2), extra_share=0.07)
    found = prospect(some, 100)
    assert found.agreement == pytest.approx(1.96 * 0.5 / np.sqrt(150), rel=1e-3)
    assert (found.judged_twice, found.votes) == (150, 900)
    assert found.minutes == pytest.approx(21.4)


@pytest.mark.parametrize(
    ("wrong", "allowed"),
    [
        ({"contestants": 1}, "2 or more"),
        ({"experts": 1}, "2 or more"),
        ({"spread": -1.0}, "0 or more"),
        ({"overlap_share": 1.1}, "0 to 1"),
        ({"tie_share": 0.9, "spread": 900.0}, "below 0.31"),
        ({"tie_share": 1.0}, "below 1.00"),
    ],
)
def test_what_no_study_can_be_is_refused(wrong: dict[str, float], allowed: str) -> None:
    with pytest.raises(ValueError, match=allowed):
        replace(NINE, **wrong)  # type: ignore[arg-type]


@pytest.mark.parametrize(("scenario_sd", "expert_sd"), [(0.0, 80.0), (100.0, 0.0)])
def test_effects_of_past_votes_are_found_where_they_are(
    scenario_sd: float, expert_sd: float
) -> None:
    world = World(
        ratings=paper_ratings(), scenario_sd=scenario_sd, expert_sd=expert_sd, votes_per_expert=200
    )
    pulled = np.ptp(world.truth()) / np.ptp(world.ratings)
    found = [estimate_effects(world.votes(np.random.default_rng(seed))) for seed in range(6)]
    seen = [(one.scenario_sd, one.expert_sd) for one in found if one is not None]
    scenarios, experts = np.mean(seen, axis=0)
    assert scenarios == pytest.approx(pulled * scenario_sd, abs=22.0)
    assert experts == pytest.approx(pulled * expert_sd, abs=15.0)
