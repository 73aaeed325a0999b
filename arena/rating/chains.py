"""Who scored against whom through chains of comparisons, and what votes allow to be rated.

Contestants who reach each other both ways are a part (a strongly connected component of the graph
of scores), those who met through any chain a group. Strengths exist when everybody is in one part
(Ford 1957); a tie is a score both ways.

Notation: C contestants, K parts, P pairs, n sets of votes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from typing import Self

import numpy as np

from arena.rating.comparisons import BoolArray, FloatArray, IntArray, PairCounts

_BITS_AT_ONCE = 32_000_000


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
        """Return the chains among no contestants."""
        numbers, flags = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.bool_)
        return cls(
            part_of=numbers,
            group_of=numbers,
            between=np.empty((0, 0), dtype=np.bool_),
            scored=flags,
            conceded=flags,
        )

    def by_group(self) -> Self:
        """Return the same with whole groups for parts, for methods that rate whoever met."""
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
        """Return the members of each part."""
        return _members_of(self.part_of)

    def groups(self) -> tuple[tuple[int, ...], ...]:
        """Return the members of each group."""
        return _members_of(self.group_of)


def chains_among(contestants: int, counts: PairCounts) -> Chains:
    """Return who reaches whom in votes on so many contestants."""
    games, scores = counts.games[:, None], counts.scores[:, None]
    scored = _scored(contestants, counts.low, counts.high, games, scores)
    reached, met = closure(scored)[0], closure(scored | scored.transpose(0, 2, 1))[0]
    part_of = _numbered(reached & reached.T)
    first = np.unique(part_of, return_index=True)[1]
    others = scored[0] & ~np.eye(contestants, dtype=np.bool_)
    return Chains(
        part_of=part_of,
        group_of=_numbered(met),
        between=reached[np.ix_(first, first)],
        scored=others.any(axis=1),
        conceded=others.any(axis=0),
    )


def chains_in_sets(
    *, contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(n, C, C) who reached whom in each of n sets of votes.

    The row's contestant reached the column's by a score against them, or through a chain.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        games: (P, n) comparisons of each pair in each set.
        scores: (P, n) what `low` scored in them.
    """
    return closure(_scored(contestants, low, high, games, scores))


def are_determined(
    *, contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(n,) which sets have finite Bradley-Terry strengths for everybody; as `chains_in_sets`."""
    found = np.empty(games.shape[1], dtype=np.bool_)
    at_once = max(1, _BITS_AT_ONCE // max(1, contestants**2))
    for first in range(0, len(found), at_once):
        some = slice(first, first + at_once)
        scored = _scored(contestants, low, high, games[:, some], scores[:, some])
        found[some] = _all_from_first(scored) & _all_from_first(scored.transpose(0, 2, 1))
    return found


def heaviest_tree(contestants: int, low: IntArray, high: IntArray, weight: FloatArray) -> IntArray:
    """Return the pairs of the heaviest tree (Kruskal 1956), over pairs of weight above zero."""
    group = np.arange(contestants)
    chosen: list[int] = []
    for pair in np.argsort(-weight, kind="stable"):
        one, other = group[low[pair]], group[high[pair]]
        if weight[pair] > 0 and one != other:
            group[group == other] = one
            chosen.append(int(pair))
            if len(chosen) == contestants - 1:
                break
    return np.array(chosen, dtype=np.int64)


def closure(edges: BoolArray) -> BoolArray:
    """(n, C, C) who is reached through chains of edges (n, C, C) (Warshall 1962)."""
    contestants = edges.shape[1]
    reached = np.packbits(edges, axis=2)
    for via in range(contestants):
        leads_there = (reached[:, :, via // 8] >> (7 - via % 8) & 1) * np.uint8(255)
        reached |= leads_there[:, :, None] & reached[:, via, None]
    return np.unpackbits(reached, axis=2, count=contestants).view(np.bool_)


# --- Private -----------------------------------------------------------------------------------


def _scored(
    contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(n, C, C) whether the row's contestant ever scored against the column's; itself counts."""
    scored = np.zeros((games.shape[1], contestants, contestants), dtype=np.bool_)
    scored[:, low, high] = (scores > 0).T
    scored[:, high, low] = (scores < games).T
    scored[:, np.arange(contestants), np.arange(contestants)] = True
    return scored


def _all_from_first(scored: BoolArray) -> BoolArray:
    """(n,) whether the first contestant reaches everybody by scores (n, C, C)."""
    steps = scored.astype(np.float32)
    reached = scored[:, :1]
    while True:
        further = reached.astype(np.float32) @ steps > 0
        if (further == reached).all():
            return np.asarray(reached.all(axis=(1, 2)))
        reached = further


def _numbered(together: BoolArray) -> IntArray:
    """(C,) the number of each one's class, in the order of their first members."""
    if not len(together):
        return np.empty(0, dtype=np.int64)
    return np.unique(together.argmax(axis=1), return_inverse=True)[1].astype(np.int64)


def _members_of(number_of: IntArray) -> tuple[tuple[int, ...], ...]:
    """Return who has each of the numbers (C,), from 0."""
    order = np.argsort(number_of, kind="stable")
    ends = np.cumsum(np.bincount(number_of))[:-1]
    return tuple(tuple(some.tolist()) for some in np.split(order, ends) if len(some))


# --- What the votes allow ------------------------------------------------------------------------


NAMED = 3
"""A sentence names so many contestants at most."""


def few_of(names: Sequence[str]) -> Sequence[str]:
    """The first names, and an ellipsis where there are more."""
    return names if len(names) <= NAMED else (*names[:NAMED], "…")


class Status(StrEnum):
    """What the votes allow."""

    RATED = "rated"
    NO_VOTES = "no votes"
    ONE_CONTESTANT = "one contestant"
    DISCONNECTED = "disconnected"
    UNBOUNDED = "unbounded"
    ALL_TIES = "all ties"
    NO_INTERVALS = "no intervals"
    OPEN_INTERVALS = "open intervals"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What the votes allow to say.

    Attributes:
        explanation: The sentences on the status, none where nothing is amiss.
        chains: Who reaches whom by scores, among parts: those who can be rated among each other,
            a part of one without a rating.
        notes: Why each contestant has no rating; empty for who has one.
    """

    status: Status
    explanation: tuple[str, ...] = ()
    chains: Chains = field(default_factory=Chains.of_nobody, compare=False)
    notes: tuple[str, ...] = ()


def diagnose(
    names: tuple[str, ...], counts: PairCounts, *, bounded_anyway: bool = False
) -> Diagnosis:
    """What the votes allow to say about contestants who all have votes.

    Args:
        names: (C,) as in the counts.
        counts: Of the full data.
        bounded_anyway: The method rates also those who won or lost everything.
    """
    if not len(names) or not counts.outcomes.sum():
        said = "There are no votes to rate."
        return Diagnosis(status=Status.NO_VOTES, explanation=(said,))
    chains = chains_among(len(names), counts)
    groups = chains.groups()
    if bounded_anyway:
        chains = chains.by_group()
    parts = chains.parts()
    if len(parts) > 1:
        explanation = [_who_is_apart(names, groups)] if len(groups) > 1 else []
        if not bounded_anyway:
            explanation += _who_is_unbounded(names, chains)
        return Diagnosis(
            status=Status.DISCONNECTED if len(groups) > 1 else Status.UNBOUNDED,
            explanation=tuple(explanation),
            chains=chains,
            notes=_notes(parts, chains),
        )
    if not (counts.outcomes[:, 0].any() or counts.outcomes[:, 2].any()):
        return Diagnosis(
            status=Status.ALL_TIES,
            explanation=(
                (
                    "Every vote is a tie: all are rated alike, and the votes do not say how sure "
                    "that is."
                ),
            ),
            chains=chains,
        )
    return Diagnosis(status=Status.RATED, chains=chains)


def _who_is_apart(names: tuple[str, ...], groups: tuple[tuple[int, ...], ...]) -> str:
    listed = _joined([_listed(names, group) for group in groups])
    return (
        f"These groups were never compared with each other: {listed}. Each is rated by itself; "
        "ratings across them have no meaning."
    )


def _notes(parts: tuple[tuple[int, ...], ...], chains: Chains) -> tuple[str, ...]:
    """(C,) why those who are alone in their part have no rating."""
    notes: list[str] = [""] * len(chains.part_of)
    for part in parts:
        if len(part) == 1:
            lower, upper = bool(chains.scored[part[0]]), bool(chains.conceded[part[0]])
            notes[part[0]] = _LIMITS[lower, upper]
    return tuple(notes)


_LIMITS = {
    (True, True): "no limits among equals",
    (True, False): "no upper limit",
    (False, True): "no lower limit",
    (False, False): "no lower limit and no upper limit",
}
"""By whether there is a lower and an upper one."""


def _who_is_unbounded(names: tuple[str, ...], chains: Chains) -> list[str]:
    """Sentences about those who won or lost everything against the rest that they met."""
    members, group_of_part = chains.parts(), chains.group_of[chains.first_of_parts]
    has_rest = np.bincount(group_of_part)[group_of_part] > 1
    is_unbeaten = has_rest & (chains.between.sum(axis=0) == 1)
    is_scoreless = has_rest & (chains.between.sum(axis=1) == 1)
    unbeaten, scoreless = (
        [_listed(names, members[part]) for part in np.flatnonzero(which).tolist()]
        for which in (is_unbeaten, is_scoreless)
    )
    sentences = []
    if unbeaten:
        sentences.append(
            f"Nobody else scored against {_joined(unbeaten)}: there is no upper limit."
        )
    if scoreless:
        sentences.append(
            f"{_joined(scoreless)} scored against nobody else: there is no lower limit."
        )
    return sentences


def _joined(groups: Sequence[str]) -> str:
    return "; ".join(few_of(groups))


def _listed(names: tuple[str, ...], group: Sequence[int]) -> str:
    return ", ".join(few_of([names[index] for index in group]))
