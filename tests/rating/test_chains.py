"""Who reaches whom by scores, against matrices of all contestants."""

import numpy as np
import pytest

from arena.rating.chains import Chains, chains_among
from arena.rating.comparisons import BoolArray, IntArray, PairCounts, count_pairs
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
    reaches = chains.reaches | np.eye(len(chains.reaches), dtype=np.bool_)
    return np.asarray(reaches[np.ix_(chains.part_of, chains.part_of)])


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
    assert [members.tolist() for members in chains.parts] == [[0], [1, 3], [2, 4]]
    assert chains.group_of.tolist() == [0, 0, 1, 0, 1]
