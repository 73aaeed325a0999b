"""Ranks, their spread, and all pairs judged at once."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from statsmodels.stats.multitest import multipletests

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import rate
from arena.rating.ranking import holm, rank_interval, ranks, separation
from tests.rating.votes import simulated


def test_who_can_not_be_told_apart_shares_a_rank() -> None:
    assert ranks([5.0, 4.0, 0.0], [7.0, 6.0, 3.0]).tolist() == [1, 1, 3]
    assert ranks([-np.inf, 1.0], [np.inf, 2.0]).tolist() == [1, 1]


def test_a_rank_interval_holds_the_places_of_95_percent_of_the_rounds() -> None:
    samples = np.tile([[3.0], [2.0], [1.0]], (1, 100))
    samples[0, :4] = 1.5  # second in 4 of 100 rounds
    best, worst = rank_interval(samples)
    assert best.tolist() == [1, 1, 3]
    assert worst.tolist() == [2, 2, 3]


@pytest.mark.parametrize("seed", range(20))
def test_a_place_that_is_unknown_may_be_any(seed: int) -> None:
    """One round: every unknown rating is tried above and below everybody who is known."""
    rng = np.random.default_rng(seed)
    some = np.array([np.nan, np.inf, 3.0, 2.0, np.nan, -np.inf])[: 2 + seed % 5]
    ratings = rng.permutation(some)
    unknown = np.flatnonzero(np.isnan(ratings))
    order = np.array([np.searchsorted(np.sort(ratings), rating) for rating in ratings], float)
    places = []
    for ends in itertools.product((-1.0, 99.0), repeat=len(unknown)):
        order[unknown] = ends
        places.append([1 + (order > one).sum() for one in order])
    best, worst = rank_interval(ratings[:, None])
    assert best.tolist() == np.min(places, axis=0).tolist()
    assert worst.tolist() == np.max(places, axis=0).tolist()


def test_holm_is_statsmodels() -> None:
    p_values = np.array([0.01, 0.04, 0.03, 0.5, 0.004])
    theirs = multipletests(p_values, method="holm")[1]
    assert holm(p_values) == pytest.approx(theirs)


def test_equal_contestants_are_hardly_ever_told_apart() -> None:
    """Over 40 studies of nine equals some pair is separated in about 5 % of them, not in 60 %."""
    wrong = 0
    for seed in range(40):
        votes = simulated([1000.0] * 9, 1500, seed)
        found = rate(votes, unit=Unit.VOTE, rounds=500, seed=seed).separation
        assert found is not None
        wrong += bool(found.above.any())
    assert wrong <= 6


def test_clear_differences_are_told_apart_and_the_matrices_fit_each_other() -> None:
    rng = np.random.default_rng(1)
    rating = np.array([1100.0, 1000.0, 990.0])
    samples = rating[:, None] + rng.normal(0.0, 10.0, (3, 5000))
    found = separation(rating, samples)
    assert found.above.tolist() == [[False, True, True], [False] * 3, [False] * 3]
    assert found.critical > 1.96
    assert found.error[0, 1] == pytest.approx(10 * np.sqrt(2), rel=0.05)
    assert found.difference[0, 1] == 100.0
    assert (found.p_value == found.p_value.T).all()
    assert ((found.p_value < 0.05) == (found.above | found.above.T)).all()
    assert found.holm[1, 2] > 0.05 > found.holm[0, 1]
