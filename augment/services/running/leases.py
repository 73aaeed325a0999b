"""Who works on which augmentation: one conditional UPDATE decides, never a message.

A message may come twice or never. A row is leased to exactly one worker, which keeps the lease
alive by a heartbeat; a lease without one is taken back and the row waits again. What time it is
says the database, so that workers whose clocks differ judge a lease alike.
"""

from __future__ import annotations

import logging
import uuid
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import timedelta
from enum import StrEnum
from typing import Any

from django.db import transaction
from django.db.models import Max, Q, QuerySet

from augment.llm.cutting import shorten
from augment.models import Attempt, Augmentation, GenerationJob
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.running import budget
from augment.services.texts import (
    LONGEST_NOTES,
    LONGEST_REASON,
    make_document_storable,
    make_storable,
)

logger = logging.getLogger(__name__)

LOST_LIMIT = 5
"""So many workers in a row may die at one row; then it is the row's fault and it fails."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Lease:
    """The right to write the outcome of one augmentation, as long as the row carries the token."""

    token: uuid.UUID
    augmentation_pk: int
    attempt_pk: int
    attempt_number: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Settlement:
    """How a try ended.

    Attributes:
        state: An outcome: done, unreadable, refused or failed.
        reason: Why there is no modification, as a sentence; empty when done.
        image: Name of the picture in the media storage, empty when failed.
    """

    state: Augmentation.State
    reason: str = ""
    modification: dict[str, Any] | None = None
    notes: str = ""
    image: str = ""


class TryEnd(StrEnum):
    """How an attempt can end beside the outcomes of its augmentation."""

    LOST = "lost"
    RELEASED = "released"
    STOPPED = "stopped at cap"


@transaction.atomic
def take_lease(
    *, augmentation_pk: int, now: Moment = DATABASE_TIME, worker: str = ""
) -> Lease | None:
    """Take a waiting row and open its next attempt.

    Returns:
        The lease, or None when the row does not wait (any more): somebody else has it, it is
        done, it or its job was cancelled, the job is paused or stopped at its cap. A second
        delivery of a message does nothing therefore.
    """
    token = uuid.uuid4()
    waiting = Augmentation.objects.filter(pk=augmentation_pk, state=Augmentation.State.QUEUED)
    taken = waiting.exclude(job__in=_closed_jobs()).update(
        state=Augmentation.State.RUNNING, claim=token, heartbeat_at=now, finished_at=None
    )
    if not taken:
        return None
    tries = Attempt.objects.filter(augmentation_id=augmentation_pk)
    number = (tries.aggregate(last=Max("number"))["last"] or 0) + 1
    attempt = Attempt.objects.create(
        augmentation_id=augmentation_pk, number=number, worker=worker, started_at=now
    )
    return Lease(
        token=token,
        augmentation_pk=augmentation_pk,
        attempt_pk=attempt.pk,
        attempt_number=number,
    )


def renew(*, held: Lease, now: Moment = DATABASE_TIME) -> bool:
    """Say that the holder is alive; False when the lease is lost."""
    return bool(_row_of(held).update(heartbeat_at=now))


def is_held(*, held: Lease, lock: bool = False) -> bool:
    """Whether the row still carries the lease; locked, it does until the transaction ends."""
    row = _row_of(held)
    if lock:
        return row.select_for_update().values_list("pk").first() is not None
    return row.exists()


def is_cancelled(*, held: Lease) -> bool:
    """Whether the row's job was cancelled while it was worked on."""
    return _cancelled_jobs().filter(augmentations=held.augmentation_pk).exists()


def keep_modification(*, held: Lease, modification: dict[str, Any], notes: str) -> bool:
    """Store what was understood before it is drawn, so that a second try only has to draw.

    Returns:
        False when the lease is lost; nothing was written then.
    """
    return bool(
        _row_of(held).update(
            modification=make_document_storable(modification),
            notes=shorten(make_storable(notes), LONGEST_NOTES),
        )
    )


def note_injected(*, held: Lease, injected: dict[str, str]) -> bool:
    """Store the true label of a simulated answer; False when the lease is lost."""
    return bool(_row_of(held).update(injected=injected))


def note_options(*, held: Lease, options: dict[str, Any]) -> bool:
    """Store with which options a model is asked; False when the lease is lost."""
    return bool(_row_of(held).update(options=options))


@transaction.atomic
def settle(*, held: Lease, settlement: Settlement, now: Moment = DATABASE_TIME) -> bool:
    """Write the outcome and close the attempt.

    Returns:
        False when the lease is lost: the result is dropped, because the row is somebody else's.
    """
    reason = shorten(make_storable(settlement.reason), LONGEST_REASON)
    changes: dict[str, Any] = {
        "state": settlement.state,
        "reason": reason,
        "image": settlement.image,
        "finished_at": now,
        "claim": None,
        "heartbeat_at": None,
    }
    if settlement.modification is not None:
        changes |= {"modification": make_document_storable(settlement.modification)}
    if settlement.notes:
        changes |= {"notes": shorten(make_storable(settlement.notes), LONGEST_NOTES)}
    if not _row_of(held).update(**changes):
        logger.warning(
            "Dropped the result of attempt %d at augmentation %d: its lease was taken back.",
            held.attempt_number,
            held.augmentation_pk,
        )
        return False
    budget.settle_unseen(attempt_pk=held.attempt_pk, now=now)
    Attempt.objects.filter(pk=held.attempt_pk).update(
        finished_at=now, outcome=settlement.state, reason=reason
    )
    return True


@transaction.atomic
def release(
    *, held: Lease, now: Moment = DATABASE_TIME, end: TryEnd = TryEnd.RELEASED, reason: str = ""
) -> bool:
    """Give an unfinished row back to the queue; False when the lease is lost already."""
    if not _row_of(held).update(
        state=Augmentation.State.QUEUED, claim=None, heartbeat_at=None, sent_at=None
    ):
        return False
    budget.settle_unseen(attempt_pk=held.attempt_pk, now=now)
    Attempt.objects.filter(pk=held.attempt_pk).update(
        finished_at=now, outcome=end, reason=shorten(make_storable(reason), LONGEST_REASON)
    )
    return True


def take_back_stale(*, now: Moment = DATABASE_TIME, older_than: timedelta) -> list[int]:
    """Take back every lease whose last heartbeat is older than that.

    Rows of cancelled jobs become cancelled, also those that wait again since, because a worker
    gave them back while somebody cancelled. A row that has lost LOST_LIMIT workers in a row
    fails, so that one that kills its workers can't keep them all busy.

    Returns:
        Primary keys of the rows that wait again and need a message.
    """
    taken_back = [
        row.pk
        for row in _silent(now=now, older_than=older_than)
        if _take_back(row, now=now, older_than=older_than)
    ]
    orphans = Augmentation.objects.filter(
        state=Augmentation.State.QUEUED, job__in=_cancelled_jobs()
    )
    change_all(orphans, state=Augmentation.State.CANCELLED, finished_at=now)
    return taken_back


def find_unsent(
    *, now: Moment = DATABASE_TIME, older_than: timedelta, job_pk: int | None = None
) -> list[int]:
    """Waiting rows, of one job or of all, without a message or with one that old.

    What waits in a job that is paused or stopped at its cap waits for somebody to resume it.
    """
    waiting = Augmentation.objects.filter(state=Augmentation.State.QUEUED).exclude(
        job__in=GenerationJob.objects.filter(state__in=GenerationJob.HELD)
    )
    if job_pk is not None:
        waiting = waiting.filter(job=job_pk)
    lost = Q(sent_at=None) | Q(sent_at__lte=now - older_than)
    return list(waiting.filter(lost).order_by("pk").values_list("pk", flat=True))


def mark_sent(*, ids: Iterable[int], now: Moment = DATABASE_TIME) -> None:
    """Remember when the messages of these rows were sent."""
    change_all(Augmentation.objects.filter(pk__in=list(ids)), sent_at=now)


@transaction.atomic
def change_all(rows: QuerySet[Augmentation], **changes: Any) -> int:
    """Write the same into many rows; how many there were.

    Held in the order of their numbers, so that of two who change the same rows none waits for the
    other in a circle: an UPDATE takes them as they lie. Who also changes their job does that
    afterwards, as those do who settle a single row.
    """
    held = rows.order_by("pk").select_for_update(no_key=True)
    list(held.values_list("pk", flat=True))
    return rows.update(**changes)


# --- Private -----------------------------------------------------------------------------------


def _row_of(held: Lease) -> QuerySet[Augmentation]:
    """The row, if it is still the holder's."""
    return Augmentation.objects.filter(
        pk=held.augmentation_pk, state=Augmentation.State.RUNNING, claim=held.token
    )


def _cancelled_jobs() -> QuerySet[GenerationJob]:
    return GenerationJob.objects.filter(state=GenerationJob.State.CANCELLED)


def _closed_jobs() -> QuerySet[GenerationJob]:
    """Jobs in which nothing is started any more, or not for now."""
    closed = (GenerationJob.State.CANCELLED, *GenerationJob.HELD)
    return GenerationJob.objects.filter(state__in=closed)


def _silent(*, now: Moment, older_than: timedelta) -> QuerySet[Augmentation]:
    """Rows whose holders have not been heard for so long."""
    return Augmentation.objects.filter(
        state=Augmentation.State.RUNNING, heartbeat_at__lt=now - older_than
    )


@transaction.atomic
def _take_back(seen: Augmentation, *, now: Moment, older_than: timedelta) -> bool:
    """End a stale lease, unless its holder was heard since; True when the row waits again."""
    lost = _lost_in_a_row(seen.pk) + 1
    changes: dict[str, Any] = {"state": Augmentation.State.QUEUED, "sent_at": None}
    if _cancelled_jobs().filter(pk=seen.job_id).exists():
        changes = {"state": Augmentation.State.CANCELLED, "finished_at": now}
    elif lost >= LOST_LIMIT:
        reason = f"Lost {lost} workers in a row at this one; look for the cause, then retry."
        changes = {"state": Augmentation.State.FAILED, "finished_at": now, "reason": reason}
    row = _silent(now=now, older_than=older_than).filter(pk=seen.pk, claim=seen.claim)
    if not row.update(claim=None, heartbeat_at=None, **changes):
        return False
    budget.settle_unseen(row_pk=seen.pk, now=now)
    # The attempt stays without an end: nobody saw it.
    Attempt.objects.filter(augmentation_id=seen.pk, finished_at=None, outcome="").update(
        outcome=TryEnd.LOST, reason="The worker stopped without a word."
    )
    logger.warning("Took back augmentation %d: silent since %s.", seen.pk, seen.heartbeat_at)
    return bool(changes["state"] == Augmentation.State.QUEUED)


def _lost_in_a_row(pk: int) -> int:
    """How many of the last attempts before the current one were lost."""
    ended = Attempt.objects.filter(augmentation_id=pk).exclude(outcome="")
    count = 0
    for outcome in ended.order_by("-number").values_list("outcome", flat=True)[:LOST_LIMIT]:
        if outcome != TryEnd.LOST:
            break
        count += 1
    return count
