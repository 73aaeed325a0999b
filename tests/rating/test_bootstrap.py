"""Intervals that keep what they promise."""

from dataclasses import replace

import numpy as np
import pytest

from arena.rating.bootstrap import resample, rounds_to_draw
from arena.rating.comparisons import Comparisons, PairCounts, count_pairs
from arena.rating.leaderboard import Intervals, rate
from arena.rating.rules import Unit
from tests.rating.votes import by_votes, named, simulated, versus

TRUTH = [1060.0, 1020.0, 1000.0, 980.0, 940.0]


def test_vote_intervals_cover_the_truth_when_votes_are_independent() -> None:
    covered = []
    for seed in range(80):
        board = by_votes(simulated(TRUTH, 500, seed), rounds=300, seed=seed)
        for line, truth in zip(board.lines, TRUTH, strict=True):
            covered.append(line.lower <= truth <= line.upper)
    assert 0.92 < np.mean(covered) < 0.975


def test_two_contestants_have_the_binomial_interval() -> None:
    """60 of 100: the normal interval of the logit is ln(1.5) +- 1.96 sqrt(1/24)."""
    board = by_votes(named(versus("a", "b", 60, 0, 40)), rounds=20_000, seed=1)
    line = board.lines[0]
    half = 173.72 * 1.96 * np.sqrt(1 / 24) / 2
    assert line.rating == pytest.approx(1035.2, abs=0.1)
    assert line.lower == pytest.approx(line.rating - half, abs=3)
    assert line.upper == pytest.approx(line.rating + half, abs=3)


@pytest.mark.parametrize("seen", [[0, 1, 3, 40, 200, 1000], [100_000, 4, 0], [2, 1, 0]])
def test_single_votes_are_drawn_as_by_a_multinomial(seen: list[int]) -> None:
    counts = PairCounts(
        low=np.arange(len(seen) // 3),
        high=np.arange(len(seen) // 3) + 1,
        outcomes=np.array(seen).reshape(3, -1).T,
        pair_of=np.empty(0, dtype=np.int64),
        outcome_of=np.empty(0, dtype=np.int64),
    )
    blocks = resample(simulated(TRUTH, 1, 1), counts, unit=Unit.VOTE, rounds=20_000, seed=2)
    games, scores, ties = zip(*((one.games, one.scores, one.ties) for one in blocks), strict=True)
    assert (np.hstack(games).sum(axis=0) == sum(seen)).all()
    shares = np.array(seen).reshape(3, -1) / sum(seen)
    for drawn, share in ((games, shares.sum(axis=0)), ([ties], shares[1].sum(keepdims=True))):
        expected, variance = sum(seen) * share, sum(seen) * share * (1.0 - share)
        error = 4.0 * np.sqrt(variance / 20_000) + 1e-9
        assert np.abs(np.hstack(drawn).mean(axis=-1) - expected).max(initial=0.0) <= error.max()
        assert np.hstack(drawn).var(axis=-1) == pytest.approx(variance, rel=0.04)
    assert np.hstack(scores).mean(axis=1) == pytest.approx(
        sum(seen) * (shares[0] + 0.5 * shares[1]), rel=0.02
    )


def test_votes_that_agree_within_scenarios_widen_the_scenario_interval() -> None:
    votes = simulated(TRUTH, 2000, 1, scenarios=20)
    # The same scenario always gives the same answer: 2000 votes are worth 20.
    score = (votes.scenario % 2).astype(float)
    low_first = votes.first < votes.second
    clustered = replace(votes, score=np.where(low_first, score, 1 - score))

    def width(unit: Unit) -> float:
        line = by_votes(clustered, rounds=500, unit=unit, seed=3).lines[0]
        return line.upper - line.lower

    assert width(Unit.SCENARIO) > 3 * width(Unit.VOTE)
    assert width(Unit.TWO_WAY) > 3 * width(Unit.VOTE)


def test_a_vote_counts_as_often_as_its_expert_times_its_scenario_is_drawn() -> None:
    """A vote a cell, each of a pair of its own: what a pair has is its cell's weight."""
    experts, scenarios, contestants = 3, 4, 6
    cells = experts * scenarios
    first, second = (one[:cells] for one in np.triu_indices(contestants, 1))
    score = np.resize([0.0, 0.5, 1.0, 0.5, 0.5], cells)
    votes = Comparisons(
        names=tuple(f"c{number:02d}" for number in range(contestants)),
        first=first,
        second=second,
        score=score,
        expert=np.repeat(np.arange(experts), scenarios),
        scenario=np.tile(np.arange(scenarios), experts),
    )
    drawn = list(resample(votes, count_pairs(votes), unit=Unit.TWO_WAY, rounds=30, seed=4))
    games = np.hstack([one.games for one in drawn])
    scores = np.hstack([one.scores for one in drawn])
    assert scores.tolist() == (games * score[:, None]).tolist()
    ties = np.concatenate([one.ties for one in drawn])
    assert ties.tolist() == games[score == 0.5].sum(axis=0).tolist()
    weight = games.reshape(experts, scenarios, 30)
    of_expert, of_scenario = weight.sum(axis=1) / scenarios, weight.sum(axis=0) / experts
    assert (weight == of_expert[:, None] * of_scenario[None]).all()
    assert (of_expert.sum(axis=0) == experts).all()
    assert (of_scenario.sum(axis=0) == scenarios).all()
    assert len(np.unique(games, axis=1).T) > 20


SPREAD = [1400.0, 1200.0, 1100.0, 1000.0, 900.0, 600.0]


@pytest.mark.parametrize("unit", Unit)
def test_bounds_are_open_for_the_same_by_all_kinds_of_intervals(unit: Unit) -> None:
    others = Intervals.RESAMPLES if unit is Unit.VOTE else Intervals.BOOTSTRAP
    for seed in range(6):
        votes = simulated(SPREAD, 90, seed, ties=0.1)
        boards = [
            rate(votes, unit=unit, intervals=way, rounds=600, seed=seed)
            for way in (Intervals.CLOSED_FORM, others)
        ]
        ends = [
            [(line.lower is None, line.upper is None) for line in board.lines] for board in boards
        ]
        assert ends[0] == ends[1], seed
        assert boards[0].degenerate_rounds == boards[1].degenerate_rounds


def test_fewer_rounds_are_drawn_where_one_takes_long() -> None:
    small, large = simulated(SPREAD, 500, 1), simulated(SPREAD, 200_000, 1, experts=5000)
    assert rounds_to_draw(small, count_pairs(small), 10_000) == 10_000
    assert 200 <= rounds_to_draw(large, count_pairs(large), 10_000) < 10_000
