"""Whether votes determine ratings at all, and if not, why.

Strengths exist when everybody scored against everybody else through some chain of comparisons,
both ways (Ford 1957). A tie is a score both ways.

Notation: C contestants, P pairs, B rounds, which are the last axis.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from typing import TypeVar

import numpy as np

from arena.rating.chains import Chains, chains_among
from arena.rating.comparisons import BoolArray, FloatArray, IntArray, PairCounts
from augment.sentences import Sentence, sentence

_NUMBERS_AT_ONCE = 4_000_000


_Named = TypeVar("_Named")

NAMED = 3
"""A sentence names so many contestants at most."""


def few_of(names: tuple[_Named, ...], *, mark: _Named) -> tuple[_Named, ...]:
    """The first names, and a mark where there are more."""
    return names if len(names) <= NAMED else (*names[:NAMED], mark)


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
    explanation: tuple[Sentence, ...] = ()
    chains: Chains = field(default_factory=Chains.of_nobody, compare=False)
    notes: tuple[Sentence | str, ...] = ()


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
        said = sentence("There are no votes to rate.")
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
                sentence(
                    "Every vote is a tie: all are rated alike, and the votes do not say how sure "
                    "that is."
                ),
            ),
            chains=chains,
        )
    return Diagnosis(status=Status.RATED, chains=chains)


class Determined:
    """Which resampled rounds have finite Bradley-Terry strengths for every contestant.

    Most rounds are cleared by a look at a few pairs: if those of one tree that joins everybody
    scored both ways, so did everybody through chains of them. The tree is made of the pairs with
    the most scores either way in the data; only rounds in which one of them fails are followed
    through all chains.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        games: (P,) comparisons of each pair in the data.
        scores: (P,) what `low` scored in them.
    """

    def __init__(
        self,
        *,
        contestants: int,
        low: IntArray,
        high: IntArray,
        games: FloatArray,
        scores: FloatArray,
    ) -> None:
        self._contestants, self._low, self._high = contestants, low, high
        self._tree = heaviest_tree(contestants, low, high, np.minimum(scores, games - scores))

    def among(self, games: FloatArray, scores: FloatArray) -> BoolArray:
        """(B,) for rounds of games and scores (P, B)."""
        if len(self._tree) == self._contestants - 1:
            of_tree = scores[self._tree]
            fine = np.asarray(((of_tree > 0) & (of_tree < games[self._tree])).all(axis=0))
        else:
            fine = np.zeros(games.shape[1], dtype=np.bool_)
        for some, scored in self._scored(games, scores, np.flatnonzero(~fine)):
            fine[some] = _all_from_first(scored) & _all_from_first(scored.transpose(0, 2, 1))
        return fine

    def chains(
        self, games: FloatArray, scores: FloatArray, chosen: IntArray
    ) -> Iterator[tuple[IntArray, BoolArray]]:
        """Some of the chosen rounds (n,) of (P, B) at a time, and (n, C, C) who reached whom.

        The row's contestant reached the column's by a score against them, or through a chain.
        """
        for some, scored in self._scored(games, scores, chosen):
            yield some, _closure(scored)

    def _scored(
        self, games: FloatArray, scores: FloatArray, chosen: IntArray
    ) -> Iterator[tuple[IntArray, BoolArray]]:
        at_once = max(1, _NUMBERS_AT_ONCE // max(1, self._contestants**2))
        for first in range(0, len(chosen), at_once):
            some = chosen[first : first + at_once]
            yield (
                some,
                _scored(self._contestants, self._low, self._high, games[:, some], scores[:, some]),
            )


def are_determined(
    *, contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(n,) which of n sets of votes have finite Bradley-Terry strengths for every contestant.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        games: (n, P) comparisons of each pair in each set.
        scores: (n, P) what `low` scored in them.
    """
    everywhere = Determined(
        contestants=contestants,
        low=low,
        high=high,
        games=games.sum(axis=0),
        scores=scores.sum(axis=0),
    )
    return everywhere.among(games.T, scores.T)


def heaviest_tree(contestants: int, low: IntArray, high: IntArray, weight: FloatArray) -> IntArray:
    """The pairs of the heaviest tree (Kruskal 1956), over pairs of weight above zero."""
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


def _scored(
    contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(B, C, C) whether the row's contestant ever scored against the column's; itself counts."""
    scored = np.zeros((games.shape[1], contestants, contestants), dtype=bool)
    scored[:, low, high] = (scores > 0).T
    scored[:, high, low] = (scores < games).T
    scored[:, np.arange(contestants), np.arange(contestants)] = True
    return scored


def _closure(edges: BoolArray) -> BoolArray:
    """(B, C, C) who is reached through chains; each squaring doubles their length."""
    while True:
        steps = edges.astype(np.float32)
        further = steps @ steps > 0
        if (further == edges).all():
            return edges
        edges = further


def _all_from_first(scored: BoolArray) -> BoolArray:
    """(B,) whether the first contestant reaches everybody by scores (B, C, C)."""
    steps = scored.astype(np.float32)
    reached = scored[:, :1]
    while True:
        further = reached.astype(np.float32) @ steps > 0
        if (further == reached).all():
            return np.asarray(reached.all(axis=(1, 2)))
        reached = further


def _who_is_apart(names: tuple[str, ...], groups: tuple[tuple[int, ...], ...]) -> Sentence:
    return sentence(
        "These groups were never compared with each other: %(groups)s. Each is rated by itself; "
        "ratings across them have no meaning.",
        groups=few_of(tuple(_listed(names, group) for group in groups), mark=("…",)),
    )


def _notes(parts: tuple[tuple[int, ...], ...], chains: Chains) -> tuple[Sentence | str, ...]:
    """(C,) why those who are alone in their part have no rating."""
    notes: list[Sentence | str] = [""] * len(chains.part_of)
    for part in parts:
        if len(part) == 1:
            lower, upper = bool(chains.scored[part[0]]), bool(chains.conceded[part[0]])
            notes[part[0]] = _LIMITS[lower, upper]
    return tuple(notes)


_LIMITS = {
    (True, True): sentence("no limits among equals"),
    (True, False): sentence("no upper limit"),
    (False, True): sentence("no lower limit"),
    (False, False): sentence("no lower limit and no upper limit"),
}
"""By whether there is a lower and an upper one."""


def _who_is_unbounded(names: tuple[str, ...], chains: Chains) -> list[Sentence]:
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
            sentence(
                "Nobody else scored against %(names)s: there is no upper limit.",
                names=_groups_or_one(unbeaten),
            )
        )
    if scoreless:
        sentences.append(
            sentence(
                "%(names)s scored against nobody else: there is no lower limit.",
                names=_groups_or_one(scoreless),
            )
        )
    return sentences


def _groups_or_one(
    groups: list[tuple[str, ...]],
) -> tuple[str, ...] | tuple[tuple[str, ...], ...]:
    return groups[0] if len(groups) == 1 else few_of(tuple(groups), mark=("…",))


def _listed(names: tuple[str, ...], group: Sequence[int]) -> tuple[str, ...]:
    return few_of(tuple(names[index] for index in group), mark="…")
