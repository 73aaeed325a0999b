"""A small coverage study; the large one is bench/coverage_study.py."""

from dataclasses import replace

import numpy as np
import pytest

from arena.rating.leaderboard import Intervals, rate
from arena.rating.rules import Unit
from bench.claims import board_worlds, measure_boards, measure_claims, write_sentence
from bench.coverage_study import SINGLE, Found, study
from bench.worlds import World, paper_ratings
from tests.rating.votes import Comparison, named

EQUAL = np.full(9, 1000.0)


@pytest.fixture(scope="module")
def differing() -> Found:
    """Scenarios and few experts that differ: 300 studies give 95 % and 71 %."""
    world = World(
        ratings=paper_ratings(), scenario_sd=100.0, expert_sd=80.0, experts=5, votes_per_expert=200
    )
    return study(world, studies=60)


@pytest.mark.slow
def test_the_default_covers_where_experts_are_few_and_differ(differing: Found) -> None:
    assert 0.92 < differing.coverage() < 0.98


def test_single_votes_claim_too_much_there(differing: Found) -> None:
    assert differing.coverage(SINGLE) < 0.85


@pytest.mark.slow
def test_independent_votes_are_not_taken_for_dependent_ones() -> None:
    """Resampled both ways such intervals are half as wide again, and hold 99.7 %."""
    world = World(ratings=paper_ratings(), experts=12, votes_per_expert=100)
    assert 0.92 < study(world, studies=40).coverage() < 0.985


@pytest.mark.parametrize(
    "world",
    [
        World(ratings=EQUAL, expert_sd=80.0, experts=3, votes_per_expert=100),
        World(ratings=EQUAL, scenarios=5, experts=9, votes_per_expert=100),
    ],
    ids=["strong tastes", "five scenarios"],
)
def test_equals_are_hardly_ever_told_apart(world: World) -> None:
    """By percentiles of two-way resamples it was every third study, and before effects of at
    least nothing were drawn 7 % with five scenarios."""
    assert study(world, studies=60, judge=True).false <= 0.05


def test_a_table_that_rests_on_few_experts_or_scenarios_says_so() -> None:
    for experts, scenarios, said in (
        (4, 10, ["Only 4 experts: intervals that rest on fewer than 5 of them are rough."]),
        (5, 9, ["Only 9 scenarios: intervals that rest on fewer than 10 of them are rough."]),
        (5, 10, []),
    ):
        world = World(ratings=EQUAL, experts=experts, scenarios=scenarios, votes_per_expert=90)
        votes = world.votes(np.random.default_rng(1))
        board = rate(votes, intervals=Intervals.CLOSED_FORM, rounds=50)
        assert list(board.warnings) == said


@pytest.mark.parametrize(("experts", "shown"), [(3, False), (4, False), (5, True)])
def test_no_pair_is_marked_where_experts_are_too_few_for_all(experts: int, shown: bool) -> None:
    world = World(ratings=np.linspace(700.0, 1300.0, 5), experts=experts, votes_per_expert=60)
    board = rate(world.votes(np.random.default_rng(1)), rounds=100)
    assert (board.told_apart is not None) == shown


def test_resamples_of_votes_that_hang_together_mark_no_pair() -> None:
    votes = World(ratings=EQUAL, experts=9, votes_per_expert=40).votes(np.random.default_rng(1))
    assert rate(votes, unit=Unit.VOTE, rounds=50).told_apart is None


@pytest.mark.parametrize("unit", Unit)
def test_a_unit_that_takes_hanging_votes_for_independent_marks_no_pair(unit: Unit) -> None:
    """Six equals, six experts of strong tastes: by single votes four pairs were marked."""
    world = World(ratings=np.full(6, 1000.0), expert_sd=200.0, experts=6, votes_per_expert=100)
    votes = world.votes(np.random.default_rng(1))
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=50)
    assert (board.experts, board.scenarios > 1) == (6, True)
    assert (board.told_apart is not None) == (unit is Unit.TWO_WAY)


@pytest.mark.parametrize("unit", Unit)
@pytest.mark.parametrize("alone", ["expert", "scenario"])
def test_one_expert_or_scenario_speaks_for_no_whole_table(unit: Unit, alone: str) -> None:
    """A unit that does not name what there is one of may be of votes that nobody names by it."""
    world = World(ratings=np.linspace(700.0, 1300.0, 5), experts=6, votes_per_expert=60)
    votes = world.votes(np.random.default_rng(1))
    votes = replace(votes, **{alone: np.zeros(360, dtype=int)})  # type: ignore[arg-type]
    board = rate(votes, unit=unit, intervals=Intervals.CLOSED_FORM, rounds=50)
    is_known = len(unit.kinds) == 1 and alone not in unit.kinds
    assert (board.told_apart is not None) == is_known
    assert {line.rank_best is not None for line in board.lines} == {is_known}


@pytest.mark.slow
@pytest.mark.parametrize(
    "world",
    [
        World(ratings=EQUAL, experts=3, votes_per_expert=60),
        World(ratings=EQUAL, experts=2, votes_per_expert=60, uneven=1.5),
        World(ratings=EQUAL, experts=5, scenarios=2, votes_per_expert=60, scenario_sd=100.0),
    ],
    ids=["three experts", "two uneven ones", "two scenarios"],
)
def test_the_sentence_calls_no_equal_better(world: World) -> None:
    """By intervals that do not overlap it did in 13 to 21 %."""
    assert measure_claims(world, studies=60)["sentence"] <= 0.05


def test_who_loses_all_direct_votes_is_worse_where_that_is_no_chance() -> None:
    wins = [
        Comparison(first="a", second="b", score=1.0, expert=f"{n}", scenario=f"{n}")
        for n in range(9)
    ]
    assert write_sentence(rate(named(wins))) == "a is better than b with 9 votes."
    assert write_sentence(rate(named(wins[:4]))) == "a and b can’t be told apart with 4 votes."


@pytest.mark.slow
def test_a_boards_intervals_hold_for_founders_and_newcomers() -> None:
    held = measure_boards(board_worlds()[0], studies=60)
    assert 0.92 <= held["founders"] <= 0.98
    assert 0.92 <= held["newcomers"] <= 0.99
