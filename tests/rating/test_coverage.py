"""A small coverage study; the large one is tests/benchmarks/coverage_study.py."""

from __future__ import annotations

import numpy as np
import pytest

from arena.rating.bootstrap import Unit
from tests.benchmarks.coverage_study import CROSS_CHECK, World, paper_ratings, study

VOTE, TWO_WAY = "votes, paper mode", "two-way, default"


def test_without_effects_the_truth_is_the_ratings() -> None:
    centred = paper_ratings() - paper_ratings().mean() + 1000.0
    assert World(ratings=paper_ratings()).truth() == pytest.approx(centred, abs=1e-6)


def test_paper_mode_covers_what_it_says_where_votes_are_independent() -> None:
    """1,000 studies: 94.8 %. Here 70, so that the mean of 630 intervals has room."""
    world = World(ratings=paper_ratings())
    found = study(world, studies=70, rounds=400, units=(Unit.VOTE,))
    assert 0.92 < found[VOTE].coverage < 0.97


def test_two_way_covers_where_scenarios_and_experts_differ_and_single_votes_do_not() -> None:
    """1,000 studies: see docs/coverage.md."""
    world = World(ratings=paper_ratings(), scenario_sd=100.0, expert_sd=40.0)
    found = study(world, studies=40, rounds=400, units=(Unit.VOTE, Unit.TWO_WAY))
    assert found[TWO_WAY].coverage > 0.92
    assert found[CROSS_CHECK].coverage > 0.92
    assert found[VOTE].coverage < 0.75
    assert found[TWO_WAY].half_width > 2.0 * found[VOTE].half_width


def test_the_effects_of_a_world_show_in_its_votes() -> None:
    world = World(ratings=np.full(3, 1000.0), scenario_sd=300.0, scenarios=4)
    votes = world.votes(8000, np.random.default_rng(1))
    of_pair = (votes.first == 0) & (votes.second == 1)
    means = [votes.score[of_pair & (votes.scenario == one)].mean() for one in range(4)]
    assert np.ptp(means) > 0.3
