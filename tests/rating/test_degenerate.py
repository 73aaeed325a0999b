"""Data that determine no rating say so; no number is made up."""

import math

import numpy as np
import pytest

from arena.rating.chains import Status
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Leaderboard, Method, rate
from arena.rating.rules import TooManyContestants, Unit
from tests.rating.votes import as_arrays, by_votes, named, versus


def unrated(board: Leaderboard) -> bool:
    return all(
        value is None
        for line in board.lines
        for value in (line.rating, line.lower, line.upper, line.rank)
    )


@pytest.mark.parametrize("method", Method)
def test_no_votes(method: Method) -> None:
    board = by_votes(as_arrays(("a", "b"), []), method=method)
    assert (board.status, board.explanation) == (Status.NO_VOTES, "There are no votes to rate.")
    assert unrated(board)
    assert [line.note for line in board.lines] == ["no votes", "no votes"]


def test_one_contestant_and_too_many() -> None:
    board = by_votes(as_arrays(("a",), []))
    assert board.status is Status.ONE_CONTESTANT
    assert "only one contestant, a" in board.explanation
    names = [f"c{number}" for number in range(2001)]
    with pytest.raises(TooManyContestants, match="not 2001"):
        rate(as_arrays(names, versus("c0", "c1", 1, 0, 0)))


def test_a_contestant_who_lost_everything_has_no_rating_and_the_rest_is_rated_alone() -> None:
    rest = versus("a", "b", 15, 3, 4)
    board = by_votes(named(rest + versus("a", "d", 20, 0, 0) + versus("b", "d", 20, 0, 0)))
    assert board.status is Status.UNBOUNDED
    assert board.explanation == (
        "Nobody else scored against a, b: there is no upper limit. "
        "d scored against nobody else: there is no lower limit."
    )
    *rated, lost = board.lines
    assert (lost.rating, lost.rank, lost.losses, lost.note) == (None, 3, 40, "no lower limit")
    alone = by_votes(named(rest))
    assert [line.rating for line in rated] == [line.rating for line in alone.lines]
    assert [line.lower for line in rated] == [line.lower for line in alone.lines]


def test_a_chain_of_winners_rates_nobody_and_says_what_is_missing() -> None:
    board = by_votes(named(versus("a", "b", 5, 0, 0) + versus("b", "c", 5, 0, 0)))
    assert board.status is Status.UNBOUNDED
    assert [(line.rating, line.rank) for line in board.lines] == [(None, None)] * 3
    assert [line.name for line in board.standings] == ["a", "b", "c"]
    for line, limit in zip(board.lines, ("upper limit", "limits", "lower limit"), strict=True):
        assert line.note.startswith(f"no {limit}")
        assert "no rank" in line.note


def test_online_elo_rates_what_bradley_terry_cannot() -> None:
    board = by_votes(named(versus("a", "b", 5, 0, 0)), method=Method.ELO, rounds=10)
    assert all(line.rating is not None for line in board.lines)
    # Every resample is five wins again.
    assert board.status is Status.NO_INTERVALS
    assert "No intervals can be given" in board.explanation


@pytest.mark.parametrize("method", Method)
def test_groups_that_never_met_are_rated_and_ranked_each_by_itself(method: Method) -> None:
    one, other = versus("a", "b", 30, 10, 12), versus("c", "d", 10, 40, 10)
    board = by_votes(named(one + other), method=method, rounds=100)
    assert board.status is Status.DISCONNECTED
    assert "compared with each other: a, b; c, d." in board.explanation
    assert [line.part for line in board.lines] == [0, 0, 1, 1]
    for part, votes in ((board.lines[:2], one), (board.lines[2:], other)):
        alone = by_votes(named(votes), method=method, rounds=100)
        assert [line.rating for line in part] == [line.rating for line in alone.lines]
        assert [line.rank for line in part] == [line.rank for line in alone.lines]
    assert board.separation is None


def test_all_ties_are_rated_alike_without_an_interval() -> None:
    board = by_votes(named(versus("a", "b", 0, 9, 0) + versus("b", "c", 0, 9, 0)))
    assert board.status is Status.ALL_TIES
    assert "Every vote is a tie" in board.explanation
    for line in board.lines:
        assert (line.rating, line.lower, line.upper, line.rank) == (1000.0, None, None, None)
        assert line.note == "no interval and no rank: the votes show nothing that differs"


def test_a_contestant_without_votes_leaves_the_others_rated() -> None:
    board = by_votes(named(versus("a", "b", 30, 20, 15), "a", "b", "z"))
    *rated, absent = board.lines
    assert all(line.rating is not None for line in rated)
    assert (absent.rating, absent.rank, absent.votes, absent.note) == (None, None, 0, "no votes")


def test_a_few_rounds_without_ratings_are_counted_and_leave_both_bounds() -> None:
    board = by_votes(named(versus("a", "b", 60, 0, 5)), rounds=2000, seed=1)
    assert 0 < board.degenerate_rounds < 50
    assert (board.status, board.explanation) == (Status.RATED, "")
    assert board.lines[0].lower is not None


@pytest.mark.parametrize("method", Method)
@pytest.mark.parametrize("score", ["win", "tie"])
def test_a_single_vote_has_no_interval_of_zero_width(method: Method, score: str) -> None:
    votes = versus("a", "b", 1, 0, 0) if score == "win" else versus("a", "b", 0, 1, 0)
    board = by_votes(named(votes), method=method, rounds=50)
    assert board.explanation
    assert board.status is not Status.RATED
    assert all(line.lower is None or line.upper is None for line in board.lines)
    assert all(line.rank is None for line in board.lines)


def test_rules_that_make_no_sense_are_refused() -> None:
    votes = named(versus("a", "b", 6, 0, 5))
    with pytest.raises(ValueError, match="at least 1 round, not 0"):
        by_votes(votes, rounds=0)
    with pytest.raises(ValueError, match="single votes only, not by scenario"):
        by_votes(votes, method=Method.ELO, unit=Unit.SCENARIO)


# --- Few and lopsided votes, by every method and unit -----------------------------------------


RULES = [
    (method, unit)
    for method in Method
    for unit in Unit
    if method is not Method.ELO or unit is Unit.VOTE
]


def few_votes(seed: int) -> Comparisons:
    rng = np.random.default_rng(seed)
    contestants, rows = int(rng.integers(2, 14)), int(rng.integers(1, 120))
    strengths = rng.normal(0.0, rng.choice([0.0, 1.0, 4.0]), contestants)
    first = rng.integers(0, contestants, rows)
    second = (first + rng.integers(1, contestants, rows)) % contestants
    wins = rng.random(rows) < 1.0 / (1.0 + np.exp(strengths[second] - strengths[first]))
    tied = rng.random(rows) < rng.choice([0.0, 0.3, 0.9])
    return Comparisons(
        names=tuple(f"c{index}" for index in range(contestants)),
        first=first,
        second=second,
        score=np.where(tied, 0.5, wins.astype(np.float64)),
        expert=rng.integers(0, int(rng.integers(1, 6)), rows),
        scenario=rng.integers(0, int(rng.integers(1, 30)), rows),
        count=rng.integers(1, int(rng.choice([2, 50])), rows),
    )


@pytest.mark.parametrize(("method", "unit"), RULES)
def test_every_line_has_finite_numbers_or_a_reason(method: Method, unit: Unit) -> None:
    for seed in range(30):
        board = rate(few_votes(seed), method=method, unit=unit, rounds=60, seed=seed)
        assert board.status is Status.RATED or board.explanation
        for line in board.lines:
            bounds = [line.lower, line.upper]
            assert all(math.isfinite(one) for one in (line.rating, *bounds) if one is not None)
            if None in (line.rating, line.rank, *bounds):
                assert line.note
                assert board.explanation
            if line.lower is not None and line.upper is not None:
                assert line.lower < line.upper
            if line.rank == 1 and line.lower is None:
                has_won_all = line.rating is None and line.wins >= 6 and line.wins == line.votes
                assert has_won_all or method is Method.DAVIDSON
