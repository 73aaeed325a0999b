"""Who is determined in resampled rounds: for intervals in closed form, also with many contestants.

A round puts everybody in one component with whoever has the most votes, above it, below it, or
says nothing of them. Scores are followed from that contestant forwards and backwards, along the
pairs that there are: no matrix of all contestants is made.

Notation: C contestants, P pairs, B and N rounds, which are the last axis, R rows.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import islice

import numpy as np

from arena.rating.bootstrap import Rounds, Unit, resample
from arena.rating.comparisons import (
    BoolArray,
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
    tally,
)
from arena.rating.components import Loose

FEWEST_ROUNDS = 200
_FEW = 12
"""Among more contestants it hardly happens that all components of a round are single."""
_WORK = 1_500_000_000
_MISSED = 0.8
"""A score by one more expert and scenario is missing from 6 of 10 rounds; 0.8 is on the safe side,
because experts may share scenarios."""
_NEVER = 1e-4


def rounds_to_draw(votes: Comparisons, counts: PairCounts, rounds: int) -> int:
    """How many of the rounds: fewer where one takes long, 200 at least."""
    experts, scenarios = (len(renumber_codes(one)[0]) for one in (votes.expert, votes.scenario))
    each = max(2 * experts * scenarios * len(counts.low), 1)
    each = min(each, 50 * (len(votes) + 3 * len(counts.low)))
    return min(rounds, max(FEWEST_ROUNDS, _WORK // each))


def reached_from(start: int, contestants: int, source: IntArray, target: IntArray) -> BoolArray:
    """(C,) who is reached from a contestant along edges."""
    reached = np.zeros(contestants, dtype=np.bool_)
    reached[start] = True
    number = 1
    while True:
        reached[target[reached[source]]] = True
        if (now := int(reached.sum())) == number:
            return reached
        number = now


def are_all_together(contestants: int, counts: PairCounts) -> bool:
    """Whether everybody scored against everybody else through some chain."""
    source, target = _edges(counts.low, counts.high, counts.games, counts.scores)
    return bool(
        reached_from(0, contestants, source, target).all()
        and reached_from(0, contestants, target, source).all()
    )


def loose_rounds(
    votes: Comparisons,
    counts: PairCounts,
    tree: IntArray,
    rating: FloatArray,
    *,
    unit: Unit,
    rounds: int,
    seed: int,
    workers: int = 1,
    report: Callable[[int, int], None] | None = None,
) -> tuple[int, Loose]:
    """How many rounds determine everybody, and what the others say.

    Args:
        votes: Of contestants who are all determined by them.
        counts: The same, by pair.
        tree: Pairs that join everybody, those with the most scores either way.
        rating: (C,) of the data, which is that of every round.
        unit: What is drawn.
        rounds: How many.
        seed: Of the draws.
        workers: Threads that follow the scores of rounds; the answer does not depend on them.
        report: Is told how many rounds are done, and of how many.
    """
    contestants = len(votes.names)
    if _is_certain(votes, counts, tree, contestants):
        return rounds, Loose.none(contestants)
    by_votes = np.argsort(-tally(votes).sum(axis=1), kind="stable")
    ways = _Ways(contestants, counts.low, counts.high)

    def follow(alive: BoolArray) -> tuple[BoolArray, BoolArray, IntArray] | None:
        above, below = _around_the_largest(by_votes, ways, alive)
        if below.all() and above.all():
            return None
        return below & above, 1 * above - 1 * below, _outermost(contestants, ways, alive)

    fine, found, done = 0, [], 0
    drawn = resample(votes, counts, unit=unit, rounds=rounds, seed=seed)
    with ThreadPoolExecutor(workers) as pool:
        while some := list(islice(drawn, workers)):
            unclear: list[BoolArray] = []
            for block in some:
                left = _unclear_rounds(block, tree, contestants)
                done += block.games.shape[1]
                fine += block.games.shape[1] - len(left)
                unclear += left
            if report is not None:
                report(done, rounds)
            found += list(pool.map(follow, unclear) if workers > 1 else map(follow, unclear))
    loose = [one for one in found if one is not None]
    fine += len(found) - len(loose)
    return fine, _loose_of(loose, rating)


# --- Private -----------------------------------------------------------------------------------


def _loose_of(rounds: list[tuple[BoolArray, BoolArray, IntArray]], rating: FloatArray) -> Loose:
    """The rounds that do not determine everybody, one a column."""
    in_main, sides, outer = [list(column) for column in zip(*rounds, strict=True)] or [[]] * 3
    if not sides:
        return Loose.none(len(rating))
    main = np.array(in_main).T
    return Loose(
        values=np.repeat(rating[:, None], main.shape[1], axis=1),
        in_main=main & (main.sum(axis=0) > 1),
        side=np.array(sides, dtype=np.int8).T,
        side_of_all=np.array(outer, dtype=np.int8).T,
    )


def _unclear_rounds(block: Rounds, tree: IntArray, contestants: int) -> list[BoolArray]:
    """Who scored against whom, either way, in each round that the tree alone does not settle."""
    games, scores = block.games, block.scores
    known = np.zeros(games.shape[1], dtype=np.bool_)
    if len(tree) == contestants - 1:
        of_tree = scores[tree]
        known = np.asarray(((of_tree > 0) & (of_tree < games[tree])).all(axis=0))
    rest = np.flatnonzero(~known)
    up, down = scores[:, rest] > 0, scores[:, rest] < games[:, rest]
    return list(np.concatenate([up, down]).T)


class _Ways:
    """Who may have scored against whom: every pair both ways, first all from low to high."""

    def __init__(self, contestants: int, low: IntArray, high: IntArray) -> None:
        self.contestants = contestants
        source, target = np.concatenate([low, high]), np.concatenate([high, low])
        self._forwards = self._by_end(source, target)
        self._backwards = self._by_end(target, source)

    def below(self, start: int, alive: BoolArray) -> BoolArray:
        """(C,) whom a contestant reaches by the ways (2 P,) that are alive."""
        return self._follow(start, alive, *self._forwards)

    def above(self, start: int, alive: BoolArray) -> BoolArray:
        """(C,) who reaches a contestant."""
        return self._follow(start, alive, *self._backwards)

    @staticmethod
    def _by_end(begin: IntArray, end: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
        order = np.argsort(end, kind="stable")
        ends, starts = np.unique(end[order], return_index=True)
        return order, begin[order], ends, starts

    def _follow(
        self,
        start: int,
        alive: BoolArray,
        order: IntArray,
        begin: IntArray,
        ends: IntArray,
        starts: IntArray,
    ) -> BoolArray:
        reached = np.zeros(self.contestants, dtype=np.bool_)
        reached[start] = True
        alive, number = alive.take(order), 1
        while len(begin):
            hit = np.logical_or.reduceat(alive & reached.take(begin), starts)
            reached[ends[hit]] = True
            if (now := int(reached.sum())) in (number, self.contestants):
                break
            number = now
        return reached


def _around_the_largest(
    by_votes: IntArray, ways: _Ways, alive: BoolArray
) -> tuple[BoolArray, BoolArray]:
    """(C,), (C,): who reaches the largest component, and whom it reaches; it does both itself."""
    left = np.ones(len(by_votes), dtype=np.bool_)
    largest, found = 0, (left, left)
    for start in by_votes.tolist():
        if left.sum() <= largest:
            break
        if not left[start]:
            continue
        below, above = ways.below(start, alive), ways.above(start, alive)
        together = below & above
        left &= ~together
        if (size := int(together.sum())) > largest:
            largest, found = size, (above, below)
    return found


def _outermost(contestants: int, ways: _Ways, alive: BoolArray) -> IntArray:
    """(C,) 1 for who reaches everybody without being reached by all, -1 for the opposite."""
    if contestants > _FEW:
        return np.zeros(contestants, dtype=np.int64)
    over, under = (
        [follow(one, alive).all() for one in range(contestants)]
        for follow in (ways.below, ways.above)
    )
    return np.asarray(1 * np.array(over) - 1 * np.array(under), dtype=np.int64)


def _edges(
    low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> tuple[IntArray, IntArray]:
    """Who scored against whom."""
    up, down = scores > 0, scores < games
    return np.concatenate([low[up], high[down]]), np.concatenate([high[up], low[down]])


def _is_certain(votes: Comparisons, counts: PairCounts, tree: IntArray, contestants: int) -> bool:
    """Whether hardly a round can fail: every pair of the tree has scores of many, both ways."""
    if len(tree) < contestants - 1:
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
