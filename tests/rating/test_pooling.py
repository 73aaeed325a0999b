"""Partial pooling over types: by scipy's optimiser, by integration, and in its closed cases."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT
from arena.rating.comparisons import Comparisons, FloatArray, IntArray, select_votes
from arena.rating.pooling import GRID_ELO, fit_penalised, pool_types
from tests.rating.votes import fit, named, simulated, versus

RATINGS = [1050.0, 1010, 990, 950]


def a_study(votes: int = 500) -> tuple[Comparisons, IntArray]:
    found = simulated(RATINGS, votes, 3, scenarios=30)
    return found, found.scenario % 3


def by_an_optimiser(votes: Comparisons, type_of: IntArray, deviation: float) -> FloatArray:
    def strengths(given: FloatArray) -> tuple[FloatArray, FloatArray]:
        common, own = given[:3], given[3:].reshape(3, 3)
        common, own = np.append(common, -common.sum()), np.c_[own, -own.sum(axis=1)]
        return common + own, own

    def loss(given: FloatArray) -> float:
        of_types, own = strengths(given)
        rows = of_types[type_of]
        every = np.arange(len(votes))
        lead = rows[every, votes.first] - rows[every, votes.second]
        likelihood = (votes.score * lead - np.logaddexp(0.0, lead)).sum()
        return float((own**2).sum() / (2.0 * deviation**2) - likelihood)

    return strengths(minimize(loss, np.zeros(12), tol=1e-12).x)[0]


@pytest.mark.parametrize("deviation", [0.1, 0.5])
def test_strengths_are_where_an_optimiser_finds_them(deviation: float) -> None:
    votes, type_of = a_study()
    found = fit_penalised(votes, type_of, 3, deviation=deviation)
    assert found == pytest.approx(by_an_optimiser(votes, type_of, deviation), abs=1e-6)


def test_without_differences_every_type_is_the_whole_and_with_large_ones_it_is_its_own() -> None:
    votes, type_of = a_study()
    alike = fit_penalised(votes, type_of, 3, deviation=0.0)
    assert alike == pytest.approx(np.tile(fit(votes), (3, 1)), abs=1e-9)
    apart = fit_penalised(votes, type_of, 3, deviation=1e4)
    own = [fit(select_votes(votes, type_of == number)) for number in range(3)]
    assert apart == pytest.approx(np.array(own), abs=1e-4)


def test_of_two_contestants_the_answer_is_that_of_an_integral() -> None:
    # One difference a type: the integral over it and the common one can be summed on a grid.
    sheets = [versus("a", "b", *counts) for counts in ((30, 0, 10), (25, 0, 15), (14, 0, 26))]
    votes = named([vote for sheet in sheets for vote in sheet])
    type_of = np.repeat(np.arange(3), 40)
    votes = replace(votes, expert=np.arange(120), scenario=np.arange(120))
    found = pool_types(votes, type_of, 3, Unit.VOTE)
    assert found is not None
    spread, middle = np.linspace(-3.0, 3.0, 601), np.linspace(-2.0, 2.0, 201)
    wins = np.array([30, 25, 14])
    # Strengths are plus and minus x / 2 around zero: the difference x has root two the deviation.
    height = wins[:, None] * spread - 40.0 * np.logaddexp(0.0, spread)
    # Tempered as the votes show: the sandwich's variance over that of independent votes.
    whole = fit(votes)
    lead = whole[0] - whole[1]
    share = 1.0 / (1.0 + np.exp(-lead))
    dispersion = float(
        ((np.repeat([1, 0], [69, 51]) - share) ** 2).sum() / (120 * share * (1 - share))
    )
    height /= dispersion
    grid = GRID_ELO / ELO_PER_LOGIT
    weights, means = [], []
    for deviation in grid:
        scale = np.sqrt(2.0) * deviation
        if scale == 0.0:
            likely = np.exp(
                (wins.sum() * middle - 120 * np.logaddexp(0, middle)) / dispersion
                - height.max(axis=1).sum()
            )
            weights.append(likely.sum())
            means.append([(likely * middle).sum() / likely.sum()] * 3)
            continue
        near = (
            np.exp(-((spread - middle[:, None]) ** 2) / (2 * scale**2))
            / scale
            / np.sqrt(2 * np.pi)
        )
        each = np.exp(height - height.max(axis=1, keepdims=True))
        inner = near @ each.T * (spread[1] - spread[0])
        product = inner.prod(axis=1)
        weights.append(product.sum())
        means.append(
            [
                (
                    product
                    / inner[:, one]
                    * (near @ (each[one] * spread))
                    * (spread[1] - spread[0])
                ).sum()
                / product.sum()
                for one in range(3)
            ]
        )
    trusted = GRID_ELO >= 8.0  # below, the grid of the integral is too coarse
    trusted[0] = True
    weight = np.array(weights) * np.gradient(grid)
    weight[~trusted] = (
        np.interp(GRID_ELO[~trusted], GRID_ELO[trusted], np.array(weights)[trusted])
        * np.gradient(grid)[~trusted]
    )
    table = np.array(means)
    table[~trusted] = table[0]
    mean = weight @ table / weight.sum()
    gaps = (found.rating[:, 0] - found.rating[:, 1]) / ELO_PER_LOGIT
    assert gaps == pytest.approx(mean, abs=0.02)  # Laplace's approximation


def test_a_type_without_scores_on_one_side_has_a_finite_interval_towards_the_others() -> None:
    votes, type_of = a_study(150)
    lopsided = replace(
        votes,
        score=np.where(
            (type_of == 2) & ((votes.first == 0) | (votes.second == 0)),
            np.where(votes.first == 0, 1.0, 0.0),
            votes.score,
        ),
    )
    found = pool_types(lopsided, type_of, 3, Unit.TWO_WAY)
    assert found is not None
    assert np.isfinite(found.rating).all()
    assert np.isfinite(found.upper).all()
    # It won all there, and is drawn back to what it is elsewhere.
    assert found.rating[2, 0] > found.rating[:2, 0].max()
    assert found.rating[2, 0] < 1500.0


def test_a_type_with_few_votes_borrows_more() -> None:
    votes, type_of = a_study(1500)
    rare = np.flatnonzero(type_of == 2)[30:]
    kept = np.setdiff1d(np.arange(len(votes)), rare)
    votes, type_of = select_votes(votes, kept), type_of[kept]
    found = pool_types(votes, type_of, 3, Unit.TWO_WAY)
    assert found is not None
    whole = 1000.0 + ELO_PER_LOGIT * fit(votes)
    away = np.abs(found.rating - whole).mean(axis=1)
    width = (found.upper - found.lower).mean(axis=1)
    own = 1000.0 + ELO_PER_LOGIT * np.array(
        [fit(select_votes(votes, type_of == number)) for number in range(3)]
    )
    assert away[2] < 0.5 * np.abs(own - whole).mean(axis=1)[2]
    assert width[2] > width[:2].max()


def test_nobody_is_pooled_whom_the_votes_of_all_types_do_not_determine() -> None:
    votes = named(versus("a", "b", 5, 0, 0))
    assert pool_types(votes, np.arange(5) % 2, 2, Unit.VOTE) is None
