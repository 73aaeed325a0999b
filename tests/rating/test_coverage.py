"""A small coverage study; the large one is tests/benchmarks/coverage_study.py."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Intervals, rate
from tests.benchmarks.coverage_study import DEFAULT, PAPERS, PLAIN, RESAMPLED, Found, study
from tests.benchmarks.worlds import THRESHOLDS, World, paper_ratings

EQUAL = np.full(9, 1000.0)


def test_without_effects_and_ties_the_truth_is_the_ratings() -> None:
    """Thresholds pull the scores of all pairs towards a half, so ratings lie closer together."""
    centred = paper_ratings() - paper_ratings().mean()
    truth = World(ratings=paper_ratings()).truth() - 1000.0
    assert np.corrcoef(truth, centred)[0, 1] == pytest.approx(1.0, abs=1e-5)
    # The slope of (1 + win - loss) / 2 at equality, over that of the logistic.
    slope = 4.0 * (THRESHOLDS / (1.0 + THRESHOLDS) ** 2).mean()
    assert truth[0] / centred[0] == pytest.approx(slope, rel=0.01)


@pytest.fixture(scope="module")
def differing() -> Found:
    """Scenarios and few experts that differ: 250 studies give 95 %, 97 %, 92 % and 54 %."""
    world = World(
        ratings=paper_ratings(), scenario_sd=100.0, expert_sd=80.0, experts=5, votes_per_expert=200
    )
    return study(world, studies=30)


def test_the_default_covers_where_experts_are_few_and_differ(differing: Found) -> None:
    assert 0.91 < differing.intervals[DEFAULT].coverage < 0.99


def test_the_default_is_narrower_than_a_sandwich_of_each_contestant_alone(
    differing: Found,
) -> None:
    widths = {name: tally.half_width for name, tally in differing.intervals.items()}
    assert widths[DEFAULT] < 0.88 * widths[PLAIN]
    assert widths[DEFAULT] > 1.5 * widths[PAPERS]


def test_single_votes_claim_too_much_there(differing: Found) -> None:
    assert differing.intervals[PAPERS].coverage < 0.85


def test_independent_votes_are_not_taken_for_dependent_ones() -> None:
    """Resampled both ways such intervals were half as wide again, and held 99.7 %."""
    world = World(ratings=paper_ratings(), experts=12, votes_per_expert=100)
    found = study(world, studies=12)
    assert found.intervals[PAPERS].half_width * 1.25 > found.intervals[DEFAULT].half_width
    assert found.intervals[RESAMPLED].half_width > 1.3 * found.intervals[DEFAULT].half_width


def test_equals_judged_by_three_experts_of_strong_tastes_are_hardly_ever_told_apart() -> None:
    """By percentiles of two-way resamples it was every third study."""
    world = World(ratings=EQUAL, expert_sd=80.0, experts=3, votes_per_expert=100)
    found = study(world, studies=30, methods=())
    assert found.false <= 4
    assert found.ranks_held >= 0.95 * found.ranked


def test_the_effects_of_a_world_show_in_its_votes() -> None:
    world = World(ratings=np.full(3, 1000.0), expert_sd=300.0, experts=4, votes_per_expert=120)
    votes = world.votes(np.random.default_rng(1))
    score = np.where(votes.first < votes.second, votes.score, 1.0 - votes.score)
    of_pair = np.minimum(votes.first, votes.second) + np.maximum(votes.first, votes.second) == 1
    means = [score[of_pair & (votes.expert == one)].mean() for one in range(4)]
    assert np.ptp(means) > 0.3


@pytest.mark.parametrize(("experts", "shown"), [(3, False), (4, False), (5, True)])
def test_no_pair_is_marked_where_experts_are_too_few_to_judge_all_at_once(
    experts: int, shown: bool
) -> None:
    world = World(ratings=np.linspace(700.0, 1300.0, 5), experts=experts, votes_per_expert=60)
    board = rate(world.votes(np.random.default_rng(1)), rounds=100)
    assert (board.told_apart is not None) == shown


def test_resamples_of_votes_that_hang_together_mark_no_pair() -> None:
    votes = World(ratings=EQUAL, experts=9, votes_per_expert=40).votes(np.random.default_rng(1))
    for unit in (Unit.VOTE, Unit.TWO_WAY):
        board = rate(votes, unit=unit, intervals=Intervals.RESAMPLES, rounds=50)
        assert board.told_apart is None


@pytest.mark.parametrize("unit", Unit)
def test_a_unit_that_takes_hanging_votes_for_independent_marks_no_pair(unit: Unit) -> None:
    """Six equals, six experts of strong tastes: by single votes four pairs were marked."""
    world = World(ratings=np.full(6, 1000.0), expert_sd=200.0, experts=6, votes_per_expert=100)
    votes = world.votes(np.random.default_rng(1))
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=50)
    assert (board.experts, board.scenarios > 1) == (6, True)
    assert (board.told_apart is not None) == (unit is Unit.TWO_WAY)


@pytest.mark.parametrize("unit", Unit)
def test_a_unit_marks_pairs_where_nothing_else_hangs_together(unit: Unit) -> None:
    world = World(ratings=np.linspace(700.0, 1300.0, 5), experts=6, votes_per_expert=60)
    votes = replace(world.votes(np.random.default_rng(1)), scenario=np.zeros(360, dtype=int))
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=50)
    assert (board.told_apart is not None) == (unit in (Unit.EXPERT, Unit.TWO_WAY))
