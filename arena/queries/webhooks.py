"""What happened that an address has to be told of. Nothing in it tells who leads a study."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import datetime, timedelta
from typing import Any

from django.db.models import Count, Q, QuerySet

from arena.models import Snapshot, Study, Webhook, WebhookDelivery
from augment.models import Event, GenerationJob

LOOK_BACK = timedelta(hours=1)
"""So long before the last look is looked again: what was written then may be committed later."""

What = Webhook.What
EVENTS = (What.JOB_FINISHED, What.BUDGET_HIT, What.STUDY_CLOSED, What.SNAPSHOT_FROZEN)
"""What an address can be told of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Occurrence:
    """Something that happened.

    Attributes:
        name: The same whenever it is found again.
        about: What is told of it.
    """

    name: str
    at: datetime
    about: dict[str, Any]


def occurrences_for(webhook: Webhook) -> Iterator[tuple[str, Occurrence]]:
    """What happened since the address was entered and may not have been told yet."""
    since = webhook.made_at
    if webhook.looked_at is not None:
        since = max(since, webhook.looked_at - LOOK_BACK)
    for event, find in _FINDERS.items():
        if event.value in webhook.events:
            for found in find(webhook, since):
                yield event.value, found


def webhooks_with_counts() -> QuerySet[Webhook]:
    """Every address with how many messages were delivered, wait and failed."""
    states = WebhookDelivery.State
    counts = {
        state.value: Count("deliveries", filter=Q(deliveries__state=state)) for state in states
    }
    return Webhook.objects.annotate(**counts)


# --- Private -----------------------------------------------------------------------------------


def _jobs_finished(webhook: Webhook, since: datetime) -> Iterator[Occurrence]:
    rows = GenerationJob.objects.filter(state=GenerationJob.State.FINISHED, finished_at__gte=since)
    for job in rows:
        assert job.finished_at is not None
        yield Occurrence(
            name=f"{job.code} {job.finished_at.isoformat()}",
            at=job.finished_at,
            about={"job": str(job.code), "name": job.name, "state": job.state},
        )


def _budgets_hit(webhook: Webhook, since: datetime) -> Iterator[Occurrence]:
    stops = list(
        Event.objects.filter(object_kind="job", verb="stop", at__gte=since).order_by("pk")
    )
    # The log keeps codes as texts, which PostgreSQL compares with no code.
    stopped = GenerationJob.objects.filter(code__in={stop.object_code for stop in stops})
    known = {str(code): name for code, name in stopped.values_list("code", "name")}
    for stop in stops:
        yield Occurrence(
            name=f"{stop.object_code} {stop.at.isoformat()}",
            at=stop.at,
            about={
                "job": stop.object_code,
                "name": known.get(stop.object_code, ""),
                "cap": (stop.after or {}).get("cap"),
            },
        )


def _studies_closed(webhook: Webhook, since: datetime) -> Iterator[Occurrence]:
    for study in Study.objects.filter(state=Study.State.CLOSED, closed_at__gte=since):
        assert study.closed_at is not None
        yield Occurrence(
            name=str(study.code),
            at=study.closed_at,
            about={"study": str(study.code), "name": study.name},
        )


def _snapshots_frozen(webhook: Webhook, since: datetime) -> Iterator[Occurrence]:
    """A rating says when it was asked for, not when it was ready: all since are looked at."""
    told = webhook.deliveries.filter(event=What.SNAPSHOT_FROZEN).values("occurrence")
    rows = Snapshot.objects.filter(state=Snapshot.State.READY, made_at__gte=webhook.made_at)
    codes = {str(code) for code in rows.values_list("code", flat=True)}
    new = codes - set(told.values_list("occurrence", flat=True))
    for snapshot in rows.filter(code__in=new).select_related("study").defer("results"):
        yield Occurrence(
            name=str(snapshot.code),
            at=snapshot.made_at,
            about={
                "snapshot": str(snapshot.code),
                "study": str(snapshot.study.code),
                "name": snapshot.study.name,
            },
        )


_FINDERS: dict[What, Callable[[Webhook, datetime], Iterator[Occurrence]]] = {
    What.JOB_FINISHED: _jobs_finished,
    What.BUDGET_HIT: _budgets_hit,
    What.STUDY_CLOSED: _studies_closed,
    What.SNAPSHOT_FROZEN: _snapshots_frozen,
}
