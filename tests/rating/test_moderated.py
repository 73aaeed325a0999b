"""Variances in closed form against a linear model, and against what ratings do when simulated."""

from __future__ import annotations

import numpy as np
import pytest

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import to_elo
from arena.rating.moderated import left_of_effect, spread_of
from bench.worlds import World
from tests.rating.test_sandwich import pulls_of
from tests.rating.votes import fit

STUDIES = 250


@pytest.mark.parametrize(
    ("shares", "left"),
    [
        ((1.0,), 0.0),
        ((0.5, 0.5), 0.5),  # even clusters: 1 - 1 / G
        ((0.25,) * 4, 0.75),
        ((0.05,) * 20, 0.95),
        ((0.7, 0.3), 0.58 - 2.0 * 0.37 / 0.58 + 1.0),
        ((0.5, 0.2, 0.2, 0.1), None),
        ((0.9, 0.1), 0.5 * 0.18),  # 0.04 without the floor
    ],
)
def test_what_the_fit_leaves_is_that_of_a_weighted_mean(
    shares: tuple[float, ...], left: float | None
) -> None:
    """The residuals w (u - w'u) of effects u with variance 1, over the variance of w'u."""
    share = np.array(shares)
    residual = np.diag(share) @ (np.eye(len(share)) - np.outer(np.ones(len(share)), share))
    exact = np.trace(residual @ residual.T) / (share @ share)
    found = left_of_effect(np.array([share @ share]), np.array([(share**3).sum()]))[0]
    assert found == pytest.approx(exact if left is None else left)
    assert found >= exact - 1e-12


@pytest.mark.parametrize(
    "world",
    [
        {"scenarios": 3, "scenario_sd": 100.0, "experts": 9, "votes_per_expert": 90},
        {"experts": 9, "votes_per_expert": 150, "expert_sd": 80.0, "uneven": 1.0},
        {"experts": 9, "votes_per_expert": 100, "expert_sd": 40.0},
        {"experts": 9, "votes_per_expert": 100},
    ],
    ids=["three scenarios", "uneven experts", "even experts", "independent votes"],
)
def test_variances_are_those_of_simulated_ratings(world: dict[str, float]) -> None:
    """Before, three scenarios gave 0.72 of the variance and uneven experts 0.79."""
    ratings, variances = [], []
    for seed in range(STUDIES):
        votes = World(ratings=np.full(9, 1000.0), **world).votes(np.random.default_rng(seed))  # type: ignore[arg-type]
        spread = spread_of(votes, pulls_of(votes), Unit.TWO_WAY)
        ratings.append(to_elo(fit(votes)))
        variances.append(spread.covariance.diagonal())
    truth = np.mean(np.square(np.array(ratings) - 1000.0))
    assert 0.92 < np.mean(variances) / truth < 1.08
