"""How fast a job goes right now, and when it will be through at that rate."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime, timedelta

from django.db.models import Count, Min

from augment.models import Attempt, Augmentation, ModelCall
from augment.services.clock import database_now
from augment.services.running.progress import JobCounts

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
