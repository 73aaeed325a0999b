"""Votes that bound some contestants on one side only, or not at all: the others keep theirs."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import pytest

from arena.rating.bootstrap import percentile_interval
from arena.rating.chains import Status
from arena.rating.comparisons import Comparisons
from arena.rating.leaderboard import Intervals, Leaderboard, Line, Method, fill_lines, rate
from arena.rating.parts import RatedGroup
from arena.rating.ranking import decide_ranks, ranks
from arena.rating.rules import Unit
from tests.rating.votes import Comparison, by_votes, named, versus

NINE = tuple("abcdefghi")
POINTS = 400.0 / np.log(10.0)


def nine_of(wins: int, ties: int, losses: int) -> list[Comparison]:
    """Nine contestants, each a bit better than the next one."""
    return [
        vote
        for place, (one, other) in enumerate(combinations(NINE, 2))
        for vote in versus(one, other, wins + place % 3, ties, losses)
    ]


def spread(votes: list[Comparison], *, experts: int = 9, scenarios: int = 40) -> Comparisons:
    """The votes over experts and scenarios in turn."""
    turns = enumerate(votes)
    return named(
        [replace(v, expert=f"e{n % experts}", scenario=f"s{n * 7 % scenarios}") for n, v in turns]
    )


def line_of(board: Leaderboard, name: str) -> Line:
    return next(line for line in board.lines if line.name == name)


@pytest.mark.parametrize("unit", Unit)
def test_one_contestant_with_six_votes_takes_nothing_from_nine_others(unit: Unit) -> None:
    rest = nine_of(13, 6, 7)
    few = versus("x", "a", 1, 0, 0) + versus("x", "e", 1, 0, 1) + versus("x", "i", 2, 0, 1)
    # Seeds move ends of intervals by effects more than the newcomer does.
    way = Intervals.RESAMPLES if unit is Unit.VOTE else Intervals.CLOSED_FORM
    alone = rate(spread(rest), unit=unit, intervals=way, rounds=2000, seed=1)
    board = rate(spread(rest + few), unit=unit, intervals=way, rounds=2000, seed=1)
    assert board.degenerate_rounds > 0.025 * 2000
    assert board.status is Status.OPEN_INTERVALS
    assert {line.rank for line in alone.lines} != {1}
    shift = np.mean([line.rating or 0.0 for line in board.lines if line.name != "x"]) - 1000.0
    for before in alone.lines:
        now = line_of(board, before.name)
        assert now.rank == before.rank
        assert now.lower == pytest.approx(before.lower + shift, abs=4.0)
        assert now.upper == pytest.approx(before.upper + shift, abs=4.0)
        assert now.note == ""
    newcomer = line_of(board, "x")
    assert (newcomer.rank, newcomer.upper) == (None, None)
    assert newcomer.note
    assert "for x:" in board.explanation


def test_a_weak_contestant_has_an_upper_bound_and_stands_third() -> None:
    """300 votes at 80 : 20, 297 : 3 and 300 : 0; no vote of the weak one matters to the others."""
    votes = (
        versus("strong", "mid", 240, 0, 60)
        + versus("mid", "weak", 297, 0, 3)
        + versus("strong", "weak", 300, 0, 0)
    )
    board = by_votes(named(votes), rounds=4000)
    assert board.degenerate_rounds > 0.025 * 4000
    strong, mid, weak = board.standings
    assert [line.rank for line in board.standings] == [1, 2, 3]
    assert [line.name for line in board.standings] == ["strong", "mid", "weak"]
    # Between the two: half the interval of a logit, 1.96 sqrt(1 / 240 + 1 / 60).
    half = POINTS * 1.96 * np.sqrt(1 / 240 + 1 / 60) / 2
    for line in (strong, mid):
        assert line.lower == pytest.approx(line.rating - half, abs=3.0)
        assert line.upper == pytest.approx(line.rating + half, abs=3.0)
    assert weak.lower is None
    assert weak.upper < mid.lower
    assert weak.note == "no lower bound: hardly any score"


@pytest.mark.parametrize("score", [1.0, 0.0])
def test_who_beat_everybody_stands_first_and_who_lost_to_everybody_last(score: float) -> None:
    wins, losses = int(20 * score), int(20 - 20 * score)
    votes = [vote for name in NINE for vote in versus("x", name, wins, 0, losses)]
    lines = list(by_votes(named(nine_of(12, 6, 7) + votes), rounds=500).standings)
    extreme = lines.pop(0 if score else -1)
    assert (extreme.name, extreme.rank) == ("x", 1 if score else 10)
    assert (extreme.rating, extreme.lower, extreme.upper) == (None, None, None)
    assert extreme.note == ("no upper limit" if score else "no lower limit")
    assert min(line.rank or 0 for line in lines) == (2 if score else 1)


@pytest.mark.parametrize(("votes", "ranks_"), [(5, [None, None]), (6, [1, 2])])
def test_six_wins_of_six_tell_two_apart_and_five_do_not(
    votes: int, ranks_: list[int | None]
) -> None:
    board = by_votes(named(versus("a", "b", votes, 0, 0)))
    assert [line.rank for line in board.standings] == ranks_
    assert ["no rank" in line.note for line in board.standings] == [votes == 5] * 2


@pytest.mark.parametrize(("experts", "rank"), [(5, None), (6, 1)])
def test_votes_of_few_experts_count_as_few(experts: int, rank: int | None) -> None:
    votes = spread(versus("a", "b", 300, 0, 0), experts=experts)
    of_one_of_nine = spread(40 * [*versus("a", "b", 1, 0, 0), *versus("b", "c", 4, 0, 4)])
    assert rate(of_one_of_nine, rounds=50).lines[0].rank is None
    assert rate(votes, unit=Unit.TWO_WAY, rounds=50).standings[0].rank == rank
    assert by_votes(votes, rounds=50).standings[0].rank == 1


def test_losers_of_a_lower_group_are_not_first() -> None:
    upper, lower = versus("a", "b", 30, 10, 12), versus("c", "d", 40, 10, 10)
    between = versus("a", "c", 30, 0, 0) + versus("b", "d", 30, 0, 0)
    board = by_votes(named(upper + lower + between))
    ranks = [(line.name, line.rank) for line in board.standings]
    assert ranks == [("a", 1), ("b", 2), ("c", 3), ("d", 4)]


def test_one_lucky_win_over_the_best_takes_nobody_s_rank() -> None:
    board = by_votes(named(nine_of(12, 6, 7) + versus("x", "a", 1, 0, 0)), rounds=300)
    assert (board.standings[-1].name, board.standings[-1].rank) == ("x", None)
    assert "no rank" in board.standings[-1].note
    assert board.standings[0].rank == 1


def test_a_pair_at_nineteen_to_one_has_an_open_bound_each() -> None:
    """More than a third of the resamples miss the one vote: there the gap has no limit."""
    board = by_votes(named(versus("a", "b", 19, 0, 1)), rounds=2000, seed=1)
    assert 600 < board.degenerate_rounds < 840
    one, other = board.standings
    assert [line.rank for line in board.standings] == [1, 2]
    assert (one.upper, other.lower) == (None, None)
    # Of binomial(20, 0.05) 1.6 % are four or more, 7.5 % three or more: the bound is 17 : 3.
    assert one.lower == pytest.approx(1000.0 + POINTS * np.log(17 / 3) / 2.0, abs=1e-3)


@pytest.mark.parametrize("method", [Method.BRADLEY_TERRY, Method.DAVIDSON])
def test_groups_within_a_round_are_rated_as_if_alone(method: Method) -> None:
    """c's only win is missing from a third of the rounds; a and b are told apart all the same."""
    votes = versus("a", "b", 70, 20, 30) + versus("b", "c", 59, 0, 1) + versus("a", "c", 60, 0, 0)
    board = by_votes(named(votes), method=method, rounds=2000)
    alone = by_votes(named(versus("a", "b", 70, 20, 30)), method=method, rounds=2000)
    for name in ("a", "b"):
        found, before = line_of(board, name), line_of(alone, name)
        width = (before.upper or 0.0) - (before.lower or 0.0)
        assert found.upper - found.lower == pytest.approx(width, rel=0.12)
        assert found.rank == before.rank
    assert line_of(board, "c").lower is None


# --- The pieces ----------------------------------------------------------------------------------


def test_bounds_that_touch_do_not_tell_two_apart() -> None:
    assert ranks([5.0, 2.0], [7.0, 5.0]).tolist() == [1, 1]
    assert ranks([np.nextafter(5.0, 6.0), 2.0], [7.0, 5.0]).tolist() == [1, 2]


def test_a_rank_needs_bounds_that_decide_it() -> None:
    for lower, upper, expected in (
        ([10.0, -10.0], [20.0, 0.0], [1, 2]),
        ([10.0, -10.0], [np.nan, 0.0], [1, 2]),
        ([0.0, -10.0], [np.nan, 5.0], [0, 1]),  # a lower bound at the average is not above it
        ([0.1, -10.0], [np.nan, 5.0], [1, 1]),
        ([10.0, np.nan], [20.0, 9.0], [1, 2]),
        ([10.0, np.nan], [20.0, 10.0], [1, 0]),
        ([10.0, np.nan], [20.0, np.nan], [1, 0]),
        ([np.nan, np.nan], [np.nan, np.nan], [0, 0]),
    ):
        assert decide_ranks(np.array(lower), np.array(upper), average=0.0).tolist() == expected


@pytest.mark.parametrize(
    ("below", "unknown", "above", "has_lower", "has_upper"),
    [
        (0, 0, 0, True, True),
        (25, 0, 25, True, True),
        (26, 0, 0, False, True),
        (0, 0, 26, True, False),
        (0, 26, 0, False, False),
        (13, 13, 0, False, True),
        (13, 12, 13, True, True),
    ],
)
def test_a_bound_is_finite_only_if_it_is_whatever_is_unknown(
    below: int, unknown: int, above: int, has_lower: bool, has_upper: bool
) -> None:
    """Of 1001 rounds the 26th from either end is the bound."""
    known = np.linspace(-1.0, 1.0, 1001 - below - unknown - above)
    ends = [np.full(below, -np.inf), np.full(unknown, np.nan), np.full(above, np.inf)]
    values = np.random.default_rng(1).permutation(np.concatenate([known, *ends]))[None]
    lower, upper = percentile_interval(values)
    assert (np.isfinite(lower[0]), np.isfinite(upper[0])) == (has_lower, has_upper)
    if has_lower:
        assert lower[0] == known[25 - below - unknown]
    if has_upper:
        assert upper[0] == known[::-1][25 - above - unknown]


def test_a_new_column_of_a_part_reaches_the_line_by_its_name() -> None:
    @dataclass(frozen=True, kw_only=True)
    class WiderLine(Line):
        width: float | None = None

    @dataclass(frozen=True, kw_only=True)
    class WiderRated(RatedGroup):
        width: object

    lines: list[Line] = [WiderLine(name=name, rank=7) for name in "abc"]
    part = WiderRated(note=("", "open"), rank=np.array([1, 0]), width=np.array([5.0, np.nan]))
    fill_lines(lines, np.array([2, 0]), 3, part)
    assert lines == [
        WiderLine(name="a", part=3, note="open"),
        WiderLine(name="b", rank=7),
        WiderLine(name="c", part=3, rank=1, width=5.0),
    ]
