"""The votes of a study as a rating reads them: which count, which do not and why, who competes.

Votes of a study and votes of a file look alike from here on.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from enum import StrEnum
from typing import Any, NamedTuple, TypeVar, cast

from django.db.models import Case, Exists, F, Max, Model, OuterRef, Q, QuerySet, Value, When
from django.db.models.fields import CharField
from pydantic import TypeAdapter

from arena.models import ImportedVote, Person, Question, Snapshot, Study, Vote
from arena.pairing.order import CHECK, MAIN, REPEAT
from arena.pairing.rules import Entry, draw_ties, make_grid, sample_at, scenario_at
from arena.voting.queries.blinding import is_imported
from augment.errors import check_names
from augment.models import Contestant
from augment.services.scenarios import ScenarioType

Row = TypeVar("Row", bound=Model)

AUTOMATIC = "automatic"
"""A kind beside those of matchups: a tie on a pair that nobody can tell apart nor was shown."""

IMPORTED = "imported"
"""The kind of a contestant that is known by its name alone."""

RATED = (Vote.Outcome.LEFT.value, Vote.Outcome.EQUAL.value, Vote.Outcome.RIGHT.value)
"""Outcomes that say something; a skip does not."""

IMPORTED_OUTCOMES: dict[str, str] = {
    ImportedVote.Outcome.FIRST: Vote.Outcome.LEFT,
    ImportedVote.Outcome.TIE: Vote.Outcome.EQUAL,
    ImportedVote.Outcome.SECOND: Vote.Outcome.RIGHT,
    ImportedVote.Outcome.BOTH_BAD: Vote.Outcome.EQUAL,
}

KINDS = (MAIN, REPEAT)
"""What may be rated: planned showings, and on demand the hidden repeats of them."""

COUNTED, AUTOMATIC_TIE = "counted", "automatic"
"""Marks beside the reasons of `LeftOut`: what counts, and pairs that nobody can tell apart where
the rating does not count them."""


class LeftOut(StrEnum):
    """Why a vote is no part of a rating. The first reason that fits is the one that is said."""

    SUPERSEDED = "superseded"
    CHECK = "check"
    REPEAT = "repeat"
    SKIP = "skip"
    SIMULATED = "simulated"
    FILTERED = "filtered"
    OWN = "own"


REASONS: dict[str, str] = {
    LeftOut.SUPERSEDED: "changed later",
    LeftOut.CHECK: "attention checks",
    LeftOut.REPEAT: "hidden repeats",
    LeftOut.SKIP: "skipped",
    LeftOut.SIMULATED: "simulated",
    LeftOut.FILTERED: "not asked for",
    LeftOut.OWN: "by authors on their own contestants",
}
"""The same in words."""


class RatedVote(NamedTuple):
    """One current vote.

    Attributes:
        judge: A lasting code, and `judge_name` the pseudonym.
        item: The scenario's slug, and `type` its type.
        left, right: Slugs of contestants.
        outcome: left, equal, right or skip.
        mark: Why it does not count, or COUNTED.
        matchup: Its row, and `repeat_of` the row of the matchup that it shows again.
        at: When it was given, in UTC as ISO 8601; empty where nobody knows, as in all below.
        position: Of the matchup in the expert's own order, from 1.
        aids: What the expert looked with, joined by blanks.
        left_code, right_code: The augmentations that were shown.
        strength: slightly or clearly better.
        question: What was asked.
        faults: What was marked as wrong, as a Vote keeps it.
        sample: Of the item, where each one is judged on its own, else 0.
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
    mark: str = COUNTED
    ms_visible: int | None = None
    matchup: int | None = None
    repeat_of: int | None = None
    at: str = ""
    position: int | None = None
    aids: str = ""
    comment: str = ""
    left_code: str = ""
    right_code: str = ""
    strength: str = ""
    question: str = Question.INSTRUCTION.value
    faults: Sequence[Sequence[str]] = ()
    sample: int = 0

    @property
    def winner(self) -> str | None:
        """The slug of who won, None without a winner."""
        sides = {Vote.Outcome.LEFT.value: self.left, Vote.Outcome.RIGHT.value: self.right}
        return sides.get(self.outcome)


@dataclass(frozen=True, slots=True, kw_only=True)
class Filters:
    """Filters of votes.

    Attributes:
        types: Of scenarios; empty is all.
        experts: Codes of judges; empty is all.
        kinds: Of matchups.
        leave_out_settled: Whether pairs that nobody was shown, because nobody can tell them
            apart, do not count as ties.
        leave_out_own: Whether votes of authors on their own contestants do not count.
        authors: Who was marked author of what when the votes were frozen, codes of judges with
            slugs of contestants. They are known also where their votes count.
        question: What was asked; empty is the study's primary question.
    """

    types: tuple[str, ...] = ()
    experts: tuple[str, ...] = ()
    kinds: tuple[str, ...] = (MAIN,)
    leave_out_settled: bool = False
    leave_out_own: bool = False
    authors: frozenset[tuple[str, str]] = frozenset()
    question: str = ""

    def is_own(self, judge: str, left: str, right: str) -> bool:
        """Return whether a judge is marked author of one of the two."""
        return (judge, left) in self.authors or (judge, right) in self.authors

    def as_document(self) -> dict[str, Any]:
        """As a snapshot keeps it."""
        document: dict[str, Any] = _FILTERS.dump_python(self, mode="json")
        return document | {"authors": [list(pair) for pair in sorted(self.authors)]}

    @staticmethod
    def of_document(document: dict[str, Any]) -> "Filters":
        """Return the filters from `as_document`.

        Older snapshots left settled pairs out, and were made when studies asked one question.
        """
        older = {"leave_out_settled": True, "question": Question.INSTRUCTION.value}
        return _FILTERS.validate_python(older | document)


_FILTERS = TypeAdapter(Filters)


@dataclass(frozen=True, slots=True, kw_only=True)
class VoteSet:
    """Votes of a rating, in the order of their decisions.

    Attributes:
        competitors: By slug; those of a file are rows that are not stored, without a primary key.
        counted: The votes that count.
        repeats: Decided hidden repeats, whether they count or not.
        checks: Votes on attention checks by the primary question, and `references` who should win
            them.
        left_out: How many votes do not count, by reason.
    """

    competitors: tuple[Contestant, ...]
    counted: tuple[RatedVote, ...]
    repeats: tuple[RatedVote, ...]
    checks: tuple[RatedVote, ...]
    references: frozenset[str]
    left_out: dict[str, int]


def last_vote_id(study: Study) -> int | None:
    """The row of the newest vote, so that later ones can be told apart."""
    votes: QuerySet[Any] = (
        ImportedVote.objects.filter(file__study=study)
        if is_imported(study)
        else Vote.objects.filter(matchup__study=study)
    )
    return cast("int | None", votes.aggregate(last=Max("pk"))["last"])


def vote_set(study: Study, *, filters: Filters, last: int | None) -> VoteSet:
    """The votes of a study up to a row, see `last_vote_id`; None for none at all.

    Raises:
        UnknownName: A filter names a type, a judge, a kind or a question that does not occur.
    """
    votes = current_votes(study, filters, last)
    counted = len(votes)
    if not filters.leave_out_settled:
        votes += list_ties_unshown(study, votes, filters)
    _check_names(study, filters, votes)
    left_out = Counter(vote.mark for vote in votes if vote.mark != COUNTED)
    if not is_imported(study):
        left_out[LeftOut.SUPERSEDED.value] = _votes_asked(study, filters, last).count() - counted
    primary = votes
    if find_question(study, filters) != study.questions[0]:
        primary = current_votes(study, replace(filters, question=""), last)
    checks = tuple(vote for vote in primary if vote.mark == LeftOut.CHECK)
    references = Contestant.objects.filter(kind=Contestant.Kind.REFERENCE)
    return VoteSet(
        competitors=_competitors(study, votes),
        counted=tuple(vote for vote in votes if vote.mark == COUNTED),
        repeats=tuple(vote for vote in votes if vote.kind == REPEAT and vote.outcome in RATED),
        checks=checks,
        references=frozenset(references.values_list("slug", flat=True) if checks else ()),
        left_out={reason: number for reason, number in sorted(left_out.items()) if number},
    )


def find_question(study: Study, filters: Filters) -> str:
    """The question whose votes are asked for."""
    return filters.question or str(study.questions[0])


def current_votes(study: Study, filters: Filters, last: int | None) -> list[RatedVote]:
    """The votes that were current at a row, oldest first, with their marks."""
    if is_imported(study):
        lines = mark_imported_votes(study, filters, last).order_by("line")
        names = ("first", "second", "outcome", "judge", "item", F("mark"))
        return [
            RatedVote(
                judge=judge,
                judge_name=judge,
                item=item,
                type="",
                kind=MAIN,
                left=first,
                right=second,
                outcome=IMPORTED_OUTCOMES[outcome],
                both_miss=outcome == ImportedVote.Outcome.BOTH_BAD,
                is_simulated=study.allow_simulated,
                mark=mark,
            )
            for first, second, outcome, judge, item, mark in lines.values_list(*names)
        ]
    rows: QuerySet[Any] = _mark_votes(study, filters, last)
    columns = (
        *("expert__person__code", "expert__person__pseudonym"),
        *("matchup__scenario__slug", "matchup__scenario__type", "matchup__kind"),
        *("shown_left__contestant__slug", "shown_right__contestant__slug"),
        *("outcome", "both_miss", "is_simulated", F("mark"), "ms_visible"),
        *("matchup", "matchup__repeat_of", "at", "matchup__position", "aids", "comment"),
        *("shown_left__code", "shown_right__code", "strength", "question", "faults"),
        F("shown_right__sample") if study.shows_all_samples else Value(0),
    )
    current = rows.exclude(Q(mark=LeftOut.SUPERSEDED.value)).order_by("pk")
    return [
        vote._replace(
            judge=str(vote.judge),
            at=cast("datetime", vote.at).astimezone(UTC).isoformat(timespec="milliseconds"),
            left_code=str(vote.left_code),
            right_code=str(vote.right_code),
        )
        for vote in map(RatedVote._make, current.values_list(*columns))
    ]


def list_ties_unshown(
    study: Study, votes: Iterable[RatedVote], filters: Filters
) -> list[RatedVote]:
    """Ties on the pairs that the study settled without showing; see arena.pairing.rules.

    Args:
        study: A study; one of votes from elsewhere has no such pairs.
        votes: Its current votes, which say how often a pair is judged, and by whom.
        filters: Which of the ties count.
    """
    settled = [(place, first, other) for place, first, other in study.rules.get("identical", ())]
    if not settled:
        return []
    by_judge: dict[str, list[RatedVote]] = {}
    for vote in votes:
        if vote.kind == MAIN and vote.outcome in RATED:
            by_judge.setdefault(vote.judge, []).append(vote)
    types = dict(study.scenarios.values_list("slug", "type"))
    entries = tuple(Entry(**entry) for entry in study.rules["entries"])
    alike = tuple((place, first, other) for place, first, other in study.rules.get("alike", ()))
    challengers = study.rules.get("challengers", ())
    drawn = draw_ties(
        settled,
        {judge: len(own) for judge, own in by_judge.items()},
        showable=int(make_grid(entries, alike, challengers).showable.sum()),
        seed=study.seed,
    )
    simulated = {row.slug for row in study.contestants.all() if row.is_simulated}
    ties = []
    for (place, left, right), judge in drawn:
        item, first = scenario_at(place), by_judge[judge][0]
        tie = RatedVote(
            judge=judge,
            judge_name=first.judge_name,
            item=item,
            type=types[item],
            kind=AUTOMATIC,
            left=left,
            right=right,
            outcome=Vote.Outcome.EQUAL.value,
            both_miss=False,
            is_simulated=first.is_simulated,
            question=find_question(study, filters),
            sample=sample_at(place),
        )
        is_asked_for = (
            MAIN in filters.kinds
            and tie.type in (filters.types or (tie.type,))
            and judge in (filters.experts or (judge,))
        )
        is_made_up = tie.is_simulated or not simulated.isdisjoint((left, right))
        if is_made_up and not study.allow_simulated:
            tie = tie._replace(mark=LeftOut.SIMULATED.value)
        elif not is_asked_for:
            tie = tie._replace(mark=LeftOut.FILTERED.value)
        ties.append(tie._replace(mark=AUTOMATIC_TIE) if filters.leave_out_settled else tie)
    return ties


def mark_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """All votes up to a rating with their `mark`: the first reason that fits, or COUNTED.

    At most three queries beside its own: who is simulated, who was asked for, who is author.
    """
    filters = Filters.of_document(snapshot.filters)
    return _mark_votes(snapshot.study, filters, snapshot.last_vote)


def select_counted_votes(snapshot: Snapshot) -> QuerySet[Vote]:
    """The rows that the rating is made of, without those of pairs that nobody was shown."""
    return mark_votes(snapshot).filter(Q(mark=COUNTED))


def mark_imported_votes(
    study: Study, filters: Filters, last: int | None
) -> QuerySet[ImportedVote]:
    """The votes of a study's file up to a row, each with its `mark`."""
    no_other = Q(judge__in=filters.experts) if filters.experts else Q(pk__isnull=False)
    if filters.types or MAIN not in filters.kinds:
        no_other = Q(pk__isnull=True)
    reasons = [(LeftOut.FILTERED, ~no_other)]
    return _with_mark(ImportedVote.objects.filter(file__study=study, pk__lte=last or 0), reasons)


def own_votes(filters: Filters) -> Q:
    """Votes of authors on their own contestants; one query."""
    users = find_users({judge for judge, _ in filters.authors})
    own = Q(pk=None)
    for judge, slug in sorted(filters.authors):
        shown = Q(shown_left__contestant__slug=slug) | Q(shown_right__contestant__slug=slug)
        own |= Q(expert=users.get(judge)) & shown
    return own


def find_users(codes: Collection[str]) -> dict[str, int]:
    """Accounts by the codes of their people, whatever else is among the codes; one query."""
    people = Person.objects.values_list("code", "user_id")
    return {str(code): user for code, user in people if str(code) in codes}


# --- Private -----------------------------------------------------------------------------------


def _competitors(study: Study, votes: Iterable[RatedVote]) -> tuple[Contestant, ...]:
    """Return competitors by slug: a study's contestants, or the names in a file's votes."""
    if is_imported(study):
        names = {name for vote in votes for name in (vote.left, vote.right)}
        return tuple(Contestant(slug=name, name=name, kind=IMPORTED) for name in sorted(names))
    return tuple(study.contestants.order_by("slug"))


def _check_names(study: Study, filters: Filters, votes: Sequence[RatedVote]) -> None:
    judges = {vote.judge for vote in votes}
    types = {*(entry.value for entry in ScenarioType), *(vote.type for vote in votes)}
    for what, names, allowed in (
        ("kind of vote", filters.kinds, list(KINDS)),
        ("question of this study", (find_question(study, filters),), study.questions),
        ("scenario type", filters.types, sorted(types)),
        ("expert", filters.experts, sorted(judges)),
    ):
        check_names(what, names, allowed)


def _mark_votes(study: Study, filters: Filters, last: int | None) -> QuerySet[Vote]:
    reasons = [
        (LeftOut.SUPERSEDED, Q(superseded_by__pk__lte=last or 0)),
        (LeftOut.CHECK, Q(matchup__kind=CHECK)),
    ]
    if REPEAT not in filters.kinds:
        reasons.append((LeftOut.REPEAT, Q(matchup__kind=REPEAT)))
    reasons.append((LeftOut.SKIP, ~Q(outcome__in=RATED)))
    if find_question(study, filters) != study.questions[0]:
        reasons.append((LeftOut.SKIP, Q(_skip_of_pair(last))))
    if not study.allow_simulated:
        reasons.append((LeftOut.SIMULATED, Q(is_simulated=True)))
        simulated = study.contestants.filter(kind=Contestant.Kind.SIMULATED)
        for pk in simulated.values_list("pk", flat=True):
            shown = Q(shown_left__contestant=pk) | Q(shown_right__contestant=pk)
            reasons.append((LeftOut.SIMULATED, shown))
    if filters.types:
        reasons.append((LeftOut.FILTERED, ~Q(matchup__scenario__type__in=filters.types)))
    if filters.experts:
        users = list(find_users(filters.experts).values())
        reasons.append((LeftOut.FILTERED, ~Q(expert__in=users)))
    if MAIN not in filters.kinds:
        reasons.append((LeftOut.FILTERED, Q(matchup__kind=MAIN)))
    if filters.leave_out_own and filters.authors:
        reasons.append((LeftOut.OWN, own_votes(filters)))
    return _with_mark(_votes_asked(study, filters, last), reasons)


def _votes_asked(study: Study, filters: Filters, last: int | None) -> QuerySet[Vote]:
    rows = Vote.objects.filter(matchup__study=study, pk__lte=last or 0)
    return rows.filter(question=find_question(study, filters))


def _skip_of_pair(last: int | None) -> Exists:
    """Return the condition that the pair was skipped whole after an answer to another question."""
    skips = Vote.objects.filter(
        matchup=OuterRef("matchup"), outcome=Vote.Outcome.SKIP, pk__lte=last or 0
    )
    return Exists(skips.exclude(superseded_by__pk__lte=last or 0))


def _with_mark(rows: QuerySet[Row], reasons: Sequence[tuple[LeftOut, Q]]) -> QuerySet[Row]:
    """Annotate why rows do not count; the first reason that holds is said."""
    mark = Case(
        *(When(holds, then=Value(reason.value)) for reason, holds in reasons),
        default=Value(COUNTED),
        output_field=CharField(),
    )
    return cast("QuerySet[Row]", rows.order_by().annotate(mark=mark))
