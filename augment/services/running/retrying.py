"""Letting rows of a job wait again: what failed, or the rows of one cause alone."""

from __future__ import annotations

from django.contrib.auth.models import User
from django.db import transaction
from django.db.models import QuerySet

from augment.errors import Conflict
from augment.models import Augmentation, GenerationJob
from augment.services.clock import database_now
from augment.services.events import log_event
from augment.services.running.jobs import open_again
from augment.services.running.progress import rows_of_cause
from augment.services.work import change_all

State = Augmentation.State

RETRIED = (State.FAILED, State.UNREADABLE)
"""What may be tried again. Who declined has answered, and is not asked until it says yes."""


@transaction.atomic
def retry_cause(job: GenerationJob, *, key: str, actor: User | None = None) -> GenerationJob:
    """Let the rows that ended for one cause wait again; the door sends the messages.

    What failed goes on from the answers that it had. What was unreadable is asked anew, because
    the same answer would be read the same way; the attempt that counted so far stays on record.

    Args:
        job: Whose rows they are.
        key: Of the cause, as `failure_groups` gives it.
        actor: Who wants it.

    Raises:
        UnknownName: No row has that cause (any more).
        Conflict: The job was cancelled, or the contestants have refused.
    """
    state, cause, pks = rows_of_cause(job, key)
    if state not in RETRIED:
        raise Conflict(
            "Who refused has answered: it is not asked again. Launch a new job instead."
        )
    anew: dict[str, object] = {}
    if state == State.UNREADABLE:
        anew = {"image": "", "notes": "", "asked_anew_at": database_now()}
    rows = Augmentation.objects.filter(pk__in=pks, state=state)
    _let_wait(job, rows, actor, told={"state": state.value, "cause": cause}, **anew)
    return job


@transaction.atomic
def retry_failed(job: GenerationJob, actor: User | None = None) -> GenerationJob:
    """Let every failed row wait again; outcomes of the contestants themselves stay.

    In a job that is paused or stopped at its cap they wait, with the others, until it is resumed.

    Raises:
        Conflict: The job was cancelled, or nothing in it failed.
    """
    failed = Augmentation.objects.filter(job=job, state=State.FAILED)
    if not _let_wait(job, failed, actor, told={}):
        raise Conflict(f"Nothing in job '{job.name}' failed; there is nothing to try again.")
    return job


# --- Private -----------------------------------------------------------------------------------


def _let_wait(
    job: GenerationJob,
    rows: QuerySet[Augmentation],
    actor: User | None,
    *,
    told: dict[str, str],
    **columns: object,
) -> int:
    """Returns how many wait again; the job goes on with them."""
    waiting = {"state": State.QUEUED, "reason": "", "finished_at": None, "sent_at": None}
    again = change_all(rows, **waiting, **columns)
    open_again(job)
    log_event(
        actor=actor,
        verb="retry",
        object_kind="job",
        object_code=job.code,
        after={"queued": again, **told},
    )
    job.refresh_from_db()
    return again
