"""Resampled votes as counts, a block of rounds at a time, and percentile intervals.

What is drawn with replacement is the unit: votes, whole scenarios, whole experts, or both at
once (a vote counts as often as its expert times its scenario is drawn).

Notation: R rows, P pairs, K cells (expert x scenario), B rounds, which are the last axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
)
from arena.rating.draws import Multinomial
from arena.rating.estimate import LEVEL

_NUMBERS_AT_ONCE = 500_000
"""How many numbers a block of rounds may hold; more only costs memory."""
_LARGEST_TABLE = 2_000_000
_NUMBERS_OF_TABLES = 8_000_000
_EMPTIEST = 500
"""A table with more places than this for each row takes longer than going row by row."""


class Unit(StrEnum):
    """What the bootstrap draws."""

    VOTE = "vote"
    SCENARIO = "scenario"
    EXPERT = "expert"
    TWO_WAY = "two-way"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rounds:
    """Some rounds of resampled votes.

    Attributes:
        games: (P, B) comparisons of each pair.
        scores: (P, B) what `low` scored in them, a tie half.
        ties: (B,) ties of all pairs together.
    """

    games: FloatArray
    scores: FloatArray
    ties: FloatArray

    def chosen(self, rounds: IntArray) -> Self:
        """Some of the rounds, by their numbers."""
        return replace(
            self,
            games=self.games[:, rounds],
            scores=self.scores[:, rounds],
            ties=self.ties[rounds],
        )

    def limited_to(self, inside: BoolArray) -> Self:
        """Without the comparisons of pairs that are not `inside` (P, B); none of them may tie."""
        return replace(self, games=self.games * inside, scores=self.scores * inside)


def resample(
    votes: Comparisons, counts: PairCounts, *, unit: Unit, rounds: int, seed: int
) -> Iterator[Rounds]:
    """Blocks of rounds, `rounds` in all.

    Args:
        votes: What was voted.
        counts: The same, by pair.
        unit: What is drawn.
        rounds: How many.
        seed: The same seed gives the same rounds.
    """
    if unit is Unit.VOTE:
        return _votes(counts, rounds, np.random.default_rng(seed))
    return _clusters(votes, counts, unit, rounds, seed)


def interval(samples: FloatArray, *, level: float = LEVEL) -> tuple[FloatArray, FloatArray]:
    """The percentile interval (C,), (C,) of samples (C, B)."""
    tail = 50.0 * (1.0 - level)
    lower, upper = np.percentile(samples, [tail, 100.0 - tail], axis=1)
    return lower, upper


def _blocks(rounds: int, width: int) -> Iterator[int]:
    size = max(1, _NUMBERS_AT_ONCE // max(width, 1))
    for start in range(0, rounds, size):
        yield min(size, rounds - start)


def _votes(counts: PairCounts, rounds: int, rng: np.random.Generator) -> Iterator[Rounds]:
    """Votes of one pair and outcome are alike, so drawing votes is drawing counts of them."""
    seen = counts.outcomes.T.ravel()
    kinds = np.flatnonzero(seen)
    kind_counts = Multinomial(seen[kinds])
    for size in _blocks(rounds, len(seen)):
        drawn = kind_counts.draw(rng, size)
        if len(kinds) < len(seen):
            everything = np.zeros((len(seen), size))
            everything[kinds] = drawn
            drawn = everything
        wins, ties, losses = drawn.reshape(3, -1, size)
        of_all = ties.sum(axis=0)
        losses += wins
        losses += ties
        ties *= 0.5
        wins += ties
        yield Rounds(games=losses, scores=wins, ties=of_all)


# --- Clusters: a scenario's or an expert's votes are drawn together ------------------------------


def _clusters(
    votes: Comparisons, counts: PairCounts, unit: Unit, rounds: int, seed: int
) -> Iterator[Rounds]:
    """Rounds are weights of clusters times their counts."""
    expert_of, (scenarios, scenario_of) = (
        renumber_codes(votes.expert)[1],
        renumber_codes(votes.scenario),
    )
    cells, cell_of = renumber_codes(expert_of * len(scenarios) + scenario_of)
    row_of_cell = np.empty(len(cells), dtype=np.int64)
    row_of_cell[cell_of] = np.arange(len(votes))
    weights = _Weights(votes, unit, row_of_cell, seed)
    if len(cells) * len(counts.low) > _EMPTIEST * len(votes):
        return _row_by_row(votes, counts, cell_of, weights, rounds)
    return _by_tables(_Tables(votes, counts, cell_of, len(cells)), weights, rounds)


def _by_tables(tables: _Tables, weights: _Weights, rounds: int) -> Iterator[Rounds]:
    """Many rounds at once: one product of matrices for each table."""
    numbers = _NUMBERS_OF_TABLES if tables.are_several else _NUMBERS_AT_ONCE
    at_once = max(1, numbers // max(tables.cells, 2 * tables.pairs))
    for first in range(0, rounds, at_once):
        games, scores, ties = tables.times(weights.draw(min(at_once, rounds - first)))
        begin = 0
        for size in _blocks(games.shape[1], 2 * tables.pairs):
            block = slice(begin, begin + size)
            yield Rounds(
                games=games[:, block].astype(np.float64),
                scores=scores[:, block].astype(np.float64),
                ties=ties[block].astype(np.float64),
            )
            begin += size


def _row_by_row(
    votes: Comparisons, counts: PairCounts, cell_of: IntArray, weights: _Weights, rounds: int
) -> Iterator[Rounds]:
    """One round after the other, where tables would be nearly empty."""
    pairs = len(counts.low)
    place = counts.outcome_of * pairs + counts.pair_of
    for _ in range(rounds):
        weight = weights.draw(1)[cell_of, 0].astype(np.float64) * votes.count
        drawn = np.bincount(place, weights=weight, minlength=3 * pairs).astype(np.float64)
        wins, ties, losses = drawn.reshape(3, pairs, 1)
        yield Rounds(games=wins + ties + losses, scores=wins + 0.5 * ties, ties=ties.sum(axis=0))


class _Tables:
    """What each cell holds of each pair: games and scores, a table for some pairs at a time.

    Single precision holds whole and half numbers exactly up to 8 million votes of one pair.
    """

    def __init__(
        self, votes: Comparisons, counts: PairCounts, cell_of: IntArray, cells: int
    ) -> None:
        self.pairs, self.cells = len(counts.low), cells
        order = np.argsort(counts.pair_of, kind="stable")
        self._pair_of = counts.pair_of[order].astype(np.int32)
        self._cell_of = cell_of[order].astype(np.int32)
        self._games = votes.count[order].astype(np.float32)
        half_points = (2 - counts.outcome_of[order]).astype(np.float32)
        self._scores = np.float32(0.5) * half_points * self._games
        tied = votes.count * (counts.outcome_of == 1)
        self._ties = np.bincount(cell_of, weights=tied, minlength=cells).astype(np.float32)
        self._at_once = max(1, _LARGEST_TABLE // cells)
        self._only = self._table(0) if self._at_once >= self.pairs else None

    @property
    def are_several(self) -> bool:
        """Then they are made anew for every product, of as many rounds as there is room for."""
        return self._only is None

    def times(
        self, weight: NDArray[np.float32]
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]:
        """(P, B) games, (P, B) scores, (B,) ties for weights (K, B)."""
        counts_f4 = np.empty((2, self.pairs, weight.shape[1]), dtype=np.float32)
        for first in range(0, self.pairs, self._at_once):
            table = self._table(first) if self._only is None else self._only
            for kind in range(2):
                np.matmul(table[kind], weight, out=counts_f4[kind, first : first + self._at_once])
        return counts_f4[0], counts_f4[1], self._ties @ weight

    def _table(self, first: int) -> NDArray[np.float32]:
        """(2, pairs from `first`, K)."""
        pairs = min(self._at_once, self.pairs - first)
        begin, end = np.searchsorted(self._pair_of, [first, first + pairs])
        rows = slice(begin, end)
        place = (self._pair_of[rows] - first) * self.cells + self._cell_of[rows]
        table = np.empty((2, pairs * self.cells), dtype=np.float32)
        for kind, values in enumerate((self._games, self._scores)):
            table[kind] = np.bincount(place, weights=values[rows], minlength=table.shape[1])
        return table.reshape(2, pairs, self.cells)


@dataclass(slots=True, kw_only=True)
class ClusterDraws:
    """Draws of clusters, as many as there are; every call goes on with further rounds."""

    clusters: int
    rng: np.random.Generator

    def draw(self, rounds: int) -> NDArray[np.float32]:
        """(K, B) how often each was drawn."""
        place = self.rng.integers(0, self.clusters, size=(rounds, self.clusters)).T * rounds
        place += np.arange(rounds)
        drawn = np.bincount(place.ravel(), minlength=self.clusters * rounds)
        return drawn.reshape(self.clusters, rounds).astype(np.float32)


def cluster_draws(
    votes: Comparisons, unit: Unit, seed: int
) -> list[tuple[ClusterDraws, IntArray]]:
    """The draws of each kind of cluster that the unit names, and (R,) which one a row is in."""
    wanted = {Unit.EXPERT: (True, False), Unit.SCENARIO: (False, True), Unit.VOTE: (False, False)}
    seeds = np.random.SeedSequence(seed).spawn(2)
    found = []
    for is_drawn, codes, child in zip(
        wanted.get(unit, (True, True)), (votes.expert, votes.scenario), seeds, strict=True
    ):
        if is_drawn:
            occurring, of_row = renumber_codes(codes)
            draws = ClusterDraws(clusters=len(occurring), rng=np.random.default_rng(child))
            found.append((draws, of_row))
    return found


class _Weights:
    """How often each cell is drawn: its expert's draws times its scenario's.

    What the unit does not name is not drawn and counts once.
    """

    def __init__(self, votes: Comparisons, unit: Unit, rows: IntArray, seed: int) -> None:
        """`rows` (K,) has a row of each cell."""
        self._drawn = [(draws, of_row[rows]) for draws, of_row in cluster_draws(votes, unit, seed)]

    def draw(self, rounds: int) -> NDArray[np.float32]:
        """(K, B)."""
        factors = [draws.draw(rounds).take(of_cell, axis=0) for draws, of_cell in self._drawn]
        weight = factors[0]
        for factor in factors[1:]:
            weight *= factor
        return weight
