"""Thousands of contestants: the same answers as with matrices of all of them."""

from __future__ import annotations

import numpy as np
import pytest

from arena.rating import bradley_terry
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import Meetings
from arena.rating.comparisons import BoolArray, Comparisons, IntArray, count_pairs
from arena.rating.leaderboard import Intervals, rate
from arena.rating.many import ManyFitted, SparseCurvature, fit_many
from arena.rating.moderated import spread_of
from arena.rating.pulls import bradley_terry_pulls
from arena.rating.reach import loose_rounds
from arena.rating.rules import LARGEST_DENSE
from arena.rating.sketched import variances_of
from tests.rating.votes import fit, simulated


def a_crowd(contestants: int = 200, votes: int = 8000) -> Comparisons:
    elo = np.random.default_rng(7).normal(1000.0, 100.0, contestants).tolist()
    return simulated(elo, votes, 5, experts=60, scenarios=40)


def fitted(votes: Comparisons) -> ManyFitted:
    counts = count_pairs(votes)
    return fit_many(len(votes.names), counts.low, counts.high, counts.games, counts.scores)


def test_strengths_are_those_of_newton_with_matrices() -> None:
    votes = a_crowd()
    found = fitted(votes)
    assert found.strengths == pytest.approx(fit(votes), abs=1e-8)


def test_equations_are_solved_as_by_the_inverse() -> None:
    votes = a_crowd(60, 900)
    counts = count_pairs(votes)
    met = Meetings(contestants=60, low=counts.low, high=counts.high)
    inverse = bradley_terry.inverse_curvature(met, counts.games, np.zeros(60))
    wanted = np.random.default_rng(1).normal(size=(60, 5))
    wanted -= wanted.mean(axis=0)
    curvature = SparseCurvature(60, counts.low, counts.high, counts.games / 4.0)
    assert curvature.solve(wanted, tolerance=1e-12) == pytest.approx(inverse @ wanted, abs=1e-9)


@pytest.mark.parametrize("unit", list(Unit))
def test_widths_are_those_of_the_closed_form_to_a_few_percent(unit: Unit) -> None:
    votes = a_crowd()
    counts = count_pairs(votes)
    met = Meetings(contestants=200, low=counts.low, high=counts.high)
    strengths = fit(votes)
    inverse = bradley_terry.inverse_curvature(met, counts.games, strengths)
    dense = spread_of(votes, bradley_terry_pulls(votes, strengths, inverse), unit)
    everybody: BoolArray = np.ones(200, dtype=np.bool_)
    found = variances_of(votes, fitted(votes), unit, everybody, seed=3)
    ratio = found.half_widths() / dense.half_widths()
    assert ratio.mean() == pytest.approx(1.0, abs=0.01)
    assert np.abs(ratio - 1.0).max() < 0.12, "eighty votes each: the sketch's remainder is large"
    again = variances_of(votes, fitted(votes), unit, everybody, seed=3)
    assert (again.variance == found.variance).all()


def with_a_champion(votes: Comparisons, wins: int) -> Comparisons:
    """One more contestant, who beat so many of the others and nobody else met."""
    champion: IntArray = np.full(wins, len(votes.names))
    beaten: IntArray = np.arange(wins)
    return Comparisons(
        names=(*votes.names, "champion"),
        first=np.concatenate([votes.first, champion]),
        second=np.concatenate([votes.second, beaten]),
        score=np.concatenate([votes.score, np.ones(wins)]),
        expert=np.concatenate([votes.expert, beaten]),
        scenario=np.concatenate([votes.scenario, beaten]),
    )


def test_above_two_thousand_contestants_no_matrix_of_all_is_kept() -> None:
    contestants = LARGEST_DENSE + 1
    votes = with_a_champion(a_crowd(contestants, 60_000), 30)
    board = rate(votes, rounds=20, workers=2)
    assert board.intervals is Intervals.CLOSED_FORM
    assert (board.covariance, board.separation) == (None, None)
    fine = [line for line in board.lines if line.lower is not None and line.upper is not None]
    assert len(fine) > 0.98 * contestants
    for line in fine[:50]:
        assert line.rating is not None
        assert (line.rank_best or 0) <= (line.rank or 1)
    champion = board.lines[-1]
    assert (champion.rating, champion.rank, champion.upper) == (None, 1, None)
    assert champion.lower is not None
    # Of 30 wins at least 88 % may be expected, against rivals of 1000 on average.
    assert champion.lower == pytest.approx(1000.0 + 400.0 * np.log10(0.884 / 0.116), abs=80.0)


def test_threads_change_nothing() -> None:
    votes = a_crowd(40, 160)
    counts = count_pairs(votes)
    tree = np.empty(0, dtype=np.int64)
    once, twice = (
        loose_rounds(
            votes, counts, tree, np.zeros(40), unit=Unit.TWO_WAY, rounds=30, seed=1, workers=number
        )
        for number in (1, 3)
    )
    assert once[0] == twice[0]
    assert once[1].in_main.shape[1] > 0
    assert (once[1].in_main == twice[1].in_main).all()
    assert (once[1].side == twice[1].side).all()


def test_what_rounding_leaves_of_a_slope_is_no_fault() -> None:
    """At the answer of these votes the slope was never small against itself."""
    elo = np.random.default_rng(11).normal(1000, 100, 60).tolist()
    votes = simulated(elo, 900, 11)
    assert fitted(votes).strengths == pytest.approx(fit(votes), abs=1e-8)
