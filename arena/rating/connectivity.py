"""Whether votes determine ratings at all, and if not, why.

Strengths exist when everybody scored against everybody else through some chain of comparisons,
both ways (Ford 1957). A tie is a score both ways.

Notation: B rounds, C contestants, P pairs.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from arena.rating.comparisons import BoolArray, FloatArray, IntArray, PairCounts


class Status(StrEnum):
    """What the votes allow."""

    RATED = "rated"
    NO_VOTES = "no votes"
    ONE_CONTESTANT = "one contestant"
    DISCONNECTED = "disconnected"
    UNBOUNDED = "unbounded"
    ALL_TIES = "all ties"


@dataclass(frozen=True, slots=True, kw_only=True)
class Diagnosis:
    """A status and the sentence that explains it, empty where nothing is amiss."""

    status: Status
    explanation: str = ""

    @property
    def has_ratings(self) -> bool:
        """Whether point estimates exist."""
        return self.status in (Status.RATED, Status.ALL_TIES)


def diagnose(names: tuple[str, ...], counts: PairCounts) -> Diagnosis:
    """What the votes allow to say about contestants who all have votes.

    Args:
        names: (C,) as in the counts.
        counts: Of the full data.
    """
    if not len(names) or not counts.outcomes.sum():
        return Diagnosis(status=Status.NO_VOTES, explanation="There are no votes to rate.")
    scored = _scored(len(names), counts.low, counts.high, counts.games[None], counts.scores[None])
    parts = _groups(_closure(scored | scored.transpose(0, 2, 1))[0])
    if len(parts) > 1:
        listed = "; ".join(_listed(names, part) for part in parts)
        return Diagnosis(
            status=Status.DISCONNECTED,
            explanation=f"These groups were never compared with each other: {listed}. "
            "Ratings across them have no meaning.",
        )
    reached = _closure(scored)[0]
    if not reached.all():
        return Diagnosis(status=Status.UNBOUNDED, explanation=_who_is_unbounded(names, reached))
    if not (counts.outcomes[:, 0].any() or counts.outcomes[:, 2].any()):
        return Diagnosis(
            status=Status.ALL_TIES,
            explanation="Every vote is a tie: all are rated alike, and the votes do not say how "
            "sure that is.",
        )
    return Diagnosis(status=Status.RATED)


def determined(
    *, contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(B,) which rounds have finite Bradley-Terry strengths for every contestant.

    Args:
        contestants: C.
        low: (P,) who met.
        high: (P,) whom.
        games: (B, P) comparisons of each pair in each round.
        scores: (B, P) what `low` scored in them.
    """
    if not len(low):
        return np.zeros(len(games), dtype=bool)
    # A round in which every pair scored both ways is fine if the pairs connect everybody, which
    # most rounds show at once; only the others need the walk through all chains.
    both_ways = ((scores > 0) & (scores < games)).all(axis=1)
    everybody = np.ones((1, len(low)))
    linked = _closure(_scored(contestants, low, high, 2 * everybody, everybody))[0].all()
    fine: BoolArray = np.asarray(both_ways & bool(linked))
    unclear = np.flatnonzero(~fine)
    if len(unclear):
        scored = _scored(contestants, low, high, games[unclear], scores[unclear])
        fine[unclear] = _closure(scored).all(axis=(1, 2))
    return fine


def _scored(
    contestants: int, low: IntArray, high: IntArray, games: FloatArray, scores: FloatArray
) -> BoolArray:
    """(B, C, C) whether the row's contestant ever scored against the column's; itself counts."""
    scored = np.zeros((len(games), contestants, contestants), dtype=bool)
    scored[:, low, high] = scores > 0
    scored[:, high, low] = games - scores > 0
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


def _who_is_unbounded(names: tuple[str, ...], reached: BoolArray) -> str:
    """Sentences about those who won or lost everything against the rest."""
    sentences = []
    for group in _groups(reached):
        rest = [index for index in range(len(names)) if index not in group]
        if not reached[np.ix_(rest, group)].any():
            sentences.append(
                f"Nobody else scored against {_listed(names, group)}: there is no upper limit."
            )
        if not reached[np.ix_(group, rest)].any():
            sentences.append(
                f"{_listed(names, group)} scored against nobody else: there is no lower limit."
            )
    return " ".join(sentences)


def _listed(names: tuple[str, ...], group: list[int]) -> str:
    return ", ".join(names[index] for index in group)
