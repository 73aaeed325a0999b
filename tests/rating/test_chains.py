"""Who reaches whom by scores, against matrices of all contestants."""

import numpy as np
import pytest

from arena.rating.chains import Chains, chains_among
from arena.rating.comparisons import BoolArray, Comparisons, IntArray, PairCounts, count_pairs
from arena.rating.leaderboard import rate
from tests.rating.votes import named, simulated, versus


def reached_by_matrices(contestants: int, counts: PairCounts) -> BoolArray:
    """(C, C), by squaring the matrix of scores until nothing is added."""
    edges = np.eye(contestants, dtype=np.int64)
    edges[counts.low, counts.high] = counts.scores > 0
    edges[counts.high, counts.low] = counts.scores < counts.games
    for _ in range(contestants):
        edges = np.minimum(edges @ edges, 1)
    return np.asarray(edges > 0)


def everywhere(chains: Chains) -> BoolArray:
    """(C, C) of contestants."""
    return chains.between[np.ix_(chains.part_of, chains.part_of)]


@pytest.mark.parametrize("votes", [4, 9, 14, 30])
def test_chains_are_those_of_matrices(votes: int) -> None:
    for seed in range(8):
        counts = count_pairs(simulated([1000.0] * 10, votes, seed, ties=0.1))
        chains, wanted = chains_among(10, counts), reached_by_matrices(10, counts)
        assert (everywhere(chains) == wanted).all()
        mutual = wanted & wanted.T
        assert (chains.part_of[:, None] == chains.part_of[None, :]).tolist() == mutual.tolist()
        met = reached_by_matrices(10, one_way_and_back(counts))
        assert (chains.group_of[:, None] == chains.group_of[None, :]).tolist() == met.tolist()
        assert chains.above().tolist() == (wanted & ~mutual).sum(axis=0).tolist()


def one_way_and_back(counts: PairCounts) -> PairCounts:
    """The same meetings, all of them ties."""
    ties: IntArray = np.tile(np.array([0, 1, 0]), (len(counts.low), 1))
    return PairCounts(
        low=counts.low,
        high=counts.high,
        outcomes=ties,
        pair_of=counts.pair_of,
        outcome_of=np.ones_like(counts.outcome_of),
    )


def test_parts_and_groups_are_numbered_by_their_first_members() -> None:
    votes = named(
        [*versus("b", "d", 2, 0, 2), *versus("a", "b", 3, 0, 0), *versus("c", "e", 1, 1, 1)]
    )
    chains = chains_among(5, count_pairs(votes))
    assert chains.parts() == ((0,), (1, 3), (2, 4))
    assert chains.groups() == ((0, 1, 3), (2, 4))


def two_crowds(each: int, votes: int, *, unbeaten: int) -> Comparisons:
    """Votes within each of two crowds, and on one who beats some of the first crowd."""
    crowds = [simulated([1000.0] * each, votes, seed) for seed in (1, 2)]
    champion = np.full(unbeaten, 2 * each)
    prey: IntArray = np.arange(unbeaten)
    columns = {
        "first": [crowds[0].first, crowds[1].first + each, champion],
        "second": [crowds[0].second, crowds[1].second + each, prey],
        "score": [crowds[0].score, crowds[1].score, np.ones(unbeaten)],
        "expert": [crowds[0].expert, crowds[1].expert, prey % 9],
        "scenario": [crowds[0].scenario, crowds[1].scenario, prey % 50],
    }
    joined = {name: np.concatenate(parts) for name, parts in columns.items()}
    names = tuple(f"c{number}" for number in range(2 * each + 1))
    return Comparisons(
        names=names,
        first=joined["first"],
        second=joined["second"],
        score=joined["score"],
        expert=joined["expert"],
        scenario=joined["scenario"],
    )


def test_each_of_two_crowds_is_rated_by_itself_and_the_unbeaten_one_is_bounded() -> None:
    board = rate(two_crowds(60, 3000, unbeaten=20), rounds=50)
    alone = rate(simulated([1000.0] * 60, 3000, 1), rounds=50)
    assert [line.rating for line in board.lines[:60]] == [line.rating for line in alone.lines]
    champion = board.lines[-1]
    assert (champion.rating, champion.upper, champion.rank) == (None, None, 1)
    assert champion.lower is not None
    assert champion.lower > 1000.0
    assert {line.part for line in board.lines[:60]}.isdisjoint(
        line.part for line in board.lines[60:120]
    )
