"""Who is determined where intervals are in closed form, and what that takes."""

from __future__ import annotations

import numpy as np
import pytest

from arena.rating.bootstrap import Unit, is_certain, rounds_to_draw
from arena.rating.comparisons import count_pairs
from arena.rating.leaderboard import Intervals, rate
from arena.rating.sandwich import _squares
from tests.rating.votes import simulated

SPREAD = [1400.0, 1200.0, 1100.0, 1000.0, 900.0, 600.0]


@pytest.mark.parametrize("unit", Unit)
def test_bounds_are_open_for_those_for_whom_resamples_leave_them_open(unit: Unit) -> None:
    """The same who by intervals of resamples, where every round is rated."""
    for seed in range(12):
        votes = simulated(SPREAD, 90, seed, ties=0.1)
        boards = [
            rate(votes, unit=unit, intervals=way, rounds=600, seed=seed) for way in Intervals
        ]
        ends = [
            [(line.lower is None, line.upper is None) for line in board.lines] for board in boards
        ]
        assert ends[0] == ends[1], seed
        assert boards[0].degenerate_rounds == boards[1].degenerate_rounds


def test_many_scores_of_many_experts_need_no_resamples() -> None:
    votes = simulated([1000.0, 1010.0, 990.0], 6000, 1, experts=90, scenarios=90)
    assert is_certain(votes, count_pairs(votes))


def test_fewer_rounds_are_drawn_where_one_takes_long() -> None:
    small, large = simulated(SPREAD, 500, 1), simulated(SPREAD, 200_000, 1, experts=5000)
    assert rounds_to_draw(small, count_pairs(small), 10_000) == 10_000
    assert 200 <= rounds_to_draw(large, count_pairs(large), 10_000) < 10_000


@pytest.mark.parametrize(("clusters", "size"), [(40, 6), (70_000, 40)])
def test_squares_of_clusters_are_those_of_their_sums(clusters: int, size: int) -> None:
    rng = np.random.default_rng(1)
    place = rng.integers(0, clusters, 3000) * size + rng.integers(0, size, 3000)
    place[:900] = 7 * size + rng.integers(0, size, 900)  # one cluster pulls at nearly all
    pulls = rng.normal(size=3000)
    sums = np.zeros((clusters, size))
    np.add.at(sums.reshape(-1), place, pulls)
    assert _squares(place, pulls, clusters, size) == pytest.approx(sums.T @ sums)
