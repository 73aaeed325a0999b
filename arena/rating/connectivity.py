"""Whether votes determine ratings at all, and if not, why.

Strengths exist when everybody scored against everybody else through some chain of comparisons,
both ways (Ford 1957). A tie is a score both ways.

Notation: C contestants, P pairs, B rounds, which are the last axis.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import BoolArray, FloatArray, IntArray, PairCounts
from augment.sentences import Sentence, sentence

_NUMBERS_AT_ONCE = 4_000_000


class Status(StrEnum):
    """What the votes allow."""

    RATED = "rated"
    NO_VOTES = "no votes"
    ONE_CONTESTANT = "one contestant"
    DISCONNECTED = "disconnected"
    UNBOUNDED = "unbounded"
    ALL_TIES = "all ties"
    NO_INTERVALS = "no intervals"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """What the votes allow to say.

    Attributes:
        explanation: The sentences on the status, none where nothing is amiss.
        parts: Those who can be rated among each other, numbers as in the counts, in order of their
            first member; a part of one has no rating.
        notes: Why each contestant has no rating; empty for who has one.
    """

    status: Status
    explanation: tuple[Sentence, ...] = ()
    parts: tuple[tuple[int, ...], ...] = ()
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
    games, scores = counts.games[:, None], counts.scores[:, None]
    scored = _scored(len(names), counts.low, counts.high, games, scores)
    apart = _groups(_closure(scored | scored.transpose(0, 2, 1))[0])
    reached = _closure(scored)[0]
    parts = tuple(map(tuple, apart if bounded_anyway else _groups(reached)))
    if len(parts) > 1:
        explanation = [_who_is_apart(names, apart)] if len(apart) > 1 else []
        if not bounded_anyway:
            explanation += _who_is_unbounded(names, reached)
        return Diagnosis(
            status=Status.DISCONNECTED if len(apart) > 1 else Status.UNBOUNDED,
            explanation=tuple(explanation),
            parts=parts,
            notes=_notes(parts, scored[0]),
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
            parts=parts,
        )
    return Diagnosis(status=Status.RATED, parts=parts)


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
        self._tree = _tree(contestants, low, high, np.minimum(scores, games - scores))

    def among(self, games: FloatArray, scores: FloatArray) -> BoolArray:
        """(B,) for rounds of games and scores (P, B)."""
        if len(self._tree) == self._contestants - 1:
            of_tree = scores[self._tree]
            fine = np.asarray(((of_tree > 0) & (of_tree < games[self._tree])).all(axis=0))
        else:
            fine = np.zeros(games.shape[1], dtype=np.bool_)
        unclear = np.flatnonzero(~fine)
        at_once = max(1, _NUMBERS_AT_ONCE // max(1, self._contestants**2))
        for first in range(0, len(unclear), at_once):
            some = unclear[first : first + at_once]
            scored = _scored(
                self._contestants, self._low, self._high, games[:, some], scores[:, some]
            )
            fine[some] = _closure(scored).all(axis=(1, 2))
        return fine


def determined(
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


def _tree(contestants: int, low: IntArray, high: IntArray, weight: FloatArray) -> IntArray:
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
    length = 1
    while length < edges.shape[-1]:
        steps = edges.astype(np.float32)
        edges = steps @ steps > 0
        length *= 2
    return edges


def _groups(reached: BoolArray) -> list[list[int]]:
    """Contestants who reach each other, in order of their first member; `reached` is (C, C)."""
    mutual = reached & reached.T
    return [
        np.flatnonzero(row).tolist()
        for index, row in enumerate(mutual)
        if int(np.argmax(row)) == index
    ]


def _who_is_apart(names: tuple[str, ...], groups: list[list[int]]) -> Sentence:
    return sentence(
        "These groups were never compared with each other: %(groups)s. Each is rated by itself; "
        "ratings across them have no meaning.",
        groups=tuple(_listed(names, group) for group in groups),
    )


def _notes(parts: tuple[tuple[int, ...], ...], scored: BoolArray) -> tuple[Sentence | str, ...]:
    """(C,) why those who are alone in their part have no rating."""
    notes: list[Sentence | str] = [""] * len(scored)
    for part in parts:
        if len(part) > 1:
            continue
        others = np.delete(np.arange(len(scored)), part[0])
        lower = bool(scored[part[0], others].any())
        upper = bool(scored[others, part[0]].any())
        notes[part[0]] = _LIMITS[lower, upper]
    return tuple(notes)


_LIMITS = {
    (True, True): sentence("no limits among equals"),
    (True, False): sentence("no upper limit"),
    (False, True): sentence("no lower limit"),
    (False, False): sentence("no lower limit and no upper limit"),
}
"""By whether there is a lower and an upper one."""


def _who_is_unbounded(names: tuple[str, ...], reached: BoolArray) -> list[Sentence]:
    """Sentences about those who won or lost everything against the rest that they met."""
    sentences = []
    met = _closure((reached | reached.T)[None])[0]
    for group in _groups(reached):
        inside = np.zeros(len(names), dtype=bool)
        inside[group] = True
        rest = met[group[0]] & ~inside
        if not rest.any():
            continue
        if not reached[np.ix_(rest, inside)].any():
            sentences.append(
                sentence(
                    "Nobody else scored against %(names)s: there is no upper limit.",
                    names=_listed(names, group),
                )
            )
        if not reached[np.ix_(inside, rest)].any():
            sentences.append(
                sentence(
                    "%(names)s scored against nobody else: there is no lower limit.",
                    names=_listed(names, group),
                )
            )
    return sentences


def _listed(names: tuple[str, ...], group: list[int]) -> tuple[str, ...]:
    return tuple(names[index] for index in group)
