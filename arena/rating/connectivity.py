"""Whether votes determine ratings at all, and if not, why.

Notation: C contestants.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from arena.rating.chains import Chains, chains_among
from arena.rating.comparisons import PairCounts

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
