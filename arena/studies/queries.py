"""Reads of studies: which there are, how far their experts are, who takes part, drafts."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import combinations
from statistics import median
from typing import Any
from uuid import UUID

from django.contrib.auth.models import User
from django.db.models import Count, Exists, F, Max, OuterRef, Q, QuerySet
from django.db.models.functions import Greatest, Least, Length

from arena.errors import NotYours
from arena.models import (
    Authorship,
    EnrolledVoter,
    Enrolment,
    Invitation,
    Matchup,
    Report,
    Study,
    StudyDraft,
    Vote,
)
from arena.people.queries import experts, may_be_let_in, natural_order
from arena.voting.queries.ballots import ExpertTally, tallies
from augment.errors import UnknownName
from augment.models import Contestant, GenerationJob, Scenario

LONGEST = 3
"""How many instructions: which of them takes most lines depends on words and fonts."""

_LONG = ("rules", "preregistration")
"""Columns with a line for every picture of a study, which no progress needs."""

# --- Studies -----------------------------------------------------------------------------------


def voting_study(*, expert: User, code: UUID | str) -> Study:
    """Return the study that this expert votes in, whatever its state.

    Raises:
        NotYours: There is none with that code, or the expert does not take part in it.
    """
    study = expert.studies.filter(code=code).first()
    if study is None:
        raise NotYours("You do not take part in this study.")
    return study


def longest_instructions(study: Study) -> list[str]:
    """Return the longest instructions of a study: each pair gets the room that they need."""
    by_length = study.scenarios.order_by(Length("instruction").desc(), "pk")
    return list(by_length.values_list("instruction", flat=True)[:LONGEST])


def study_named(name_or_code: str) -> Study:
    """Return a study by its name or its code.

    Raises:
        UnknownName: There is none.
    """
    wanted = Q(name=name_or_code)
    with suppress(ValueError):  # most names are not codes
        wanted |= Q(code=UUID(name_or_code))
    study = Study.objects.filter(wanted).first()
    if study is None:
        names = Study.objects.values_list("name", flat=True)
        raise UnknownName("study", name_or_code, sorted(names))
    return study


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyProgress:
    """How many matchups of a study have a vote; those to be planned later count too.

    Attributes:
        voted: Matchups with a vote; `skipped` those that were skipped instead.
    """

    study: Study
    planned: int
    voted: int
    skipped: int

    @property
    def left(self) -> int:
        """Matchups that still wait for a decision."""
        return self.planned - self.voted - self.skipped


def of_studies(studies: Sequence[Study] | None = None) -> list[StudyProgress]:
    """Every study, or those that are given, the youngest first; four queries."""
    rows = Study.objects.select_related("vote_file").defer(*_LONG)
    if studies is not None:
        rows = rows.filter(pk__in=[study.pk for study in studies])
    return of_these(list(rows))


def studies_seen_by(user: User, *, is_staff: bool) -> QuerySet[Study]:
    """Staff see every study, an expert those that they were invited to."""
    if is_staff:
        return Study.objects.all()
    return Study.objects.filter(experts=user)


def of_these(studies: Sequence[Study], *, expert: User | None = None) -> list[StudyProgress]:
    """Some studies in their order, counted over all experts or over one's own; three queries."""
    matchups = Matchup.objects.filter(study__in=[study.pk for study in studies])
    if expert is not None:
        matchups = matchups.filter(expert=expert)
    votes = Vote.objects.filter(matchup=OuterRef("pk"))
    planned = _count(matchups)
    # A matchup's first vote tells whether it has any, and stands in an index of its own.
    decided = _count(matchups.filter(Exists(votes.filter(supersedes=None))))
    skips = Vote.objects.filter(outcome=Vote.Outcome.SKIP, superseded_by=None).values("matchup")
    skipped = _count(matchups.filter(pk__in=skips))
    return [
        StudyProgress(
            study=study,
            planned=planned.get(study.pk, 0) + _planned_later(study, expert),
            voted=decided.get(study.pk, 0) - skipped.get(study.pk, 0),
            skipped=skipped.get(study.pk, 0),
        )
        for study in studies
    ]


def of_expert(expert: User) -> list[StudyProgress]:
    """The studies that an expert was invited to, counted over their own matchups."""
    seen = studies_seen_by(expert, is_staff=False).defer(*_LONG)
    return of_these(list(seen), expert=expert)


def of_study(study: Study) -> StudyProgress:
    """One study over all its experts."""
    (line,) = of_these([study])
    return line


def _count(matchups: QuerySet[Matchup]) -> dict[int, int]:
    counted = matchups.order_by().values("study").annotate(n=Count("pk"))
    return dict(counted.values_list("study", "n"))


def _planned_later(study: Study, expert: User | None) -> int:
    """Return how many showings the adaptive part still plans."""
    if expert is None:
        return sum(study.votes_to_plan.values())
    return int(study.votes_to_plan.get(expert.username, 0))


# --- Coverage, which tells nothing of who wins -------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Covered:
    """Something planned, and how much of it has a vote; a skip is none."""

    name: str
    planned: int
    decided: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Coverage:
    """How the plan of a study is spread, and how far it is judged.

    Attributes:
        contestants: In how many main matchups each one is shown.
        fewest: The pair that is judged least.
        kinds: Main matchups, hidden repeats and attention checks, named by their values.
        identical: Pairs with identical pictures, which nobody is shown.
        units: Units of the main matchups: a pair on one picture each.
        shared: Those that two experts or more are to judge.
    """

    contestants: tuple[Covered, ...]
    fewest: Covered | None
    kinds: tuple[Covered, ...]
    identical: int
    units: int
    shared: int


def coverage(study: Study) -> Coverage:
    """Count how the plan of a study is spread; three queries."""
    names = dict(study.contestants.order_by("name").values_list("pk", "name"))
    votes = Vote.objects.filter(matchup=OuterRef("pk"), superseded_by=None)
    counted = (
        study.matchups.order_by()
        .annotate(has_vote=Exists(votes.exclude(outcome=Vote.Outcome.SKIP)))
        .values("left__contestant", "right__contestant", "kind", "has_vote")
        .annotate(n=Count("pk"))
        .values_list("left__contestant", "right__contestant", "kind", "has_vote", "n")
    )
    planned: Counter[object] = Counter()
    decided: Counter[object] = Counter()
    for left, right, kind, has_vote, n in counted:
        keys: list[object] = [kind]
        if kind == Matchup.Kind.MAIN:
            keys += [left, right, frozenset((left, right))]
        for key in keys:
            planned[key] += n
            decided[key] += n * has_vote

    def covered(name: str, key: object) -> Covered:
        return Covered(name=name, planned=planned[key], decided=decided[key])

    pairs = [
        covered(f"{names[one]} / {names[other]}", frozenset((one, other)))
        for one, other in combinations(names, 2)
    ]
    units, shared = shared_units(study)
    return Coverage(
        contestants=tuple(covered(name, pk) for pk, name in names.items()),
        fewest=min(pairs, key=lambda pair: (pair.decided, pair.planned, pair.name), default=None),
        kinds=tuple(
            covered(kind.value, kind.value) for kind in Matchup.Kind if planned[kind.value]
        ),
        identical=len(study.rules.get("identical", ())),
        units=units,
        shared=shared,
    )


def shared_units(study: Study) -> tuple[int, int]:
    """Return how many units the main matchups have, and how many two experts are to judge."""
    mains = study.matchups.filter(kind=Matchup.Kind.MAIN).order_by()
    sides = (Least("left", "right"), Greatest("left", "right"))
    judged = mains.values(one=sides[0], other=sides[1]).annotate(n=Count("expert", distinct=True))
    counts = list(judged.values_list("n", flat=True))
    return len(counts), sum(number > 1 for number in counts)


def reports_of(study: Study) -> QuerySet[Report]:
    """Return what experts reported, the youngest first."""
    reports = Report.objects.filter(matchup__study=study).order_by("-at", "-pk")
    return reports.select_related("expert__person", "matchup__scenario").defer(
        "matchup__scenario__reference"
    )


def authorships_of(study: Study) -> list[Authorship]:
    """Return every mark of a study with its people and contestants, by pseudonym."""
    rows = study.authorships.select_related("expert__person", "contestant", "marked_by__person")
    return sorted(
        rows, key=lambda row: (natural_order(row.expert.person.pseudonym), row.contestant.name)
    )


def authors_of(study: Study) -> frozenset[tuple[str, str]]:
    """Return an expert's code with a contestant's slug for every mark of a study."""
    rows = study.authorships.order_by().values_list("expert__person__code", "contestant__slug")
    return frozenset((str(code), slug) for code, slug in rows)


# --- Drafts ------------------------------------------------------------------------------------


def find_drafts(search: str = "") -> QuerySet[StudyDraft]:
    """Return drafts, those that were changed last first."""
    drafts = StudyDraft.objects.select_related("changed_by__person")
    return drafts.filter(entered__name__icontains=search) if search else drafts


def missing_of(draft: StudyDraft) -> list[dict[str, str]]:
    """Return what the draft chooses and nobody could choose now: field, name and why."""
    offered = Contestant.objects.exclude(kind=Contestant.Kind.CHECK)
    known = set(offered.values_list("slug", flat=True))
    choices = {
        "contestants": set(offered.filter(retired_at=None).values_list("slug", flat=True)),
        "experts": {user.username for user in experts()},
        "scenarios": set(Scenario.objects.values_list("slug", flat=True)),
        "jobs": {str(code) for code in GenerationJob.objects.values_list("code", flat=True)},
    }
    reasons = {
        "contestants": "there is no such contestant any more",
        "experts": "no active expert has this name any more",
        "scenarios": "there is no such scenario any more",
        "jobs": "there is no such job any more",
    }
    retired = "the contestant was retired"
    return [
        {
            "field": field,
            "name": name,
            "why": retired if field == "contestants" and name in known else reasons[field],
        }
        for field, allowed in choices.items()
        for name in draft.names_in(field)
        if name not in allowed
    ]


# --- Experts -----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ExpertLine:
    """One expert of a study, for the people who run it.

    Attributes:
        seconds_per_vote: Median time that a pair was on screen, None before it was measured.
        last_seen: The last vote in this study or the last sign-in, whichever is later.
        invitation: The newest link, None if there never was one.
        link: Its state, None without one.
        may_be_invited: Whether a link may be made for this account.
    """

    tally: ExpertTally
    seconds_per_vote: float | None
    last_seen: datetime | None
    invitation: Invitation | None
    link: Invitation.State | None
    may_be_invited: bool

    @property
    def has_live_link(self) -> bool:
        """Whether somebody can come in by the newest link."""
        return self.link in Invitation.ALIVE

    @property
    def left(self) -> int:
        """Planned matchups without a vote."""
        return self.tally.left


def expert_lines(study: Study, now: datetime) -> list[ExpertLine]:
    """Return one line per expert of the study, by pseudonym; a fixed number of queries.

    Args:
        study: Any, also a closed one.
        now: For the states of the links.
    """
    shown: dict[int, list[int]] = defaultdict(list)
    last_vote: dict[int, datetime] = {}
    votes = Vote.objects.filter(matchup__study=study).order_by("at")
    for expert, outcome, ms_visible, at in votes.values_list(
        "expert", "outcome", "ms_visible", "at"
    ).iterator(chunk_size=5000):
        last_vote[expert] = at
        if ms_visible is not None and outcome != Vote.Outcome.SKIP:
            shown[expert].append(ms_visible)
    invitations = study.invitations.select_related("invited_by").order_by("made_at", "pk")
    newest = {row.expert_id: row for row in invitations}
    lines = []
    for tally in tallies(study):
        user = tally.expert
        seen = [at for at in (last_vote.get(user.pk), user.last_login) if at is not None]
        times, invitation = shown.get(user.pk), newest.get(user.pk)
        lines.append(
            ExpertLine(
                tally=tally,
                seconds_per_vote=median(times) / 1000 if times else None,
                last_seen=max(seen, default=None),
                invitation=invitation,
                link=invitation.state(now) if invitation else None,
                may_be_invited=study.state != Study.State.CANCELLED and may_be_let_in(user),
            )
        )
    return lines


# --- Enrolments --------------------------------------------------------------------------------

Voters = QuerySet[Any]
"""Of EnrolledVoter, with what is counted about each."""


def enrolment_by_token(token: str) -> Enrolment:
    """Return the enrolment of a link.

    Raises:
        NotYours: No link has this token.
    """
    found = Enrolment.objects.select_related("study").filter(token=token).first()
    if found is None:
        raise NotYours("No study enrols by this link.")
    return found


def enrolled_voters(enrolment: Enrolment) -> Voters:
    """Return everybody who ever took a place; one query.

    Each has `planned`, `answered` and `skipped` (pairs; a skip is an answer as well) and
    `last_vote_at`.
    """
    mine = Q(expert__matchups__study=enrolment.study_id)
    answered = mine & Q(expert__matchups__votes__isnull=False)
    skipped = mine & Q(
        expert__matchups__votes__outcome="skip", expert__matchups__votes__superseded_by=None
    )
    return (
        EnrolledVoter.objects.filter(enrolment=enrolment)
        .select_related("expert__person")
        .annotate(
            planned=Count("expert__matchups", filter=mine, distinct=True),
            answered=Count("expert__matchups", filter=answered, distinct=True),
            skipped=Count("expert__matchups", filter=skipped, distinct=True),
            last_vote_at=Max("expert__matchups__votes__at", filter=mine),
        )
        .order_by("enrolled_at", "pk")
    )


def find_unfinished(enrolment: Enrolment) -> Voters:
    """Return who has a place and pairs without an answer."""
    return enrolled_voters(enrolment).filter(dropped_at=None, answered__lt=F("planned"))


def find_silent(enrolment: Enrolment, *, now: datetime) -> Voters:
    """Return who is not done and was not heard for as long as the enrolment allows."""
    unfinished = find_unfinished(enrolment)
    if enrolment.drop_out_after_h is None:
        return unfinished.none()
    since = now - timedelta(hours=enrolment.drop_out_after_h)
    is_quiet = Q(last_vote_at=None) | Q(last_vote_at__lte=since)
    return unfinished.filter(is_quiet, enrolled_at__lte=since)


def has_free_place(enrolment: Enrolment) -> bool:
    """Return whether somebody may still take a place."""
    return enrolment.voters.filter(dropped_at=None).count() < enrolment.places


def state_of(enrolment: Enrolment) -> dict[str, int]:
    """Count places, and what became of them."""
    kept = enrolled_voters(enrolment).filter(dropped_at=None)
    taken = kept.count()
    return {
        "places": enrolment.places,
        "taken": taken,
        "free": max(enrolment.places - taken, 0),
        "done": kept.filter(planned__gt=0, answered__gte=F("planned")).count(),
        "dropped": enrolment.voters.exclude(dropped_at=None).count(),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class OwnEnrolment:
    """What somebody who enrolled is told at the end.

    Attributes:
        completion_code: Empty unless every pair has an answer.
        was_given_on: Whether the place went to somebody else after a long silence.
    """

    completion_code: str
    was_given_on: bool


def code_told(voter: Any) -> str:
    """Return the completion code of one of `enrolled_voters`, empty before the last answer."""
    is_done = voter.dropped_at is None and 0 < voter.planned <= voter.answered
    return voter.completion_code if is_done else ""


def own_enrolment(study: Study, expert: User) -> OwnEnrolment | None:
    """Return what an enrolled expert is told; None for who did not come by an enrolment link."""
    enrolment = Enrolment.objects.filter(study=study).first()
    voter = enrolment and enrolled_voters(enrolment).filter(expert=expert).first()
    if not voter:
        return None
    return OwnEnrolment(
        completion_code=code_told(voter), was_given_on=voter.dropped_at is not None
    )
