"""The votes that a rating is made of: which count, and which do not and why."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any
from uuid import UUID

from django.db.models import Case, Q, QuerySet, Value, When
from django.db.models.fields import CharField

from arena.models import ImportedVote, Person, Snapshot, Study, Vote
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.queries.votes.judged import (
    AUTOMATIC,
    RATED,
    Entrant,
    Judged,
    entrants_of,
    is_imported,
    references,
    settled_ties,
    votes_up_to,
)
from arena.queries.votes.search import COUNTED
from augment.errors import UnknownName
from augment.models import Contestant
from augment.services.scenarios.scenes import ScenarioType

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
    marks = _marks(study, filters, last)
    judged = [
        (
            line,
            marks[line.matchup]
            if line.matchup is not None
            else why_left_out(line, filters, simulated, study.allow_simulated),
        )
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
    """Return why a vote without a showing does not count: a settled tie, or one from a file."""
    made_up = line.is_simulated or line.left in simulated or line.right in simulated
    if made_up and not allow_simulated:
        return LeftOut.SIMULATED
    is_other = (filters.types and line.type not in filters.types) or (
        filters.experts and line.judge not in filters.experts
    )
    if is_other or MAIN not in filters.kinds:
        return LeftOut.FILTERED
    return LeftOut.OWN if filters.leave_out_own and is_own_vote(line, filters) else None


def marked_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """All votes up to a rating with their `mark`: the first reason that fits, or COUNTED.

    At most three queries beside its own: who is simulated, who was asked for, who is author.
    """
    filters = Filters.of_document(snapshot.filters)
    return _marked(snapshot.study, filters, snapshot.last_vote)


def counted_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """The rows that the rating is made of, without those of pairs that nobody was shown."""
    return marked_votes(snapshot).filter(Q(mark=COUNTED))


def own_votes(filters: Filters) -> Q:
    """Votes of authors on their own contestants; one query."""
    users = users_of(sorted({judge for judge, _ in filters.authors}))
    own = Q(pk=None)
    for judge, slug in sorted(filters.authors):
        shown = Q(shown_left__contestant__slug=slug) | Q(shown_right__contestant__slug=slug)
        own |= Q(expert=users.get(judge)) & shown
    return own


def made_up_contestants(study: Study) -> QuerySet[Contestant]:
    """Who of the study is simulated."""
    return study.contestants.filter(kind=Contestant.Kind.SIMULATED)


def users_of(codes: Sequence[str]) -> dict[str, int]:
    """Accounts by the codes of their people; one query."""
    found = Person.objects.filter(code__in=[code for code in codes if _is_code(code)])
    return {str(code): user for code, user in found.values_list("code", "user_id")}


def is_scenario_of(snapshot: Snapshot, slug: str) -> bool:
    """Whether the study has a scenario of that name, be it in attention checks alone."""
    study = snapshot.study
    if is_imported(study):
        return ImportedVote.objects.filter(file__study=study, item=slug).exists()
    return study.matchups.filter(scenario__slug=slug).exists() or (
        study.scenarios.filter(slug=slug).exists()
    )


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


def _marks(study: Study, filters: Filters, last: int | None) -> dict[int, LeftOut | None]:
    """Return why the current vote on each matchup does not count, None if it does."""
    rows: Any = _marked(study, filters, last)  # the mark is no field
    current = rows.exclude(mark=LeftOut.SUPERSEDED.value).values_list("matchup", "mark")
    return {row: None if mark == COUNTED else LeftOut(mark) for row, mark in current}


def _marked(study: Study, filters: Filters, last: int | None) -> QuerySet[Vote]:
    mark = Case(
        *(When(holds, then=Value(why.value)) for why, holds in _reasons(study, filters, last)),
        default=Value(COUNTED),
        output_field=CharField(),
    )
    rows = Vote.objects.filter(matchup__study=study, pk__lte=last or 0)
    return rows.order_by().annotate(mark=mark)


def _reasons(study: Study, filters: Filters, last: int | None) -> list[tuple[LeftOut, Q]]:
    """Return why votes do not count; the first one that holds is said."""
    reasons = [
        (LeftOut.SUPERSEDED, Q(superseded_by__pk__lte=last or 0)),
        (LeftOut.CHECK, Q(matchup__kind=CHECK)),
        (LeftOut.REPEAT, Q(matchup__kind=REPEAT)),
        (LeftOut.SKIP, ~Q(outcome__in=RATED)),
        (LeftOut.SIMULATED, Q(is_simulated=True)),
    ]
    if REPEAT in filters.kinds:
        del reasons[2]
    if study.allow_simulated:
        del reasons[-1]
    else:
        for pk in made_up_contestants(study).values_list("pk", flat=True):
            shown = Q(shown_left__contestant=pk) | Q(shown_right__contestant=pk)
            reasons.append((LeftOut.SIMULATED, shown))
    if filters.types:
        reasons.append((LeftOut.FILTERED, ~Q(matchup__scenario__type__in=filters.types)))
    if filters.experts:
        users = users_of(filters.experts).values()
        reasons.append((LeftOut.FILTERED, ~Q(expert__in=list(users))))
    if MAIN not in filters.kinds:
        reasons.append((LeftOut.FILTERED, Q(matchup__kind=MAIN)))
    if filters.leave_out_own and filters.authors:
        reasons.append((LeftOut.OWN, own_votes(filters)))
    return reasons


def _is_code(text: str) -> bool:
    try:
        UUID(text)
    except ValueError:
        return False
    return True
