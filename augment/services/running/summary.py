"""What came out of a job: a line per contestant, and its failures by their reason."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, cast

from django.db.models import Count, F, Q

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
class ReasonCount:
    """Rows that failed for the same reason."""

    reason: str
    count: int


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


def failure_groups(job: GenerationJob) -> list[ReasonCount]:
    """The reasons of the failed rows, the most frequent first."""
    failed = job.augmentations.filter(state=State.FAILED).values("reason")
    groups = failed.annotate(count=Count("pk")).order_by("-count", "reason")
    return [ReasonCount(reason=group["reason"], count=group["count"]) for group in groups]
