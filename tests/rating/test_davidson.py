"""Davidson's tie model, and what it changes."""

import math

import pytest

from arena.rating.chains import Status
from arena.rating.leaderboard import Method, rate
from arena.rating.rules import Unit
from tests.rating.votes import by_votes, named, simulated, versus


def test_two_contestants_have_the_closed_form() -> None:
    """Proportions x : v sqrt(x y) : y of 40, 40 and 10 votes: x / y is 4, v is 40 / sqrt(400)."""
    board = by_votes(named(versus("a", "b", 40, 40, 10)), method=Method.DAVIDSON, rounds=200)
    high, low = (line.rating or 0.0 for line in board.lines)
    assert high - low == pytest.approx(400 * math.log10(4.0), abs=1e-6)
    assert board.tie_strength == pytest.approx(2.0, abs=1e-9)
    assert board.tie_share == pytest.approx(40 / 90)


def test_without_ties_it_is_bradley_terry() -> None:
    votes = simulated([1060.0, 1000.0, 940.0], 600, 1, ties=0.0)
    one, other = (by_votes(votes, method=m) for m in (Method.DAVIDSON, Method.BRADLEY_TERRY))
    assert [line.rating for line in one.lines] == [line.rating for line in other.lines]
    assert one.tie_strength is None


def test_it_has_intervals_by_every_unit() -> None:
    votes = simulated([1080.0, 1000.0, 920.0], 900, 3, ties=0.4)
    for unit in Unit:
        for line in rate(votes, method=Method.DAVIDSON, unit=unit, rounds=300).lines:
            assert line.lower < line.rating < line.upper


def test_scores_by_ties_only_are_no_limit_in_this_model_and_said_to_be_none() -> None:
    """a : v sqrt(a b) : b of 5, 3 and 0 votes: the last share can only go to zero."""
    votes = named(versus("a", "b", 5, 3, 0))
    board = by_votes(votes, method=Method.DAVIDSON, rounds=50)
    assert board.status is Status.UNBOUNDED
    assert "no finite ratings" in board.explanation
    assert all(line.rating is None and line.rank is None for line in board.lines)
    assert all(line.rating is not None for line in by_votes(votes).lines)
