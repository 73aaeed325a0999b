"""What must not change a rating, and how the counts hang together."""

from dataclasses import astuple, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from arena.rating.comparisons import LOSS, TIE, WIN, Comparisons
from arena.rating.leaderboard import Leaderboard, Method
from tests.properties import examples
from tests.rating.votes import Comparison, as_arrays, by_votes

NAMES = ("a", "b", "c", "d")
votes_of_four = st.lists(
    st.tuples(st.permutations(NAMES), st.sampled_from([WIN, TIE, LOSS]), st.sampled_from("xyz")),
    min_size=20,
    max_size=80,
)


def as_votes(drawn: list[tuple[list[str], float, str]]) -> list[Comparison]:
    return [
        Comparison(first=order[0], second=order[1], score=score, expert=expert)
        for order, score, expert in drawn
    ]


def ratings(board: Leaderboard) -> dict[str, float]:
    assume(all(line.rating is not None for line in board.lines))
    return {line.name: line.rating or 0.0 for line in board.lines}


def alike(one: Leaderboard, other: Leaderboard) -> bool:
    """Everything the same but for the last digits of a float."""

    def columns(board: Leaderboard) -> list[tuple[object, ...]]:
        return [
            tuple(round(v, 5) + 0.0 if isinstance(v, float) else v for v in astuple(line))
            for line in board.lines
        ]

    return columns(one) == columns(other) and one.explanation == other.explanation


@pytest.mark.slow
@given(votes_of_four, st.randoms(use_true_random=False))
@examples(60)
def test_neither_the_sides_nor_the_order_of_the_votes_change_anything(
    drawn: list[tuple[list[str], float, str]], shuffle: Any
) -> None:
    votes = as_votes(drawn)
    mixed = [replace(v, first=v.second, second=v.first, score=1 - v.score) for v in votes]
    shuffle.shuffle(mixed)
    one, other = (by_votes(as_arrays(NAMES, v), rounds=20) for v in (votes, mixed))
    assert alike(one, other)


@pytest.mark.slow
@given(votes_of_four, st.permutations(NAMES))
@examples(60)
def test_renaming_the_contestants_renames_the_table_and_every_vote_twice_leaves_it(
    drawn: list[tuple[list[str], float, str]], names: list[str]
) -> None:
    votes = as_votes(drawn)
    new = dict(zip(NAMES, names, strict=True))
    renamed = [replace(v, first=new[v.first], second=new[v.second]) for v in votes]
    one, other, twice = (
        ratings(by_votes(as_arrays(NAMES, each), rounds=1)) for each in (votes, renamed, votes * 2)
    )
    assert {new[name]: rating for name, rating in one.items()} == pytest.approx(other, abs=1e-5)
    assert one == pytest.approx(twice, abs=1e-5)


@pytest.mark.parametrize("method", Method)
def test_the_same_seed_gives_the_same_table_and_another_other_bounds(method: Method) -> None:
    votes = some_votes()
    one, same_seed, other = (
        by_votes(votes, method=method, rounds=50, seed=seed) for seed in (1, 1, 2)
    )
    assert one == same_seed
    assert one != other


def some_votes() -> Comparisons:
    rng = np.random.default_rng(0)
    first = rng.integers(0, 4, 300)
    return Comparisons(
        names=NAMES,
        first=first,
        second=(first + rng.integers(1, 4, 300)) % 4,
        score=rng.choice([WIN, TIE, LOSS], 300),
        expert=rng.integers(0, 5, 300),
        scenario=rng.integers(0, 7, 300),
    )
