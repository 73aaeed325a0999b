"""Resampled votes as counts, a block of rounds at a time, and percentile intervals.

What is drawn with replacement is the unit: votes, whole scenarios, whole experts, or both at
once (a vote counts as often as its expert times its scenario is drawn).

Between contestants who scored against each other through chains both ways the difference is
finite (Ford 1957). Where only one of two did, it grows without limit in the known direction;
where neither did, nothing is known. So a round rates those of its largest component among each
other and puts the others above it, below it or nowhere.

Notation: C contestants, R rows, P pairs, K clusters, B and N rounds, which are the last axis.
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


# --- Rounds that do not determine everybody ------------------------------------------------------


MOST_DEGENERATE = (1.0 - LEVEL) / 2.0
"""The largest share of rounds without somebody that still leaves both percentiles to read."""

SideArray = NDArray[np.int8]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Loose:
    """Rounds that leave some differences without a limit.

    Attributes:
        values: (C, N) ratings; only those of one component can be compared, NaN is unknown.
        in_main: (C, N) who is in the round's largest component; nobody where all are single.
        side: (C, N) 1 above that component, -1 below it, 0 unknown or in it.
        side_of_all: (C, N) 1 where somebody is at least level with everybody and above some,
            -1 for the opposite, else 0.
    """

    values: FloatArray
    in_main: BoolArray
    side: SideArray
    side_of_all: SideArray

    @classmethod
    def none(cls, contestants: int) -> Self:
        """No such rounds."""
        sides = np.empty((contestants, 0), dtype=np.int8)
        return cls(
            values=np.empty((contestants, 0)),
            in_main=np.empty((contestants, 0), dtype=bool),
            side=sides,
            side_of_all=sides,
        )

    @classmethod
    def joined(cls, some: list[Self]) -> Self:
        """All of them, one after the other."""
        return cls(
            values=np.hstack([one.values for one in some]),
            in_main=np.hstack([one.in_main for one in some]),
            side=np.hstack([one.side for one in some]),
            side_of_all=np.hstack([one.side_of_all for one in some]),
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """Ratings of all rounds, those without a limit included.

    Attributes:
        values: (C, B) points; plus or minus infinity where only the direction is known, NaN
            where nothing is.
        reference: (C,) those whose mean the values are relative to: everybody whom nearly every
            round determines.
    """

    values: FloatArray
    reference: BoolArray

    @property
    def are_finite(self) -> bool:
        """Whether every round determines everybody."""
        return bool(np.isfinite(self.values).all())


def loose(reached: BoolArray, values: FloatArray, *, votes: FloatArray) -> Loose:
    """Who is rated, above and below whom in rounds that do not determine everybody.

    Args:
        reached: (N, C, C) whether the row's contestant scored against the column's through a
            chain.
        values: (C, N) ratings fitted within the components; NaN where there are none.
        votes: (C,) of the data; of components of one size the one with whoever has the most votes
            is the main one.
    """
    mutual = reached & reached.transpose(0, 2, 1)
    size = mutual.sum(axis=2)
    by_votes = np.argsort(-votes, kind="stable")
    leader = by_votes[np.argmax(size[:, by_votes], axis=1)]
    every = np.arange(len(reached))
    in_main = mutual[every, leader] & (size[every, leader] > 1)[:, None] & ~np.isnan(values.T)
    above, below = reached[every, :, leader], reached[every, leader, :]
    side = np.where(in_main, 0, above.astype(np.int8) - below.astype(np.int8))
    side[~in_main.any(axis=1)] = 0
    over_all, under_all = reached.all(axis=2), reached.all(axis=1)
    return Loose(
        values=values,
        in_main=in_main.T,
        side=np.asarray(side.T, dtype=np.int8),
        side_of_all=np.asarray(1 * over_all - 1 * under_all, dtype=np.int8).T,
    )


def place_on_one_scale(rating: FloatArray, samples: FloatArray, rounds: Loose) -> Placed:
    """Put all rounds on one scale: there the mean of the reference stays that of the data.

    Whoever is missing from the largest component in more than a 40th of the rounds is not part of
    the reference, so that a contestant with hardly any votes does not move the others.

    Args:
        rating: (C,) of the data.
        samples: (C, b) of the rounds that determine everybody.
        rounds: The others.
    """
    everywhere, apart = samples.shape[1], rounds.values.shape[1]
    missing = (~rounds.in_main).sum(axis=1)
    reference = missing <= MOST_DEGENERATE * (everywhere + apart)
    if reference.sum() < 2:
        reference = np.ones(len(rating), dtype=bool)
    if not reference.all():
        samples = samples + (rating[reference].mean() - samples[reference].mean(axis=0))
    if not apart:
        return Placed(values=samples, reference=reference)
    joined = rounds.in_main & reference[:, None]
    number = joined.sum(axis=0)
    gap = np.where(joined, rating[:, None] - rounds.values, 0.0).sum(axis=0)
    shift = gap / np.maximum(number, 1)
    side = np.where(number > 1, rounds.side, rounds.side_of_all)
    values = np.where(rounds.in_main & (number > 1), rounds.values + shift, np.nan)
    values[side > 0], values[side < 0] = np.inf, -np.inf
    return Placed(values=np.hstack([samples, values]), reference=reference)


def open_interval(values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The percentile interval (C,), (C,) of values (C, B); a bound that is not finite is NaN.

    Unknown values count as the worst on each side: a bound is finite only if it is whatever they
    were.
    """
    tail = (1.0 - LEVEL) / 2.0
    unknown = np.isnan(values)
    lower = _quantile(np.where(unknown, -np.inf, values), tail)
    upper = _quantile(np.where(unknown, np.inf, values), 1.0 - tail)
    return lower, upper


def _quantile(values: FloatArray, share: float) -> FloatArray:
    """(C,) as numpy interpolates it; NaN where one of the two neighbours is infinite."""
    place = (values.shape[1] - 1) * share
    first, last = int(np.floor(place)), int(np.ceil(place))
    ordered = np.partition(values, [first, last], axis=1)
    low, high = ordered[:, first], ordered[:, last]
    finite = np.isfinite(low) & np.isfinite(high)
    with np.errstate(invalid="ignore"):
        return np.where(finite, low + (high - low) * (place - first), np.nan)
