"""Intervals that keep what they promise, in the time that they may take."""

from __future__ import annotations

import time

import numpy as np
import pytest

from arena.rating.bootstrap import Unit
from arena.rating.leaderboard import Method, rate
from tests.rating.votes import named, simulated, versus

TRUTH = [1060.0, 1020.0, 1000.0, 980.0, 940.0]


def test_vote_intervals_cover_the_truth_when_votes_are_independent() -> None:
    covered = []
    for seed in range(80):
        board = rate(simulated(TRUTH, 500, seed), rounds=300, seed=seed)
        for line, truth in zip(board.lines, TRUTH, strict=True):
            assert line.lower is not None
            assert line.upper is not None
            covered.append(line.lower <= truth <= line.upper)
    assert 0.92 < np.mean(covered) < 0.975


def test_two_contestants_have_the_binomial_interval() -> None:
    """60 of 100: the normal interval of the logit is ln(1.5) +- 1.96 sqrt(1/24)."""
    board = rate(named(versus("a", "b", 60, 0, 40)), rounds=20_000, seed=1)
    line = board.lines[0]
    half = 173.72 * 1.96 * np.sqrt(1 / 24) / 2
    assert line.rating == pytest.approx(1035.2, abs=0.1)
    assert line.lower == pytest.approx(line.rating - half, abs=3)
    assert line.upper == pytest.approx(line.rating + half, abs=3)


def test_votes_that_agree_within_scenarios_widen_the_scenario_interval() -> None:
    votes = simulated(TRUTH, 2000, 1, scenarios=20)
    # The same scenario always gives the same answer: 2000 votes are worth 20.
    score = (votes.scenario % 2).astype(float)
    low_first = votes.first < votes.second
    clustered = type(votes)(
        names=votes.names,
        first=votes.first.copy(),
        second=votes.second.copy(),
        score=np.where(low_first, score, 1 - score),
        expert=votes.expert.copy(),
        scenario=votes.scenario.copy(),
    )

    def width(unit: Unit) -> float:
        line = rate(clustered, rounds=500, unit=unit, seed=3).lines[0]
        assert line.lower is not None
        assert line.upper is not None
        return line.upper - line.lower

    assert width(Unit.SCENARIO) > 3 * width(Unit.VOTE)
    assert width(Unit.TWO_WAY) > 3 * width(Unit.VOTE)


@pytest.mark.parametrize(
    ("method", "unit", "limit_s"),
    [
        (Method.BRADLEY_TERRY, Unit.VOTE, 0.4),
        (Method.BRADLEY_TERRY, Unit.TWO_WAY, 0.4),
        (Method.ELO, Unit.VOTE, 2.0),
    ],
)
def test_a_thousand_rounds_of_the_papers_size_take_no_time(
    method: Method, unit: Unit, limit_s: float
) -> None:
    """Tens of milliseconds on a quiet machine, a few hundred for online Elo."""
    votes = simulated([1042, 1039, 1025, 1011, 1003, 998, 984, 953, 941], 5760, 1, ties=0.6)
    rate(votes, method=method, unit=unit, rounds=10)
    started = time.process_time()
    rate(votes, method=method, unit=unit, rounds=1000)
    assert time.process_time() - started < limit_s
