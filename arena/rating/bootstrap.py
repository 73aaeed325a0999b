"""Resampled votes as counts, a block of rounds at a time, and percentile intervals.

What is drawn with replacement is the unit: votes, whole scenarios, whole experts, or both at
once (a vote counts as often as its expert times its scenario is drawn).

Notation: R rows, P pairs, K clusters, B rounds, which are the last axis.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Self

import numpy as np
from numpy.typing import NDArray

from arena.rating.chains import heaviest_tree
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
)
from arena.rating.estimate import LEVEL

_NUMBERS_AT_ONCE = 500_000
"""How many numbers a block of rounds may hold; more only costs memory."""
FEWEST_ROUNDS = 200
_WORK = 60_000_000
_MISSED = 0.8
"""A score by one more expert and scenario is missing from 6 of 10 rounds; 0.8 is on the safe side,
because experts may share scenarios."""
_NEVER = 1e-4


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


def rounds_to_draw(votes: Comparisons, counts: PairCounts, rounds: int) -> int:
    """How many of the rounds: fewer where one takes long, 200 at least."""
    each = max(len(votes) + 3 * len(counts.low), len(votes.names) ** 2)
    return min(rounds, max(FEWEST_ROUNDS, _WORK // max(each, 1)))


def is_certain(votes: Comparisons, counts: PairCounts) -> bool:
    """Return whether hardly a round can leave somebody undetermined.

    Then each pair of a tree that joins everybody has scores of many, both ways.
    """
    weight = np.minimum(counts.scores, counts.games - counts.scores)
    tree = heaviest_tree(len(votes.names), counts.low, counts.high, weight)
    if len(tree) < len(votes.names) - 1:
        return False
    place = np.full(len(counts.low), -1, dtype=np.int64)
    place[tree] = np.arange(len(tree))
    rows = np.flatnonzero(place[counts.pair_of] >= 0)
    pair_of, outcome_of = place[counts.pair_of[rows]], counts.outcome_of[rows]
    fewest = np.full((2, len(tree)), np.iinfo(np.int64).max)
    for way, scored in enumerate((outcome_of < 2, outcome_of > 0)):
        for codes in (votes.expert, votes.scenario):
            number, of_row = renumber_codes(codes)
            met = np.unique(pair_of[scored] * len(number) + of_row[rows][scored])
            different = np.bincount(met // len(number), minlength=len(tree))
            if len(number) > 1:
                fewest[way] = np.minimum(fewest[way], different)
        if (fewest[way] == np.iinfo(np.int64).max).any():
            weights = votes.count[rows][scored]
            fewest[way] = np.bincount(pair_of[scored], weights, len(tree)).astype(np.int64)
    return bool((_MISSED ** fewest.astype(np.float64)).sum() < _NEVER)


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
    for size in _blocks(rounds, len(seen)):
        drawn = rng.multinomial(seen.sum(), seen / seen.sum(), size=size).T
        yield _as_rounds(drawn.astype(np.float64))


def _clusters(
    votes: Comparisons, counts: PairCounts, unit: Unit, rounds: int, seed: int
) -> Iterator[Rounds]:
    """Count each row as often as its expert is drawn, times its scenario.

    What the unit does not name is not drawn and counts once.
    """
    pairs = len(counts.low)
    place = counts.outcome_of * pairs + counts.pair_of
    order = np.argsort(place, kind="stable")
    kinds, starts = np.unique(place[order], return_index=True)
    clusters = [(draws, of_row[order]) for draws, of_row in cluster_draws(votes, unit, seed)]
    for size in _blocks(rounds, len(votes)):
        weight = np.repeat(votes.count[order, None].astype(np.float64), size, axis=1)
        for draws, of_row in clusters:
            weight *= draws.draw(size)[of_row]
        drawn = np.zeros((3 * pairs, size))
        drawn[kinds] = np.add.reduceat(weight, starts, axis=0)
        yield _as_rounds(drawn)


def _as_rounds(drawn: FloatArray) -> Rounds:
    """Return rounds of how often low won, neither or high won, for each pair (3 P, B)."""
    wins, ties, losses = drawn.reshape(3, -1, drawn.shape[1])
    return Rounds(games=wins + ties + losses, scores=wins + 0.5 * ties, ties=ties.sum(axis=0))


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
