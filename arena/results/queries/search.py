"""Which votes of a rating somebody looks for: what stands in the address of a list of votes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from enum import StrEnum

from django.db.models import Exists, OuterRef, Q, QuerySet

from arena.models import Snapshot, Vote
from arena.pairing.order import CHECK, REPEAT
from arena.rating.reliability import FAST_MS
from arena.results.queries.votes import RATED, Filters, LeftOut, marked_votes, own_votes
from augment.models import Contestant

COUNTED, EVERY, LEFT_OUT, AUTOMATIC_TIE = "counted", "all", "left_out", "automatic"
"""Marks beside the reasons of `vote_sets.LeftOut`: what counts, everything, all that does not, and
pairs that nobody can tell apart where the rating does not count them."""


class SoughtOutcome(StrEnum):
    """How a vote came out; the first three are seen from the contestant that is looked for."""

    WON = "won"
    TIED = "tied"
    LOST = "lost"
    LEFT = "left"
    EQUAL = "equal"
    RIGHT = "right"
    DECIDED = "decided"
    BOTH_MISS = "both_miss"
    SKIP = "skip"

    @property
    def needs_contestant(self) -> bool:
        """Whether it says nothing without one."""
        return self in (SoughtOutcome.WON, SoughtOutcome.TIED, SoughtOutcome.LOST)


class SoughtPart(StrEnum):
    """A part of the votes that a number of the results stands for."""

    COMMENTED = "commented"
    FAST = "fast"
    OWN = "own"
    REPEATS = "repeats"
    ALIKE = "alike"
    CHECKS = "checks"
    PASSED = "passed"
    CHECKS_SKIPPED = "checks_skipped"
    SHARED = "shared"


class SoughtOrder(StrEnum):
    """What comes first; empty is the order in which the votes were given."""

    DISPUTED = "disputed"
    LOST = "lost"
    FAULTS = "faults"
    SCENARIO = "scenario"


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteSearch:
    """What is looked for; empty is all.

    Attributes:
        contestant, opponent: Slugs of who was shown.
        scenario: A slug, and `type` the type of scenarios.
        sample: Its number, in a study that shows every sample on its own.
        expert: The code of a judge.
        outcome: Of `SoughtOutcome`.
        part: Of `SoughtPart`.
        mark: Why votes do not count, or one of the words above.
        comment: Words in the expert's comment.
        aid: What the expert looked with.
        order: Of `SoughtOrder`.
    """

    contestant: str = ""
    opponent: str = ""
    scenario: str = ""
    sample: str = ""
    type: str = ""
    expert: str = ""
    outcome: str = ""
    part: str = ""
    mark: str = COUNTED
    comment: str = ""
    aid: str = ""
    order: str = ""

    def as_query(self) -> dict[str, str]:
        """What an address says of it: nothing of what is left as it is."""
        found = {one.name: str(getattr(self, one.name)) for one in fields(self)}
        return {name: text for name, text in found.items() if text != _DEFAULTS[name]}

    @classmethod
    def of_query(cls, query: Mapping[str, str]) -> VoteSearch:
        """What `as_query` wrote; other words of the address are somebody else's."""
        return cls(**{name: query[name] for name in _DEFAULTS if query.get(name)})


_DEFAULTS = {one.name: str(one.default) for one in fields(VoteSearch)}


_Rows = QuerySet[Vote]


def find_part(rows: QuerySet[Vote], snapshot: Snapshot, part: SoughtPart) -> QuerySet[Vote]:
    """Those of the rating's marked votes that belong to the part."""
    return _PARTS[part](rows, snapshot)


# --- Private -----------------------------------------------------------------------------------


def _first_votes(snapshot: Snapshot) -> _Rows:
    """The vote that counts on what a hidden repeat shows again."""
    return marked_votes(snapshot).filter(Q(mark=COUNTED), matchup=OuterRef("matchup__repeat_of"))


def _repeats(rows: _Rows, snapshot: Snapshot) -> _Rows:
    decided = rows.filter(matchup__kind=REPEAT, outcome__in=RATED)
    current = decided.exclude(Q(mark=LeftOut.SUPERSEDED.value))
    return current.filter(Exists(_first_votes(snapshot)))


def _alike(rows: _Rows, snapshot: Snapshot) -> _Rows:
    first = _first_votes(snapshot)
    tied, won = first.filter(winner=None), first.filter(winner=OuterRef("winner"))
    return _repeats(rows, snapshot).filter(
        (Q(winner=None) & Exists(tied)) | (Q(winner__isnull=False) & Exists(won))
    )


def _own_votes(rows: _Rows, snapshot: Snapshot) -> _Rows:
    return rows.filter(own_votes(Filters.of_document(snapshot.filters)))


def _shared(rows: _Rows, snapshot: Snapshot) -> _Rows:
    """Votes on what another expert's vote that counts is on as well."""
    others = marked_votes(snapshot).filter(
        Q(mark=COUNTED), matchup__scenario=OuterRef("matchup__scenario")
    )
    others = others.exclude(expert=OuterRef("expert"))
    left, right = "shown_left__contestant", "shown_right__contestant"
    alike = others.filter(**{left: OuterRef(left), right: OuterRef(right)})
    turned = others.filter(**{left: OuterRef(right), right: OuterRef(left)})
    return rows.filter(Exists(alike) | Exists(turned))


_PARTS: dict[SoughtPart, Callable[[_Rows, Snapshot], _Rows]] = {
    SoughtPart.COMMENTED: lambda rows, _: rows.exclude(comment=""),
    SoughtPart.FAST: lambda rows, _: rows.filter(ms_visible__lt=FAST_MS),
    SoughtPart.OWN: _own_votes,
    SoughtPart.REPEATS: _repeats,
    SoughtPart.ALIKE: _alike,
    SoughtPart.CHECKS: lambda rows, _: rows.filter(matchup__kind=CHECK, outcome__in=RATED),
    SoughtPart.SHARED: _shared,
    SoughtPart.PASSED: lambda rows, _: rows.filter(
        matchup__kind=CHECK, winner__contestant__kind=Contestant.Kind.REFERENCE
    ),
    SoughtPart.CHECKS_SKIPPED: lambda rows, _: rows.filter(matchup__kind=CHECK, outcome="skip"),
}
