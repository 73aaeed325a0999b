"""What came out of a job: how many rows are in each state, and a line per contestant."""

from __future__ import annotations

import hashlib
import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any, cast

from django.db.models import Count, F, Max, Min, Q, QuerySet
from django.db.models.functions import Substr

from augment.errors import UnknownName
from augment.models import Attempt, Augmentation, GenerationJob, ModelCall, TranscriptNote
from augment.services.clock import database_now
from augment.variants.respondents import NoteKind

State = Augmentation.State


@dataclass(frozen=True, slots=True, kw_only=True)
class ContestantLine:
    """How the rows of one contestant ended."""

    slug: str
    name: str
    total: int
    done: int
    unreadable: int
    refused: int
    failed: int
    cancelled: int


@dataclass(frozen=True, slots=True, kw_only=True)
class JobCounts:
    """A job and how many of its augmentations are in each state."""

    job: GenerationJob
    by_state: dict[State, int]

    @property
    def total(self) -> int:
        """Contestants x scenarios."""
        return sum(self.by_state.values())

    @property
    def under_way(self) -> int:
        """What still waits or runs."""
        return sum(self.by_state[state] for state in (State.QUEUED, State.RUNNING))

    @property
    def is_moving(self) -> bool:
        """Whether anything will change by itself: not where all that is left is held."""
        if self.is_held:
            return self.running > 0
        return self.under_way > 0

    @property
    def is_held(self) -> bool:
        """Whether nothing is started until somebody resumes the job."""
        return self.job.state in GenerationJob.HELD

    @property
    def settled(self) -> int:
        """What has its outcome, whichever it is."""
        return self.total - self.under_way

    @property
    def queued(self) -> int:
        """What nobody has taken yet."""
        return self.by_state[State.QUEUED]

    @property
    def running(self) -> int:
        """What a worker has taken."""
        return self.by_state[State.RUNNING]

    @property
    def done(self) -> int:
        """What has a modification."""
        return self.by_state[State.DONE]

    @property
    def failed(self) -> int:
        """What broke and may be tried again."""
        return self.by_state[State.FAILED]


def count_each(jobs: Sequence[GenerationJob]) -> list[JobCounts]:
    """Several jobs; one query."""
    counts: defaultdict[int, Counter[str]] = defaultdict(Counter)
    rows = Augmentation.objects.filter(job__in=jobs).order_by().values_list("job_id", "state")
    for job_id, state, number in rows.annotate(number=Count("pk")):
        counts[job_id][state] = number
    return [_counts(job, counts[job.pk]) for job in jobs]


def count_rows(job: GenerationJob) -> JobCounts:
    """One job; one query."""
    rows = job.augmentations.order_by().values_list("state").annotate(number=Count("pk"))
    return _counts(job, Counter(dict(rows)))


def contestant_lines(job: GenerationJob) -> list[ContestantLine]:
    """One line a contestant, by slug."""
    outcomes = [state for state in State if state not in Augmentation.UNDER_WAY]
    counts = {state.value: Count("pk", filter=Q(state=state)) for state in outcomes}
    groups = (
        job.augmentations.order_by("contestant__slug")
        .values(slug=F("contestant__slug"), name=F("contestant__name"))
        .annotate(total=Count("pk"), **counts)
    )
    return [ContestantLine(**group) for group in cast("list[dict[str, Any]]", list(groups))]


def cells_of(job: GenerationJob) -> QuerySet[Augmentation]:
    """The augmentations of a job with their scenarios and contestants, without documents."""
    documents = ("modification", "scenario__reference")
    return job.augmentations.select_related("scenario", "contestant").defer(*documents)


def _counts(job: GenerationJob, found: Counter[str]) -> JobCounts:
    return JobCounts(job=job, by_state={state: found[state.value] for state in State})


WINDOW = timedelta(minutes=5)
"""What ended within it tells the rate."""

_OUTCOMES = [state.value for state in Augmentation.State if state not in Augmentation.UNDER_WAY]


@dataclass(frozen=True, slots=True, kw_only=True)
class Pace:
    """The rate of a job that moves.

    Attributes:
        rows_per_minute: Augmentations that ended; None where none has for a while.
        calls_per_minute: Calls to language models that ended.
        left_s: Until all is settled at that rate; None where nothing new is started.
    """

    rows_per_minute: float | None
    calls_per_minute: float
    left_s: float | None


def pace_of(counts: JobCounts, *, now: datetime | None = None) -> Pace:
    """By two queries, from what ended within the last minutes.

    Args:
        counts: The job.
        now: The database's time, looked up where it is not given.
    """
    now = now or database_now()
    since = now - WINDOW
    ended = Attempt.objects.filter(
        augmentation__job=counts.job, finished_at__gt=since, outcome__in=_OUTCOMES
    ).aggregate(number=Count("pk"), first=Min("started_at"))
    calls = ModelCall.objects.filter(
        attempt__augmentation__job=counts.job, settled_at__gt=since, sent_at__isnull=False
    ).aggregate(number=Count("pk"), first=Min("sent_at"))
    rows_per_minute = _per_minute(ended["number"], ended["first"], since, now)
    left_s = None
    if rows_per_minute and not counts.is_held and counts.under_way:
        left_s = 60.0 * counts.under_way / rows_per_minute
    return Pace(
        rows_per_minute=rows_per_minute,
        calls_per_minute=_per_minute(calls["number"], calls["first"], since, now) or 0.0,
        left_s=left_s,
    )


# --- Private -----------------------------------------------------------------------------------


def _per_minute(
    number: int, first: datetime | None, since: datetime, now: datetime
) -> float | None:
    """Over the time from the first of them, which is shorter where a job has just begun."""
    if not number or first is None:
        return None
    seconds = max((now - max(first, since)).total_seconds(), 1.0)
    return 60.0 * number / seconds


GROUPED = (State.FAILED, State.UNREADABLE, State.REFUSED)

LOOKED_AT = 300
"""So many characters of a reason tell its cause."""

EXAMPLES = 12
"""So many rows of a cause are named on a page; the others are in the grid."""

SHOWN = 20
"""So many causes name rows."""

_STATUS = re.compile(r"\b(HTTP \d{3})\b")
_VARYING = re.compile(
    r"\b[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}\b"  # a UUID
    r"|\b(?:[a-z]+[-_])?(?=[0-9a-f]*\d)[0-9a-f]{12,}\b"  # a request's id
    r"|(?<![\w.-])\d+(?:\.\d+)?",  # a number that is no part of a word
    re.IGNORECASE,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureGroup:
    """Augmentations without a modification that ended for the same cause.

    Attributes:
        key: What names it.
        reason: The reason that most of them have.
        variants: So many different reasons there are.
        augmentations: Some of them, with scenario and contestant.
    """

    key: str
    state: State
    reason: str
    number: int
    variants: int
    augmentations: list[Augmentation]

    @property
    def unnamed(self) -> int:
        """How many more there are than are named."""
        return self.number - len(self.augmentations)


def cause_of(reason: str) -> str:
    """A reason without what differs from row to row; the HTTP status stays."""
    parts = _STATUS.split(reason[:LOOKED_AT])
    varied = [part if number % 2 else _VARYING.sub("#", part) for number, part in enumerate(parts)]
    return " ".join("".join(varied).split())


def failure_groups(job: GenerationJob) -> list[FailureGroup]:
    """What has no modification, by state and cause; machine faults first, then the largest.

    Two queries. Of causes beyond the first SHOWN no rows are named.
    """
    found = _found(job)
    largest = sorted(found, key=lambda one: (one[0] != State.FAILED, -len(found[one]), one[1]))
    named = [pk for one in largest[:SHOWN] for pk, _ in found[one][:EXAMPLES]]
    cells = {cell.pk: cell for cell in cells_of(job).filter(pk__in=named)} if named else {}
    return [_group(state, cause, found[state, cause], cells) for state, cause in largest]


def rows_of_cause(job: GenerationJob, key: str) -> tuple[State, str, list[int]]:
    """The state, the cause and the rows of a group.

    Raises:
        UnknownName: No row of the job has that cause (any more).
    """
    found = _found(job)
    for (state, cause), rows in found.items():
        if key_of(state, cause) == key:
            return state, cause, [pk for pk, _ in rows]
    known = [key_of(state, cause) for state, cause in found]
    raise UnknownName("cause in this job", key, known)


def key_of(state: State, cause: str) -> str:
    """What names a cause in an address."""
    return hashlib.sha256(f"{state.value}\n{cause}".encode()).hexdigest()[:16]


# --- Private -----------------------------------------------------------------------------------


def _found(job: GenerationJob) -> dict[tuple[State, str], list[tuple[int, str]]]:
    """By state and cause the rows with the beginnings of their reasons; one query."""
    rows = job.augmentations.filter(state__in=GROUPED).order_by("pk")
    said = rows.annotate(said=Substr("reason", 1, LOOKED_AT)).values_list("pk", "state", "said")
    causes: dict[str, str] = {}
    found: defaultdict[tuple[State, str], list[tuple[int, str]]] = defaultdict(list)
    for pk, state, reason in said.iterator():
        if reason not in causes:
            causes[reason] = cause_of(reason)
        found[State(state), causes[reason]].append((pk, reason))
    return found


def _group(
    state: State, cause: str, rows: list[tuple[int, str]], cells: dict[int, Augmentation]
) -> FailureGroup:
    said = Counter(reason for _, reason in rows)
    usual = said.most_common(1)[0][0]
    some = [cells[pk] for pk, _ in rows[:EXAMPLES] if pk in cells]
    return FailureGroup(
        key=key_of(state, cause),
        state=state,
        reason=next((one.reason for one in some if one.reason.startswith(usual)), usual),
        number=len(rows),
        variants=len(said),
        augmentations=some,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCallLine:
    """The calls of one contestant, or of one augmentation where there is one.

    Attributes:
        scenario, augmentation: Slug and code of the one augmentation, empty for a contestant.
        augmentations: Those that called at all.
        attempted: Calls in any form, those after the last that is answered included.
        understood: Those of them that could be read.
        mended: Those of them that were not in the form that was asked for.
    """

    contestant: str
    name: str
    is_simulated: bool
    attempted: int
    understood: int
    mended: int
    augmentations: int = 1
    scenario: str = ""
    augmentation: str = ""


def tool_calls_by_augmentation(job: GenerationJob) -> list[ToolCallLine]:
    """One line for each augmentation whose latest attempt called, by contestant and scenario."""
    latest = dict(
        Augmentation.objects.filter(job=job)
        .values_list("pk")
        .annotate(latest=Max("attempts__number"))
    )
    counted: defaultdict[int, list[tuple[bool, bool]]] = defaultdict(list)
    notes = TranscriptNote.objects.filter(
        attempt__augmentation__job=job, kind=NoteKind.TOOL_CALL
    ).values_list("attempt__augmentation_id", "attempt__number", "document")
    for augmentation_id, number, document in notes:
        if number == latest[augmentation_id]:
            # Notes from before these were counted don't say it.
            read = "error" not in document.get("result", {})
            flags = bool(document.get("understood", read)), bool(document.get("mended", False))
            counted[augmentation_id].append(flags)
    rows = (
        Augmentation.objects.filter(pk__in=counted)
        .select_related("contestant", "scenario")
        .defer("modification")
        .order_by("contestant__slug", "scenario__slug", "pk")
    )
    return [
        ToolCallLine(
            contestant=row.contestant.slug,
            name=row.contestant.name,
            is_simulated=row.contestant.is_simulated,
            attempted=len(counted[row.pk]),
            understood=sum(understood for understood, _ in counted[row.pk]),
            mended=sum(mended for _, mended in counted[row.pk]),
            scenario=row.scenario.slug,
            augmentation=str(row.code),
        )
        for row in rows
    ]


def tool_calls_by_contestant(job: GenerationJob) -> list[ToolCallLine]:
    """One line for each contestant that called, by slug."""
    groups: defaultdict[str, list[ToolCallLine]] = defaultdict(list)
    for line in tool_calls_by_augmentation(job):
        groups[line.contestant].append(line)
    return [
        ToolCallLine(
            contestant=slug,
            name=lines[0].name,
            is_simulated=lines[0].is_simulated,
            attempted=sum(line.attempted for line in lines),
            understood=sum(line.understood for line in lines),
            mended=sum(line.mended for line in lines),
            augmentations=len(lines),
        )
        for slug, lines in sorted(groups.items())
    ]
