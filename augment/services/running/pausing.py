"""Holding a job and letting it go on: nothing new is started, nothing that runs is lost."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction

from augment.errors import Conflict
from augment.models import Augmentation, GenerationJob
from augment.services.events import log_event
from augment.services.running.budget import NO_CAPS, Caps, over_already, raise_cap
from augment.services.work import change_all

State = GenerationJob.State


@transaction.atomic
def pause(job: GenerationJob, *, actor: User | None = None) -> GenerationJob:
    """Start nothing new; what is in flight ends and keeps its results.

    Raises:
        Conflict: The job is not running.
    """
    running = GenerationJob.objects.filter(pk=job.pk, state=State.RUNNING)
    if not running.update(state=State.PAUSED):
        job.refresh_from_db()
        if job.state in GenerationJob.HELD:
            raise Conflict(
                f"Job '{job.name}' is {job.get_state_display().lower()} already: it starts "
                "nothing until it is resumed."
            )
        raise Conflict(over_already(job))
    log_event(
        actor=actor,
        verb="pause",
        object_kind="job",
        object_code=job.code,
        before={"state": State.RUNNING.value},
        after={
            "state": State.PAUSED.value,
            "waiting": _count(job, Augmentation.State.QUEUED),
            "in_flight": _count(job, Augmentation.State.RUNNING),
        },
    )
    job.refresh_from_db()
    return job


@transaction.atomic
def resume(
    job: GenerationJob, *, higher: Caps = NO_CAPS, actor: User | None = None
) -> GenerationJob:
    """Let a job that is paused or stopped at its cap go on; the door sends the messages.

    Attempts that were stopped are replayed from the answers that they had, and pay for none twice.

    Args:
        job: Which.
        higher: The caps that are raised first; the others stay.
        actor: Who wants it.

    Raises:
        Conflict: The job is not held, or a cap would not be higher than it is.
    """
    held = GenerationJob.objects.filter(pk=job.pk, state__in=GenerationJob.HELD)
    waiting = Augmentation.objects.filter(job=job.pk, state=Augmentation.State.QUEUED)
    again = change_all(waiting, sent_at=None)
    if higher != NO_CAPS:
        raise_cap(job, caps=higher, actor=actor)
    before = held.select_for_update().values_list("state", flat=True).first()
    if not held.update(state=State.RUNNING):
        job.refresh_from_db()
        raise Conflict(
            f"Job '{job.name}' is {job.get_state_display().lower()}; only one that is paused "
            "or stopped at its cap can be resumed."
        )
    log_event(
        actor=actor,
        verb="resume",
        object_kind="job",
        object_code=job.code,
        before={"state": before},
        after={"state": State.RUNNING.value, "queued": again},
    )
    job.refresh_from_db()
    return job


# --- Private -----------------------------------------------------------------------------------


def _count(job: GenerationJob, state: Augmentation.State) -> int:
    return Augmentation.objects.filter(job=job.pk, state=state).count()
