"""Resampled votes as counts, a block of rounds at a time, and percentile intervals.

What is drawn with replacement is the unit: votes, whole scenarios, whole experts, or both at
once (a vote counts as often as its expert times its scenario is drawn).

Notation: B rounds, P pairs, V votes, K cells (expert x scenario).
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import Comparisons, FloatArray, IntArray, PairCounts

LEVEL = 0.95

_NUMBERS_AT_ONCE = 2_000_000
"""How many numbers a block of rounds may hold; more only costs memory."""


class Unit(StrEnum):
    """What the bootstrap draws."""

    VOTE = "vote"
    SCENARIO = "scenario"
    EXPERT = "expert"
    TWO_WAY = "two-way"


def resample(
    votes: Comparisons, counts: PairCounts, *, unit: Unit, rounds: int, seed: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Blocks of (games, scores), each (b, P), `rounds` rows in all.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        unit: What is drawn.
        rounds: B.
        seed: The same seed gives the same rounds.
    """
    if unit is Unit.VOTE:
        return _votes(counts, rounds, np.random.default_rng(seed))
    return _clusters(votes, counts, unit, rounds, seed)


def interval(samples: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The percentile interval (C,), (C,) of samples (B, C)."""
    tail = 50.0 * (1.0 - LEVEL)
    lower, upper = np.percentile(samples, [tail, 100.0 - tail], axis=0)
    return lower, upper


def _blocks(rounds: int, width: int) -> Iterator[int]:
    size = max(1, _NUMBERS_AT_ONCE // max(width, 1))
    for start in range(0, rounds, size):
        yield min(size, rounds - start)


def _votes(
    counts: PairCounts, rounds: int, rng: np.random.Generator
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Votes of one pair and outcome are alike, so drawing votes is drawing counts of them."""
    seen = counts.outcomes.ravel()
    kinds = np.flatnonzero(seen)
    total = int(seen.sum())
    for size in _blocks(rounds, len(seen)):
        drawn = np.zeros((size, len(seen)))
        drawn[:, kinds] = rng.multinomial(total, seen[kinds] / total, size=size)
        by_outcome = drawn.reshape(size, -1, 3)
        yield by_outcome.sum(axis=2), by_outcome[:, :, 0] + 0.5 * by_outcome[:, :, 1]


def _clusters(
    votes: Comparisons, counts: PairCounts, unit: Unit, rounds: int, seed: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """A cluster's votes are drawn together: rounds are weights of clusters times their counts."""
    experts = int(votes.expert.max()) + 1
    scenarios = int(votes.scenario.max()) + 1
    cells, cell_of = np.unique(votes.expert * scenarios + votes.scenario, return_inverse=True)
    per_cell = _counts_per_cell(counts, cell_of, len(cells))
    of_experts, of_scenarios = (
        np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(2)
    )
    pairs = len(counts.low)
    for size in _blocks(rounds, len(cells) + 2 * pairs):
        weight = np.ones((size, len(cells)))
        if unit in (Unit.EXPERT, Unit.TWO_WAY):
            weight *= _draws(of_experts, experts, size)[:, cells // scenarios]
        if unit in (Unit.SCENARIO, Unit.TWO_WAY):
            weight *= _draws(of_scenarios, scenarios, size)[:, cells % scenarios]
        drawn = weight @ per_cell
        yield drawn[:, :pairs], drawn[:, pairs:]


def _draws(rng: np.random.Generator, clusters: int, size: int) -> IntArray:
    """(size, clusters) how often each cluster is drawn."""
    return np.asarray(rng.multinomial(clusters, np.full(clusters, 1.0 / clusters), size=size))


def _counts_per_cell(counts: PairCounts, cell_of: IntArray, cells: int) -> FloatArray:
    """(K, 2P): the games of each pair, then what `low` scored, in votes of each cell."""
    pairs = len(counts.low)
    place = cell_of * pairs + counts.pair_of
    score = 1.0 - 0.5 * counts.outcome_of
    games = np.bincount(place, minlength=cells * pairs).reshape(cells, pairs)
    scores = np.bincount(place, weights=score, minlength=cells * pairs).reshape(cells, pairs)
    return np.hstack([games.astype(np.float64), scores])
