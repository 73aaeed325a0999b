"""Who scored against whom in resampled rounds, eight rounds to a byte.

Whether somebody is determined in a round depends on which scores are there, not on how many, and
that is one bit. The rounds are those of `bootstrap.resample`: the same seed draws the same.

Notation: P pairs, W ways (whoever scored against whom), B rounds, R rows, K clusters.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from arena.rating.bootstrap import Unit, cluster_draws, resample
from arena.rating.comparisons import BoolArray, Comparisons, IntArray, PairCounts

RoundBits = NDArray[np.uint8]
"""(..., B / 8): the first round is the highest bit of the first byte; beyond the last one are
bits without a meaning."""

_BYTES_AT_ONCE = 32_000_000
_MOST_ROUNDS = 4096


def scored_rounds(
    votes: Comparisons, counts: PairCounts, *, unit: Unit, rounds: int, seed: int
) -> Iterator[tuple[RoundBits, int]]:
    """Blocks (W, B / 8) of who scored in which rounds, and how many rounds each block has.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        unit: What is drawn.
        rounds: How many in all.
        seed: Of the draws.

    Yields:
        The ways in the order of `chains.scoring_edges`.
    """
    if unit is Unit.VOTE:
        yield from _by_votes(votes, counts, rounds, seed)
    else:
        yield from _by_clusters(votes, counts, unit, rounds, seed)


def rounds_of_bits(bits: RoundBits, rounds: int) -> BoolArray:
    """(..., B) for (..., B / 8)."""
    return np.unpackbits(bits, axis=-1, count=rounds).view(np.bool_)


def round_of(bits: RoundBits, number: int) -> RoundBits:
    """(..., 1) one of the rounds, in all bits of a byte."""
    place = number // 8
    return np.asarray(255 * (bits[..., place : place + 1] >> (7 - number % 8) & 1), dtype=np.uint8)


# --- Private -----------------------------------------------------------------------------------


def _by_clusters(
    votes: Comparisons, counts: PairCounts, unit: Unit, rounds: int, seed: int
) -> Iterator[tuple[RoundBits, int]]:
    """A row is in a round if its expert, or its scenario, or both were drawn."""
    rows, starts = _rows_of_ways(counts)
    at_once = _BYTES_AT_ONCE // (len(rows) + 2 * len(starts))
    at_once = min(8 * max(1, at_once), _MOST_ROUNDS)
    kinds = cluster_draws(votes, unit, seed)
    for first in range(0, rounds, at_once):
        number = min(at_once, rounds - first)
        there = None
        for clusters, of_row in kinds:
            bits = np.packbits(clusters.draw(number) > 0, axis=1).take(of_row[rows], axis=0)
            there = bits if there is None else np.bitwise_and(there, bits, out=there)
        assert there is not None, "a unit of clusters draws at least one kind of them"
        yield np.bitwise_or.reduceat(there, starts, axis=0), number


def _rows_of_ways(counts: PairCounts) -> tuple[IntArray, IntArray]:
    """The rows in which each way scored, one way after the other, and (W,) where each begins."""
    up, down = np.flatnonzero(counts.outcome_of < 2), np.flatnonzero(counts.outcome_of > 0)
    pairs = len(counts.low)
    way = np.concatenate([counts.pair_of[up], pairs + counts.pair_of[down]])
    order = np.argsort(way, kind="stable")
    starts = np.flatnonzero(np.diff(way[order], prepend=-1))
    return np.concatenate([up, down])[order], starts


def _by_votes(
    votes: Comparisons, counts: PairCounts, rounds: int, seed: int
) -> Iterator[tuple[RoundBits, int]]:
    up, down = counts.scores > 0, counts.scores < counts.games
    kept: list[BoolArray] = []
    left = rounds
    for block in resample(votes, counts, unit=Unit.VOTE, rounds=rounds, seed=seed):
        scored, conceded = block.scores[up] > 0, (block.scores < block.games)[down]
        kept.append(np.concatenate([scored, conceded]))
        number = sum(one.shape[1] for one in kept)
        if number >= 8 or number == left:  # a block can be a single round
            yield np.packbits(np.hstack(kept), axis=1), number
            kept, left = [], left - number
