"""What is foretold of a study, against simulated ones and against what is known by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import ndtr, ndtri
from scipy.stats import studentized_range

from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.leaderboard import rate
from arena.rating.moderated import Spread
from arena.rating.planning import Question, estimate_effects, foretell, prospect, votes_for
from arena.rating.ranking import CAUTION
from arena.rating.sample_size import (
    PlannedPairs,
    StudyDesign,
    _largest_of,
    _level_of_all_pairs,
    agreement_error,
    expect,
    votes_per_expert_for,
)
from bench.study_size import design_of, world_of
from bench.worlds import World, paper_ratings

NINE = StudyDesign(contestants=9, experts=9, scenarios=50, tie_share=0.4)


@pytest.mark.parametrize(
    ("effects", "votes"), [((0.0, 0.0), 200), ((100.0, 40.0), 200), ((0.0, 80.0), 40)]
)
def test_half_widths_are_those_of_simulated_studies(
    effects: tuple[float, float], votes: int
) -> None:
    world = world_of(*effects, gap=15.0, experts=9)
    design = design_of(world)
    shorter = replace(world, votes_per_expert=votes)
    found = []
    for seed in range(12):
        board = rate(shorter.votes(np.random.default_rng(seed)), rounds=200, seed=seed)
        found += [(line.upper or 0.0) - (line.lower or 0.0) for line in board.lines]
    foretold = expect(design, 9 * votes).half_width
    assert np.mean(found) / 2.0 == pytest.approx(foretold, rel=0.08)


def test_independent_votes_of_equals_have_the_variance_known_by_hand() -> None:
    """4 (1 - t) (C - 1)^2 / (C^2 n) squared logits, n votes a contestant."""
    per_contestant = votes_for(contestants=9, half_width=20.0, tie_share=0.4)
    found = expect(NINE, per_contestant * 9 / 2)
    assert 1.96 * np.sqrt(found.covariance.diagonal()) == pytest.approx(20.0, rel=2e-3)


def test_no_number_of_votes_makes_up_for_few_experts() -> None:
    design = StudyDesign(contestants=9, experts=4, scenarios=50, expert_sd=60.0)
    floor = 60.0 * np.sqrt(8 / 9 / 4)
    assert np.sqrt(expect(design, 1e9).covariance[0, 0]) == pytest.approx(floor, rel=1e-3)
    asked = Question(design=design, half_width=40.0, gap=500.0)
    wish = foretell(asked).narrow
    assert wish.prospect is None
    assert wish.most.widest > 40.0
    assert wish.scenarios is None
    assert wish.experts is not None
    more = StudyDesign(contestants=9, experts=wish.experts, scenarios=50, expert_sd=60.0)
    assert expect(more, more.units * more.experts).widest <= 40.0
    fewer = StudyDesign(contestants=9, experts=wish.experts - 1, scenarios=50, expert_sd=60.0)
    assert expect(fewer, fewer.units * fewer.experts).widest > 40.0


def test_the_votes_asked_for_are_the_fewest() -> None:
    votes = votes_per_expert_for(NINE, lambda found: found.widest <= 25.0)
    assert votes is not None
    assert expect(NINE, 9 * votes).widest <= 25.0 < expect(NINE, 9 * (votes - 1)).widest


@given(
    st.integers(2, 20), st.integers(2, 20), st.floats(0.0, 400.0), st.floats(0.0, 100.0),
    st.integers(1, 500),
)  # fmt: skip
def test_more_votes_never_tell_less(
    contestants: int, experts: int, spread: float, effect: float, votes: int
) -> None:
    design = StudyDesign(
        contestants=contestants, experts=experts, scenarios=20, spread=spread, tie_share=0.1,
        expert_sd=effect, scenario_sd=effect,
    )  # fmt: skip
    fewer, more = expect(design, votes), expect(design, 2 * votes)
    assert more.half_width <= fewer.half_width * 1.0001
    assert more.widest <= fewer.widest * 1.0001


@pytest.mark.parametrize("contestants", [2, 5, 9, 30])
def test_all_pairs_share_the_error_as_the_studentized_range_has_it(contestants: int) -> None:
    limit = studentized_range.ppf(0.95, contestants, 1e7) / np.sqrt(2.0)
    assert _level_of_all_pairs(contestants) == pytest.approx(2 * ndtr(-limit), rel=1e-4)


def known_spread(contestants: int, variance: float) -> Spread:
    """Ratings whose variances are as good as known, with those of pairs twice as large."""
    covariance = variance * np.eye(contestants)
    return Spread(
        covariance=covariance,
        degrees=np.full(contestants, 1e9),
        common=covariance,
        base=covariance,
        plain=covariance,
        components=(),
    )


@pytest.mark.parametrize("gap", [20.0, 40.0, 55.0])
def test_one_pair_of_known_variance_is_found_as_often_as_a_normal_value_has_it(gap: float) -> None:
    error = np.sqrt(2.0 * 10.0**2)
    limit = ndtri(1.0 - 0.05 / CAUTION / 2.0)
    planned = PlannedPairs(known_spread(2, 100.0), np.array([30.0]))
    wanted = ndtr(gap / error - limit) + ndtr(-gap / error - limit)
    assert planned.power(gap) == pytest.approx(wanted, abs=0.12)
    assert planned.power(planned.gap_found(0.8)) >= 0.8


def test_one_pair_of_many_is_harder_to_find_than_a_single_one() -> None:
    design = replace(NINE, spread=320.0)
    planned = PlannedPairs(known_spread(9, 100.0), design.gaps() * ELO_PER_LOGIT)
    alone = PlannedPairs(known_spread(2, 100.0), np.array([40.0]))
    assert planned.gap_found(0.8) > alone.gap_found(0.8) + 3.0
    assert planned.power(80.0) > planned.power(40.0) > planned.power(20.0)


def test_votes_that_find_a_gap_are_those_at_which_it_is_found() -> None:
    design = replace(NINE, spread=120.0)
    votes = votes_per_expert_for(design, lambda found: found.tells_apart(60.0, power=0.8))
    assert votes is not None
    assert expect(design, 9 * votes).gap_found(power=0.8) == pytest.approx(60.0, abs=1.0)


def test_thresholds_of_experts_show_as_tastes_where_contestants_differ() -> None:
    """Nobody differs about equals; who calls few equal pulls others further apart."""
    found = [
        World(ratings=1000.0 + np.linspace(-span, span, 9)).shown_expert_sd()
        for span in (0.0, 60.0, 160.0)
    ]
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    assert found[0] < found[1] < found[2]
    assert World(ratings=paper_ratings(), expert_sd=30.0).shown_expert_sd() < 30.0


def test_the_largest_of_normal_values_is_the_tabled_one() -> None:
    """Order statistics of Harter 1961."""
    assert [round(_largest_of(n), 4) for n in (2, 5, 9)] == [0.5642, 1.1630, 1.4850]


def test_agreement_needs_pairs_that_two_judge() -> None:
    assert agreement_error(NINE, 900) is None
    some = StudyDesign(contestants=9, experts=9, scenarios=50, overlap_share=0.2)
    found = agreement_error(some, 900)
    assert found == pytest.approx(1.96 * 0.5 / np.sqrt(150), rel=1e-3)
    asked = Question(design=some, half_width=25.0, gap=40.0, seconds=12.0, extra_share=0.07)
    given_100 = prospect(asked, 100)
    assert (given_100.judged_twice, given_100.votes) == (150, 900)
    assert given_100.minutes == pytest.approx(21.4)


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
    fine = {"contestants": 9, "experts": 9, "scenarios": 50}
    with pytest.raises(ValueError, match=allowed):
        StudyDesign(**{**fine, **wrong})  # type: ignore[arg-type]


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
