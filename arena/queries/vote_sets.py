"""The votes that a rating is made of: which count, and which do not and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from arena.models import Study
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.queries.judged import (
    AUTOMATIC,
    RATED,
    Entrant,
    Judged,
    entrants_of,
    references,
    settled_ties,
    votes_up_to,
)
from augment.errors import UnknownName
from augment.services.scenarios.types import ScenarioType

KINDS = (MAIN, REPEAT)
"""What may be rated: planned showings, and on demand the hidden repeats of them."""


class LeftOut(StrEnum):
    """Why a vote is no part of a rating. The first reason that fits is the one that is said."""

    SUPERSEDED = "superseded"
    CHECK = "check"
    REPEAT = "repeat"
    SKIP = "skip"
    SIMULATED = "simulated"
    FILTERED = "filtered"
    OWN = "own"


@dataclass(frozen=True, slots=True, kw_only=True)
class Filters:
    """Which votes are asked for.

    Attributes:
        types: Of scenarios; empty is all.
        experts: Codes of judges; empty is all.
        kinds: Of matchups.
        leave_out_settled: Whether pairs that nobody was shown, because nobody can tell them
            apart, do not count as ties.
        leave_out_own: Whether votes of authors on their own contestants do not count.
        authors: Who was marked author of what when the votes were frozen, codes of judges with
            slugs of contestants. They are known also where their votes count.
    """

    types: tuple[str, ...] = ()
    experts: tuple[str, ...] = ()
    kinds: tuple[str, ...] = (MAIN,)
    leave_out_settled: bool = False
    leave_out_own: bool = False
    authors: frozenset[tuple[str, str]] = frozenset()

    def is_own(self, judge: str, left: str, right: str) -> bool:
        """Whether a judge is marked author of one of the two."""
        return (judge, left) in self.authors or (judge, right) in self.authors

    def as_document(self) -> dict[str, Any]:
        """As a snapshot keeps it."""
        return {
            "types": list(self.types),
            "experts": list(self.experts),
            "kinds": list(self.kinds),
            "leave_out_settled": self.leave_out_settled,
            "leave_out_own": self.leave_out_own,
            "authors": [list(pair) for pair in sorted(self.authors)],
        }

    @classmethod
    def of_document(cls, document: dict[str, Any]) -> Filters:
        """What `as_document` wrote; older snapshots left settled pairs out."""
        return cls(
            types=tuple(document.get("types", ())),
            experts=tuple(document.get("experts", ())),
            kinds=tuple(document.get("kinds", (MAIN,))),
            leave_out_settled=bool(document.get("leave_out_settled", True)),
            leave_out_own=bool(document.get("leave_out_own", False)),
            authors=frozenset((judge, slug) for judge, slug in document.get("authors", ())),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteSet:
    """What is rated, in the order in which it was decided.

    Attributes:
        entrants: By slug.
        counted: The votes that count.
        with_own: The same and, where they are left out for that alone, those of authors on their
            own contestants.
        repeats: Decided hidden repeats, whether they count or not.
        checks: Votes on attention checks, and `references` who should win them.
        left_out: How many votes do not count, by reason.
    """

    entrants: tuple[Entrant, ...]
    counted: tuple[Judged, ...]
    with_own: tuple[Judged, ...]
    repeats: tuple[Judged, ...]
    checks: tuple[Judged, ...]
    references: frozenset[str]
    left_out: dict[str, int]


def vote_set(study: Study, *, filters: Filters, last: int | None) -> VoteSet:
    """The votes of a study up to a row.

    Args:
        study: A study of matchups, or one of votes from elsewhere.
        filters: Which of its votes count.
        last: See `judged.last_vote_of`; None for none at all.

    Raises:
        UnknownName: A filter names a type, a judge or a kind that does not occur.
    """
    for kind in filters.kinds:
        if kind not in KINDS:
            raise UnknownName("kind of vote", kind, list(KINDS))
    lines, superseded = votes_up_to(study, last)
    entrants = entrants_of(study, lines)
    automatic = [] if filters.leave_out_settled else settled_ties(study, lines)
    _check(filters, [*lines, *automatic])
    simulated = {entrant.slug for entrant in entrants if entrant.is_simulated}
    judged = [
        (line, why_left_out(line, filters, simulated, study.allow_simulated))
        for line in [*lines, *automatic]
    ]
    left_out = Counter(reason.value for _, reason in judged if reason is not None)
    left_out[LeftOut.SUPERSEDED.value] = superseded
    checks = tuple(line for line, reason in judged if reason is LeftOut.CHECK)
    return VoteSet(
        entrants=entrants,
        counted=tuple(line for line, reason in judged if reason is None),
        with_own=tuple(line for line, reason in judged if reason in (None, LeftOut.OWN)),
        repeats=tuple(line for line, _ in judged if line.kind == REPEAT and line.outcome in RATED),
        checks=checks,
        references=references() if checks else frozenset(),
        left_out={reason: number for reason, number in sorted(left_out.items()) if number},
    )


def is_own_vote(line: Judged, filters: Filters) -> bool:
    """Whether an author voted on a contestant of their own; settled ties are nobody's votes."""
    return line.kind != AUTOMATIC and filters.is_own(line.judge, line.left, line.right)


def why_left_out(
    line: Judged, filters: Filters, simulated: set[str], allow_simulated: bool
) -> LeftOut | None:
    """Why a vote does not count, None if it does."""
    made_up = line.is_simulated or line.left in simulated or line.right in simulated
    other_type = bool(filters.types) and line.type not in filters.types
    other_expert = bool(filters.experts) and line.judge not in filters.experts
    reasons = (
        (LeftOut.CHECK, line.kind == CHECK),
        (LeftOut.REPEAT, line.kind == REPEAT and REPEAT not in filters.kinds),
        (LeftOut.SKIP, line.outcome not in RATED),
        (LeftOut.SIMULATED, made_up and not allow_simulated),
        (LeftOut.FILTERED, other_type or other_expert),
        (LeftOut.FILTERED, line.kind in (MAIN, AUTOMATIC) and MAIN not in filters.kinds),
        (LeftOut.OWN, filters.leave_out_own and is_own_vote(line, filters)),
    )
    return next((reason for reason, holds in reasons if holds), None)


# --- Private -----------------------------------------------------------------------------------


def _check(filters: Filters, lines: Sequence[Judged]) -> None:
    known_types = {*list(ScenarioType), *(line.type for line in lines)}
    for name in filters.types:
        if name not in known_types:
            raise UnknownName("scenario type", name, sorted(known_types))
    judges = {line.judge for line in lines}
    for name in filters.experts:
        if name not in judges:
            raise UnknownName("expert", name, sorted(judges))
