"""What came out of a job: how many rows are in each state, and a line per contestant."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, cast

from django.db.models import Count, F, Q, QuerySet

from augment.models import Augmentation, GenerationJob

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
