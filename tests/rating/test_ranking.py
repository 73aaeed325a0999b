"""Ranks, their spread, and all pairs judged at once."""

import numpy as np
import pytest
from statsmodels.stats.multitest import multipletests

from arena.rating.leaderboard import Intervals, rate
from arena.rating.ranking import above_by_bounds, above_in_rounds, holm, rank_sets, ranks
from arena.rating.rules import Unit
from tests.rating.votes import simulated


def test_who_can_not_be_told_apart_shares_a_rank() -> None:
    assert ranks([5.0, 4.0, 0.0], [7.0, 6.0, 3.0]).tolist() == [1, 1, 3]
    assert ranks([-np.inf, 1.0], [np.inf, 2.0]).tolist() == [1, 1]


def test_a_rank_set_counts_who_is_shown_to_be_above_and_below() -> None:
    above = np.zeros((4, 4), dtype=bool)
    above[0, 2] = above[0, 3] = above[1, 3] = True
    best, worst = rank_sets(above)
    assert best.tolist() == [1, 1, 2, 3]
    assert worst.tolist() == [2, 3, 4, 4]


def test_bounds_tell_apart_who_has_one_alone() -> None:
    """The first two were judged at once; the third has no lower bound, the fourth none at all."""
    nan, nobody = np.nan, np.zeros((4, 4), dtype=bool)
    lower, upper = np.array([50.0, 40.0, nan, nan]), np.array([70.0, 45.0, 30.0, nan])
    assert np.argwhere(above_by_bounds(nobody, lower, upper)).tolist() == [[0, 2], [1, 2]]


def test_holm_is_statsmodels() -> None:
    p_values = np.array([0.01, 0.04, 0.03, 0.5, 0.004])
    theirs = multipletests(p_values, method="holm")[1]
    assert holm(p_values) == pytest.approx(theirs)


def test_equal_contestants_are_hardly_ever_told_apart() -> None:
    """Over 40 studies of nine equals some pair is separated in about 5 % of them, not in 60 %."""
    wrong = 0
    for seed in range(40):
        votes = simulated([1000.0] * 9, 1500, seed)
        found = rate(
            votes, unit=Unit.VOTE, intervals=Intervals.CLOSED_FORM, rounds=500, seed=seed
        ).separation
        wrong += bool(found.above.any())
    assert wrong <= 6


def test_rounds_tell_clear_differences_apart() -> None:
    rng = np.random.default_rng(1)
    rating = np.array([1100.0, 1000.0, 990.0])
    samples = rating[:, None] + rng.normal(0.0, 10.0, (3, 5000))
    above = above_in_rounds(rating, samples)
    assert above.tolist() == [[False, True, True], [False] * 3, [False] * 3]
    closer = above_in_rounds(np.array([1029.0, 1000.0, 1000.0]), samples)  # 2.05 errors of one
    assert not closer.any()
