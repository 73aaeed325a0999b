"""Progress of a job: rows by state, its pace, causes of failure, calls of tools.

Reasons of failure name what was at hand: a request's id, a count, a place in an answer. Two that
differ in nothing else have one cause; its key is the same from one look to the next.
"""

import re
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from django.db.models import Count, Max, QuerySet
from django.db.models.functions import Substr

from augment.models import Attempt, Augmentation, GenerationJob, TranscriptNote
from augment.variants.respondents import NoteKind

State = Augmentation.State

OUTCOMES = tuple(state for state in State if state not in Augmentation.UNDER_WAY)

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
class JobCounts:
    """A job and how many of its augmentations are in each state."""

    job: GenerationJob
    by_state: dict[State, int]

    @property
    def total(self) -> int:
        """All rows: contestants x scenarios x samples."""
        return sum(self.by_state.values())

    @property
    def queued(self) -> int:
        """Rows that no worker has taken yet."""
        return self.by_state[State.QUEUED]

    @property
    def running(self) -> int:
        """Rows that a worker has taken."""
        return self.by_state[State.RUNNING]

    @property
    def under_way(self) -> int:
        """Rows that still wait or run."""
        return self.queued + self.running

    @property
    def settled(self) -> int:
        """Rows that have an outcome."""
        return self.total - self.under_way

    @property
    def failed(self) -> int:
        """Rows that broke and may be tried again."""
        return self.by_state[State.FAILED]

    @property
    def is_moving(self) -> bool:
        """True if any row will change by itself; false if only held ones are left."""
        is_held = self.job.state in GenerationJob.HELD
        return (self.running if is_held else self.under_way) > 0

    @property
    def is_over(self) -> bool:
        """True if nothing changes by itself; a job runs on for a moment after its last row."""
        return not self.is_moving and self.job.state != GenerationJob.State.RUNNING


@dataclass(frozen=True, slots=True, kw_only=True)
class FailureGroup:
    """Augmentations without a modification that ended for the same cause.

    Attributes:
        reason: The beginning of the reason that most of them have.
        augmentations: Some of them, with scenario and contestant.
    """

    state: State
    reason: str
    number: int
    augmentations: list[Augmentation]

    @property
    def unnamed(self) -> int:
        """Number of further ones without a name."""
        return self.number - len(self.augmentations)


def count_rows(job: GenerationJob) -> JobCounts:
    """Count the rows of one job by state; one query."""
    return count_each([job])[0]


def count_each(jobs: Sequence[GenerationJob]) -> list[JobCounts]:
    """Count the rows of several jobs by state; one query."""
    rows = Augmentation.objects.filter(job__in=jobs).order_by().values_list("job_id", "state")
    counts = {(job, state): number for job, state, number in rows.annotate(number=Count("pk"))}
    return [
        JobCounts(job=job, by_state={state: counts.get((job.pk, state), 0) for state in State})
        for job in jobs
    ]


def list_cells(job: GenerationJob) -> QuerySet[Augmentation]:
    """Return the augmentations with scenarios and contestants, without long documents."""
    documents = ("modification", "scenario__reference")
    return job.augmentations.select_related("scenario", "contestant").defer(*documents)


def generalise_reason(reason: str) -> str:
    """Return a reason without what differs from row to row; the HTTP status stays."""
    parts = _STATUS.split(reason[:LOOKED_AT])
    varied = [part if number % 2 else _VARYING.sub("#", part) for number, part in enumerate(parts)]
    return " ".join("".join(varied).split())


def failure_groups(job: GenerationJob) -> list[FailureGroup]:
    """Group rows without a modification by cause; machine faults first, then the largest.

    Two queries. Of causes beyond the first SHOWN no rows are named.
    """
    rows = job.augmentations.filter(state__in=GROUPED).order_by("pk")
    begun = rows.annotate(start=Substr("reason", 1, LOOKED_AT))
    causes: defaultdict[tuple[State, str], list[tuple[int, str]]] = defaultdict(list)
    for pk, state, reason in begun.values_list("pk", "state", "start").iterator():
        causes[State(state), generalise_reason(reason)].append((pk, reason))
    order = sorted(causes, key=lambda key: (key[0] != State.FAILED, -len(causes[key]), key[1]))
    named = [pk for key in order[:SHOWN] for pk, _ in causes[key][:EXAMPLES]]
    cells = {cell.pk: cell for cell in list_cells(job).filter(pk__in=named)} if named else {}
    return [
        FailureGroup(
            state=state,
            reason=Counter(reason for _, reason in causes[state, cause]).most_common(1)[0][0],
            number=len(causes[state, cause]),
            augmentations=[cells[pk] for pk, _ in causes[state, cause][:EXAMPLES] if pk in cells],
        )
        for state, cause in order
    ]


def tool_calls(job: GenerationJob) -> list[dict[str, Any]]:
    """Return a line for each augmentation whose latest attempt called a tool, in order.

    `attempted` counts calls in any form, those after the last that is answered included;
    `understood` those that could be read, `mended` those of them in another form than asked for.
    """
    attempts = Attempt.objects.filter(augmentation__job=job).values("augmentation")
    latest = dict(attempts.annotate(last=Max("number")).values_list("augmentation", "last"))
    calls: defaultdict[int, Counter[str]] = defaultdict(Counter)
    notes = TranscriptNote.objects.filter(
        attempt__augmentation__job=job, kind=NoteKind.TOOL_CALL
    ).values_list("attempt__augmentation_id", "attempt__number", "document")
    for pk, number, document in notes:
        if number == latest[pk]:
            # Notes of early releases don't say whether a call was understood.
            is_read = document.get("understood", "error" not in document.get("result", {}))
            is_mended = document.get("mended", False)
            calls[pk].update(attempted=1, understood=int(is_read), mended=int(is_mended))
    rows = list_cells(job).filter(pk__in=calls)
    return [
        {
            "contestant": row.contestant.slug,
            "name": row.contestant.name,
            "simulated": row.contestant.is_simulated,
            "scenario": row.scenario.slug,
            "augmentation": str(row.code),
            **calls[row.pk],
        }
        for row in rows.order_by("contestant__slug", "scenario__slug", "pk")
    ]
