"""Who is determined in resampled rounds: for intervals in closed form, also with many contestants.

A round puts everybody in one component with whoever has the most votes, above it, below it, or
says nothing of them. Scores are followed from that contestant forwards and backwards, along the
pairs that there are: no matrix of all contestants is made, and rounds are followed eight at a
time, as the bits of a byte.

Notation: C contestants, P pairs, W ways (whoever scored against whom), B and N rounds, which are
the last axis, R rows.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor

import numpy as np

from arena.rating.bootstrap import Unit
from arena.rating.chains import scoring_edges, strong_parts
from arena.rating.comparisons import (
    Comparisons,
    FloatArray,
    IntArray,
    PairCounts,
    renumber_codes,
    tally,
)
from arena.rating.components import Loose, SideArray
from arena.rating.scored_rounds import RoundBits, round_of, rounds_of_bits, scored_rounds

FEWEST_ROUNDS = 200
_FEW = 12
"""Among more contestants it hardly happens that all components of a round are single."""
_WORK = 60_000_000
_MISSED = 0.8
"""A score by one more expert and scenario is missing from 6 of 10 rounds; 0.8 is on the safe side,
because experts may share scenarios."""
_NEVER = 1e-4


def rounds_to_draw(votes: Comparisons, counts: PairCounts, rounds: int) -> int:
    """How many of the rounds: fewer where one takes long, 200 at least."""
    each = len(votes) + 3 * len(counts.low)
    return min(rounds, max(FEWEST_ROUNDS, _WORK // max(each, 1)))


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
        workers: Threads that follow scores; the answer does not depend on them.
        report: Is told how many rounds are done, and of how many.
    """
    contestants = len(votes.names)
    if _is_certain(votes, counts, tree, contestants):
        return rounds, Loose.none(contestants)
    by_votes = np.argsort(-tally(votes).sum(axis=1), kind="stable")
    ways = _Ways(contestants, *scoring_edges(counts))
    done, found = 0, [Loose.none(contestants)]
    with ThreadPoolExecutor(min(workers, 2)) as pool:
        for alive, number in scored_rounds(votes, counts, unit=unit, rounds=rounds, seed=seed):
            found.append(_loose_of(by_votes, ways, alive, number, rating, pool))
            done += number
            if report is not None:
                report(done, rounds)
    loose = Loose.joined(found)
    return rounds - loose.values.shape[1], loose


# --- Private -----------------------------------------------------------------------------------


class _Ways:
    """Along which scores are followed, and backwards.

    Args:
        contestants: C.
        source: (W,) who scored.
        target: (W,) against whom.
    """

    def __init__(self, contestants: int, source: IntArray, target: IntArray) -> None:
        self.contestants, self.source, self.target = contestants, source, target
        self._forwards = self._by_end(source, target)
        self._backwards = self._by_end(target, source)

    def both(self, start: int, alive: RoundBits, pool: Executor) -> tuple[RoundBits, RoundBits]:
        """(C, B / 8), (C, B / 8): who reaches a contestant, and whom it reaches.

        Args:
            start: The contestant.
            alive: (W, B / 8) the ways that there are in each round.
            pool: Where the two are followed.
        """
        above, below = pool.map(
            lambda way: self._follow(start, alive, *way), (self._backwards, self._forwards)
        )
        return above, below

    @staticmethod
    def _by_end(begin: IntArray, end: IntArray) -> tuple[IntArray, IntArray, IntArray, IntArray]:
        order = np.argsort(end, kind="stable")
        ends, starts = np.unique(end[order], return_index=True)
        return order, begin[order], ends, starts

    def _follow(
        self,
        start: int,
        alive: RoundBits,
        order: IntArray,
        begin: IntArray,
        ends: IntArray,
        starts: IntArray,
    ) -> RoundBits:
        reached = np.zeros((self.contestants, alive.shape[1]), dtype=np.uint8)
        reached[start] = 255
        alive = alive.take(order, axis=0)
        while len(begin):
            step = reached.take(begin, axis=0)
            step &= alive
            now = np.bitwise_or.reduceat(step, starts, axis=0)
            now |= reached[ends]
            if (now == reached[ends]).all():
                break
            reached[ends] = now
        return reached


def _loose_of(
    by_votes: IntArray,
    ways: _Ways,
    alive: RoundBits,
    number: int,
    rating: FloatArray,
    pool: Executor,
) -> Loose:
    """The rounds that do not determine everybody, of so many whose ways are alive."""
    found = ways.both(int(by_votes[0]), alive, pool)
    above, below = (rounds_of_bits(bits, number) for bits in found)
    size = (above & below).sum(axis=0)
    for one in np.flatnonzero(2 * size < len(by_votes)).tolist():
        of_round = round_of(alive, one)
        around = ways.both(_leader(by_votes, ways, of_round), of_round, pool)
        above[:, one], below[:, one] = (bits[:, 0] > 0 for bits in around)
    left = np.flatnonzero(size < len(by_votes))
    above, below = above[:, left], below[:, left]
    main = above & below
    side = above.astype(np.int8) - below.astype(np.int8)
    return Loose(
        values=np.repeat(rating[:, None], len(left), axis=1),
        in_main=main & (main.sum(axis=0) > 1),
        side=side,
        side_of_all=_outermost(ways, alive, number, left, pool),
    )


def _leader(by_votes: IntArray, ways: _Ways, alive: RoundBits) -> int:
    """Who has the most votes of a round's largest component."""
    there = alive[:, 0] > 0
    parts = strong_parts(ways.contestants, ways.source[there], ways.target[there])
    size = np.bincount(parts)[parts]
    return int(by_votes[np.argmax(size[by_votes])])


def _outermost(
    ways: _Ways, alive: RoundBits, number: int, left: IntArray, pool: Executor
) -> SideArray:
    """(C, n) 1 for who reaches everybody without being reached by all, -1 for the opposite."""
    outermost: SideArray = np.zeros((ways.contestants, len(left)), dtype=np.int8)
    if ways.contestants <= _FEW and len(left):
        for one in range(ways.contestants):
            above, below = (
                rounds_of_bits(np.bitwise_and.reduce(bits, axis=0, keepdims=True), number)[0, left]
                for bits in ways.both(one, alive, pool)
            )
            outermost[one] = below.astype(np.int8) - above.astype(np.int8)
    return outermost


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
