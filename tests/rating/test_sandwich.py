"""The closed-form cross-check, against formulas, packages and the bootstrap."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
import statsmodels.api as sm

from arena.rating import sandwich
from arena.rating.bootstrap import Unit
from arena.rating.bradley_terry import ELO_PER_LOGIT, Meetings, inverse_curvature
from arena.rating.comparisons import Comparisons, FloatArray, count_pairs
from arena.rating.estimate import t_above, t_quantile
from arena.rating.leaderboard import Intervals, rate
from arena.rating.sandwich import Pulls, bradley_terry_pulls
from tests.rating.votes import fit, simulated

ARENA_RANK = json.loads((Path(__file__).parent / "arena_rank.json").read_text())
TRUTH = [1060.0, 1020.0, 1000.0, 980.0, 940.0]


def covariance(votes: Comparisons, unit: Unit) -> FloatArray:
    return sandwich.covariance(votes, pulls_of(votes), unit)


def pulls_of(votes: Comparisons) -> Pulls:
    counts, strengths = count_pairs(votes), fit(votes)
    met = Meetings(contestants=len(votes.names), low=counts.low, high=counts.high)
    inverse = inverse_curvature(met, counts.games, strengths)
    return bradley_terry_pulls(votes, strengths, inverse)


@pytest.mark.parametrize("degrees", [1.0, 1.3, 2.0, 3.0, 8.0, 19.0, 57.4, 4000.0, 1e6])
def test_students_t_is_scipys(degrees: float) -> None:
    theirs = scipy.stats.t(degrees)
    assert t_quantile(degrees) == pytest.approx(theirs.ppf(0.975), rel=1e-6)
    values = np.array([0.0, 0.3, 1.0, 2.5, 6.0])
    assert t_above(values, degrees) == pytest.approx(theirs.sf(values), rel=1e-5, abs=1e-100)


def test_the_factor_is_the_normals_where_clusters_are_many() -> None:
    assert sandwich.factor(None) == pytest.approx(scipy.stats.norm.ppf(0.975))
    assert sandwich.factor(9) == pytest.approx(2.306, abs=1e-3)


@pytest.mark.parametrize("unit", [Unit.EXPERT, Unit.SCENARIO])
def test_one_way_clusters_are_statsmodels(unit: Unit) -> None:
    votes = simulated(TRUTH, 1500, 2, ties=0.0)
    design = np.zeros((len(votes), len(TRUTH)))
    rows = np.arange(len(votes))
    design[rows, votes.first], design[rows, votes.second] = 1.0, -1.0
    groups = votes.expert if unit is Unit.EXPERT else votes.scenario
    fitted = sm.GLM(votes.score, design[:, 1:], family=sm.families.Binomial()).fit(
        cov_type="cluster", cov_kwds={"groups": groups, "use_correction": False}
    )
    # Theirs hold the first at zero; differences of the others must have the same variance.
    theirs = ELO_PER_LOGIT**2 * fitted.cov_params()
    clusters = len(np.unique(groups))
    ours = covariance(votes, unit)[1:, 1:] * (clusters - 1) / clusters
    for one in range(3):
        contrast = np.zeros(4)
        contrast[one], contrast[one + 1] = 1.0, -1.0
        assert contrast @ ours @ contrast == pytest.approx(contrast @ theirs @ contrast, rel=1e-4)


def test_two_ways_are_the_one_and_the_other_without_what_is_in_both() -> None:
    votes = simulated(TRUTH, 1500, 2)
    cells = replace(votes, expert=votes.expert * 1000 + votes.scenario)
    by_expert, by_scenario = covariance(votes, Unit.EXPERT), covariance(votes, Unit.SCENARIO)
    wanted = by_expert + by_scenario - covariance(cells, Unit.EXPERT)
    assert np.linalg.eigvalsh(wanted).min() > -1e-6  # else its negative parts would be cut off
    assert covariance(votes, Unit.TWO_WAY) == pytest.approx(wanted)


@pytest.mark.parametrize("unit", [Unit.VOTE, Unit.SCENARIO])
def test_the_bootstrap_agrees_where_clusters_are_many(unit: Unit) -> None:
    votes = simulated(TRUTH, 4000, 3, scenarios=200)
    for line in rate(votes, unit=unit, intervals=Intervals.RESAMPLES, rounds=4000).lines:
        assert line.lower == pytest.approx(line.check_lower, abs=1.5)
        assert line.upper == pytest.approx(line.check_upper, abs=1.5)


def test_rows_of_a_covariance_add_to_zero_and_the_board_carries_it() -> None:
    votes = simulated(TRUTH, 800, 4)
    board = rate(votes, intervals=Intervals.RESAMPLES, rounds=200)
    assert board.covariance is not None
    assert board.covariance == pytest.approx(covariance(votes, Unit.TWO_WAY))
    assert np.abs(board.covariance.sum(axis=1)).max() < 1e-6


@pytest.mark.parametrize("name", [name for name in ARENA_RANK if name != "what"])
def test_ratings_and_intervals_agree_with_arena_rank(name: str) -> None:
    """Its stored answers, by `make bench`; intervals are symmetric and by single votes."""
    answer = ARENA_RANK[name]
    pairs = np.array(answer["pairs"])
    outcome = np.tile([1.0, 0.5, 0.0], len(pairs))
    counts = pairs[:, 2:].ravel()
    seen = counts > 0
    nobody = np.zeros(int(seen.sum()), dtype=np.int64)
    votes = Comparisons(
        names=tuple(f"c{index:03d}" for index in range(len(answer["rating"]))),
        first=np.repeat(pairs[:, 0], 3)[seen],
        second=np.repeat(pairs[:, 1], 3)[seen],
        score=outcome[seen],
        expert=nobody,
        scenario=nobody.copy(),
        count=counts[seen],
    )
    board = rate(votes, unit=Unit.VOTE, rounds=100)
    assert [line.rating for line in board.lines] == pytest.approx(answer["rating"], abs=0.05)
    assert [line.check_lower for line in board.lines] == pytest.approx(answer["lower"], abs=0.1)
    assert [line.check_upper for line in board.lines] == pytest.approx(answer["upper"], abs=0.1)
