"""Who scored against whom through chains of comparisons, without a matrix of all contestants.

Contestants who reach each other both ways are a part (a strongly connected component of the graph
of scores), those who met through any chain a group. What a contestant reaches, all of its part
do; so what is kept is who reaches whom among parts, of which there is one in most data.

Notation: C contestants, K parts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from graphlib import TopologicalSorter
from typing import Literal, Self

import numpy as np

from arena.rating.comparisons import BoolArray, IntArray, PairCounts

_QUICKLY_FOLLOWED = 2000
"""Among so many no chain is long."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Chains:
    """The parts and groups, numbered in the order of their first members.

    Attributes:
        part_of: (C,) the number of each one's part.
        group_of: (C,) of each one's group.
        between: (K, K) whether the row's part reaches the column's; it reaches itself.
        scored, conceded: (C,) whether the contestant scored against anybody, and anybody against
            it.
    """

    part_of: IntArray
    group_of: IntArray
    between: BoolArray
    scored: BoolArray
    conceded: BoolArray

    @classmethod
    def of_nobody(cls) -> Self:
        """No contestants."""
        numbers, flags = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.bool_)
        return cls(
            part_of=numbers,
            group_of=numbers,
            between=np.empty((0, 0), dtype=np.bool_),
            scored=flags,
            conceded=flags,
        )

    def by_group(self) -> Self:
        """The same with whole groups for parts, as for methods that rate whoever met."""
        number = len(self.groups())
        return replace(self, part_of=self.group_of, between=np.eye(number, dtype=np.bool_))

    @property
    def sizes(self) -> IntArray:
        """(K,) members of each part."""
        return np.bincount(self.part_of)

    @property
    def first_of_parts(self) -> IntArray:
        """(K,) the first member of each part."""
        return np.unique(self.part_of, return_index=True)[1]

    def above(self) -> IntArray:
        """(C,) how many of other parts reach each one."""
        reaching = self.sizes @ self.between - self.sizes
        return np.asarray(reaching[self.part_of])

    def parts(self) -> tuple[tuple[int, ...], ...]:
        """The members of each part."""
        return members_of(self.part_of)

    def groups(self) -> tuple[tuple[int, ...], ...]:
        """The members of each group."""
        return members_of(self.group_of)


def chains_among(contestants: int, counts: PairCounts) -> Chains:
    """Who reaches whom in votes (P pairs) on so many contestants."""
    source, target = scoring_edges(counts)
    scored, conceded = np.zeros((2, contestants), dtype=np.bool_)
    scored[source] = conceded[target] = True
    if contestants <= _QUICKLY_FOLLOWED and are_all_together(contestants, counts):
        nobody_apart = np.zeros(contestants, dtype=np.int64)
        return Chains(
            part_of=nobody_apart,
            group_of=nobody_apart,
            between=np.ones((min(contestants, 1),) * 2, dtype=np.bool_),
            scored=scored,
            conceded=conceded,
        )
    part_of = _in_order(strong_parts(contestants, source, target))
    group_of = _in_order(_components(contestants, source, target, "weak"))
    between = _reached_parts(int(part_of.max()) + 1, part_of[source], part_of[target])
    return Chains(
        part_of=part_of, group_of=group_of, between=between, scored=scored, conceded=conceded
    )


def are_all_together(contestants: int, counts: PairCounts) -> bool:
    """Whether everybody scored against everybody else through some chain."""
    source, target = scoring_edges(counts)
    return bool(
        reached_from(0, contestants, source, target).all()
        and reached_from(0, contestants, target, source).all()
    )


def reached_from(start: int, contestants: int, source: IntArray, target: IntArray) -> BoolArray:
    """(C,) who is reached from a contestant along edges."""
    reached = np.zeros(contestants, dtype=np.bool_)
    reached[start : start + 1] = True
    number = 1
    while True:
        reached[target[reached[source]]] = True
        if (now := int(reached.sum())) == number:
            return reached
        number = now


def scoring_edges(counts: PairCounts) -> tuple[IntArray, IntArray]:
    """Who scored against whom: first all from low to high."""
    up, down = counts.scores > 0, counts.scores < counts.games
    return (
        np.concatenate([counts.low[up], counts.high[down]]),
        np.concatenate([counts.high[up], counts.low[down]]),
    )


def members_of(number_of: IntArray) -> tuple[tuple[int, ...], ...]:
    """Who has each of the numbers (C,), from 0."""
    order = np.argsort(number_of, kind="stable")
    ends = np.cumsum(np.bincount(number_of))[:-1]
    return tuple(tuple(some.tolist()) for some in np.split(order, ends) if len(some))


def strong_parts(contestants: int, source: IntArray, target: IntArray) -> IntArray:
    """(C,) the same number for those who reach each other both ways along edges."""
    return _components(contestants, source, target, "strong")


# --- Private -----------------------------------------------------------------------------------


def _components(
    contestants: int, source: IntArray, target: IntArray, kind: Literal["strong", "weak"]
) -> IntArray:
    """(C,) the number of each one's component."""
    # Slow to load, and needed where somebody is apart alone.
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    edges = coo_matrix((np.ones(len(source), dtype=np.int8), (source, target)), (contestants,) * 2)
    return connected_components(edges, directed=True, connection=kind)[1].astype(np.int64)


def _in_order(labels: IntArray) -> IntArray:
    """(C,) the same labels, from 0 in the order in which they first occur."""
    _, first, place = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    return rank[place]


def _reached_parts(parts: int, source: IntArray, target: IntArray) -> BoolArray:
    """(K, K): from the last ones on, each part reaches what those reach whom it scored against.

    A row is kept as bits, so that ten thousand parts take 12 megabytes while it is worked out.
    """
    across = source != target
    edges = np.unique(source[across] * parts + target[across])
    beaten: dict[int, list[int]] = {part: [] for part in range(parts)}
    for edge in edges.tolist():
        beaten[edge // parts].append(edge % parts)
    reached = np.zeros((parts, (parts + 7) // 8), dtype=np.uint8)
    for part in TopologicalSorter(beaten).static_order():
        reached[part] = np.bitwise_or.reduce(reached[beaten[part]], axis=0)
        reached[part, part // 8] |= 128 >> part % 8
    return np.unpackbits(reached, axis=1, count=parts).view(np.bool_)
