"""Votes as a rating reads them, and who competes.

Votes of a study and votes of a file look alike from here on.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import UTC
from enum import StrEnum
from typing import Any, NamedTuple
from uuid import UUID

from django.db.models import Case, Max, Q, QuerySet, Value, When
from django.db.models.fields import CharField

from arena.models import ImportedVote, Person, Snapshot, Study, Vote
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.rules import Entry, grid_of, scenario_of
from arena.pairing.settled import draw_ties
from arena.results.queries.search import COUNTED
from augment.errors import UnknownName
from augment.models import Contestant
from augment.services.scenarios.types import ScenarioType

AUTOMATIC = "automatic"
"""A kind beside those of matchups: a tie on a pair that nobody can tell apart nor was shown."""

RATED = (Vote.Outcome.LEFT.value, Vote.Outcome.EQUAL.value, Vote.Outcome.RIGHT.value)
"""Outcomes that say something; a skip does not."""

IMPORTED = "imported"
"""The kind of a contestant that is known by its name alone."""


class Judged(NamedTuple):
    """One current vote.

    Attributes:
        judge: A lasting code, and `judge_name` the pseudonym.
        item: The scenario's slug, and `type` its type.
        left, right: Slugs of contestants.
        outcome: left, equal or right.
        matchup: Its row, and `repeat_of` the row of the matchup that it shows again.
        at: When it was given, in UTC as ISO 8601; empty where nobody knows, as in all below.
        position: Of the matchup in the expert's own order, from 1.
        aids: What the expert looked with, joined by blanks.
        left_code, right_code: The augmentations that were shown.
    """

    judge: str
    judge_name: str
    item: str
    type: str
    kind: str
    left: str
    right: str
    outcome: str
    both_miss: bool
    is_simulated: bool
    ms_visible: int | None
    matchup: int | None
    repeat_of: int | None
    at: str = ""
    position: int | None = None
    aids: str = ""
    comment: str = ""
    left_code: str = ""
    right_code: str = ""

    @property
    def winner(self) -> str | None:
        """The slug of who won, None without a winner."""
        sides = {Vote.Outcome.LEFT.value: self.left, Vote.Outcome.RIGHT.value: self.right}
        return sides.get(self.outcome)


@dataclass(frozen=True, slots=True, kw_only=True)
class Entrant:
    """Who competes; `contestant` is None for names from a file."""

    slug: str
    name: str
    variant: str
    kind: str
    is_simulated: bool
    contestant: Contestant | None


def is_imported(study: Study) -> bool:
    """Whether the votes came from a file."""
    return hasattr(study, "vote_file")


def last_vote_of(study: Study) -> int | None:
    """The row of the newest vote, so that later ones can be told apart."""
    votes = (
        ImportedVote.objects.filter(file__study=study)
        if is_imported(study)
        else Vote.objects.filter(matchup__study=study)
    )
    found: int | None = votes.aggregate(last=Max("pk"))["last"]
    return found


def votes_up_to(study: Study, last: int | None) -> tuple[list[Judged], int]:
    """The votes that were current at a row, oldest first, and how many were superseded by then.

    Args:
        study: A study of matchups, or one of votes from elsewhere.
        last: See `last_vote_of`; None for none at all.
    """
    if is_imported(study):
        return _imported(study, last), 0
    current = _voted(study, last)
    everything = Vote.objects.filter(matchup__study=study, pk__lte=last or 0).count()
    return current, everything - len(current)


def entrants_of(study: Study, votes: Iterable[Judged]) -> tuple[Entrant, ...]:
    """Who competes, by slug: a study's contestants, or who occurs in the votes of a file."""
    return _names(votes) if is_imported(study) else _contestants(study)


def settled_ties(study: Study, lines: Iterable[Judged]) -> list[Judged]:
    """Ties on the pairs that the study settled without showing; see arena.pairing.settled.

    Args:
        study: A study; one of votes from elsewhere has no such pairs.
        lines: Its votes, which say how often a pair is judged, and by whom.
    """
    settled = [(place, one, other) for place, one, other in study.rules.get("identical", ())]
    if not settled:
        return []
    by_judge: dict[str, list[Judged]] = {}
    for line in lines:
        if line.kind == MAIN and line.outcome in RATED:
            by_judge.setdefault(line.judge, []).append(line)
    types = dict(study.scenarios.values_list("slug", "type"))
    drawn = draw_ties(
        settled,
        {judge: len(own) for judge, own in by_judge.items()},
        showable=_count_showable(study),
        seed=study.seed,
    )
    return [
        Judged(
            judge=judge, judge_name=by_judge[judge][0].judge_name, item=scenario_of(place),
            type=types[scenario_of(place)], kind=AUTOMATIC, left=left, right=right,
            outcome=Vote.Outcome.EQUAL.value, both_miss=False,
            is_simulated=by_judge[judge][0].is_simulated, ms_visible=None, matchup=None,
            repeat_of=None,
        )
        for (place, left, right), judge in drawn
    ]  # fmt: skip


def _count_showable(study: Study) -> int:
    """How many pairs of pictures the planner may show."""
    entries = tuple(Entry(**entry) for entry in study.rules["entries"])
    alike = tuple((place, one, other) for place, one, other in study.rules.get("alike", ()))
    return int(grid_of(entries, alike).showable.sum())


def references() -> frozenset[str]:
    """The slugs of the references, which win attention checks."""
    rows = Contestant.objects.filter(kind=Contestant.Kind.REFERENCE)
    return frozenset(rows.values_list("slug", flat=True))


# --- Votes of a study --------------------------------------------------------------------------


def _contestants(study: Study) -> tuple[Entrant, ...]:
    return tuple(
        Entrant(
            slug=row.slug,
            name=row.name,
            variant=row.variant,
            kind=row.kind,
            is_simulated=row.is_simulated,
            contestant=row,
        )
        for row in study.contestants.order_by("slug")
    )


def _voted(study: Study, last: int | None) -> list[Judged]:
    """Four queries, whatever the number of votes."""
    slugs = dict(Contestant.objects.values_list("pk", "slug"))
    places = {
        pk: (slug, kind) for pk, slug, kind in study.scenarios.values_list("pk", "slug", "type")
    }
    people = {
        user: (str(code), name)
        for user, code, name in Person.objects.values_list("user", "code", "pseudonym")
    }
    current = Q(superseded_by=None) | Q(superseded_by__pk__gt=last or 0)
    rows = (
        Vote.objects.filter(current, matchup__study=study, pk__lte=last or 0)
        .order_by("pk")
        .values_list(
            "expert", "matchup__scenario", "matchup__kind", "shown_left__contestant",
            "shown_right__contestant", "outcome", "both_miss", "is_simulated", "ms_visible",
            "matchup", "matchup__repeat_of", "at", "matchup__position", "aids", "comment",
            "shown_left__code", "shown_right__code",
        )
    )  # fmt: skip
    return [
        Judged(
            *people[expert], *places[place], kind, slugs[left], slugs[right],
            outcome, both_miss, simulated, ms, matchup, repeat_of,
            at.astimezone(UTC).isoformat(timespec="milliseconds"), position, aids, comment,
            str(left_code), str(right_code),
        )
        for (
            expert, place, kind, left, right, outcome, both_miss, simulated, ms, matchup,
            repeat_of, at, position, aids, comment, left_code, right_code
        ) in rows.iterator(chunk_size=5000)
    ]  # fmt: skip


# --- Votes of a file ---------------------------------------------------------------------------

_OUTCOMES = {
    ImportedVote.Outcome.FIRST.value: Vote.Outcome.LEFT.value,
    ImportedVote.Outcome.SECOND.value: Vote.Outcome.RIGHT.value,
    ImportedVote.Outcome.TIE.value: Vote.Outcome.EQUAL.value,
    ImportedVote.Outcome.BOTH_BAD.value: Vote.Outcome.EQUAL.value,
}


def _imported(study: Study, last: int | None) -> list[Judged]:
    rows = (
        ImportedVote.objects.filter(file__study=study, pk__lte=last or 0)
        .order_by("line")
        .values_list("first", "second", "outcome", "judge", "item")
    )
    return [
        Judged(
            judge=judge, judge_name=judge, item=item, type="", kind=MAIN, left=first, right=second,
            outcome=_OUTCOMES[outcome], both_miss=outcome == ImportedVote.Outcome.BOTH_BAD.value,
            is_simulated=study.allow_simulated, ms_visible=None, matchup=None, repeat_of=None,
        )
        for first, second, outcome, judge, item in rows.iterator(chunk_size=5000)
    ]  # fmt: skip


def _names(lines: Iterable[Judged]) -> tuple[Entrant, ...]:
    found = sorted({name for line in lines for name in (line.left, line.right)})
    return tuple(
        Entrant(
            slug=name, name=name, variant="", kind=IMPORTED, is_simulated=False, contestant=None
        )
        for name in found
    )


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
