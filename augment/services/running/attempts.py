"""The tries at an augmentation: opened with its lease, closed with its outcome."""

from __future__ import annotations

from django.db.models import Max

from augment.errors import JobCancelled, LeaseLost
from augment.models import Attempt, Augmentation, GenerationJob
from augment.services.clock import Moment
from augment.services.running import budget
from augment.services.work import Lease, TryEnd

CANCELLED = GenerationJob.objects.filter(state=GenerationJob.State.CANCELLED)
CLOSED = GenerationJob.objects.filter(
    state__in=(GenerationJob.State.CANCELLED, *GenerationJob.HELD)
)
"""Jobs in which nothing is started any more, or not for now."""


def open_attempt(pk: int, worker: str, now: Moment) -> None:
    """The next try at an augmentation."""
    tries = Attempt.objects.filter(augmentation_id=pk)
    number = (tries.aggregate(last=Max("number"))["last"] or 0) + 1
    Attempt.objects.create(augmentation_id=pk, number=number, worker=worker, started_at=now)


def close_attempt(pk: int, end: str, reason: str, now: Moment) -> None:
    """How the current try ended. One that was lost stays without a time: nobody saw its end."""
    budget.settle_unseen(row_pk=pk, now=now)
    finished_at = None if end == TryEnd.LOST else now
    Attempt.objects.filter(augmentation_id=pk, finished_at=None, outcome="").update(
        finished_at=finished_at, outcome=end, reason=reason
    )


def insist_wanted(held: Lease[Augmentation], *, lock: bool = False) -> None:
    """Return while the row is the holder's and its job goes on.

    Raises:
        LeaseLost: The row is somebody else's now.
        JobCancelled: Its job is cancelled.
    """
    if not held.is_held(lock=lock):
        raise LeaseLost
    if CANCELLED.filter(augmentations=held.pk).exists():
        raise JobCancelled
