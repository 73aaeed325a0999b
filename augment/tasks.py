"""Celery tasks of augment: doors that carry one id, and what brings lost work back.

Rows are the truth. A message may come twice (the claim refuses the second) or never (recover
sends another). Services never enqueue; doors call `enqueue_job` by transaction.on_commit.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from threading import Event, Thread
from typing import Any

from celery import current_app, shared_task
from celery.signals import worker_ready, worker_shutting_down
from django.conf import settings
from django.db import Error, connection

from augment.errors import QueueUnreachable
from augment.services import claims, jobs, marked_pictures, runner
from augment.services.clock import DATABASE_TIME, Moment

logger = logging.getLogger(__name__)

RESEND_AFTER = timedelta(minutes=10)
"""A message that waits longer than this may be lost; a second one does no harm."""

BATCH = 100
"""So many messages are sent before the rows say so; a crash between sends them twice."""

_stopping = Event()


@shared_task(name="augment.run_augmentation", bind=True, acks_late=True, ignore_result=True)
def run_augmentation(self: Any, augmentation_pk: int) -> None:
    """Run one row, unless somebody else has it or it has an outcome."""
    worker = f"{self.request.hostname or 'here'} {os.getpid()}"
    runner.work_on(augmentation_pk=augmentation_pk, worker=worker[:120])


@shared_task(name="augment.draw_marks", ignore_result=True)
def draw_marks(augmentation_pk: int) -> None:
    """Draw the faults that the checks find in one row; a second time nothing is left to do."""
    marked_pictures.draw_marked(augmentation_pk=augmentation_pk)


def enqueue_marks(augmentation_pk: int) -> None:
    """Have a row's faults drawn; for transaction.on_commit.

    Raises:
        QueueUnreachable: No broker.
    """
    with _broker() as broker:
        draw_marks.apply_async((augmentation_pk,), connection=broker, retry=False)


def enqueue(ids: Iterable[int]) -> int:
    """Send one message per row and remember when.

    Returns:
        How many were sent.

    Raises:
        QueueUnreachable: No broker; the rows wait on and are sent by recover later.
    """
    waiting = list(ids)
    if not waiting:
        return 0
    with _broker() as broker:
        for start in range(0, len(waiting), BATCH):
            batch = waiting[start : start + BATCH]
            for pk in batch:
                run_augmentation.apply_async((pk,), connection=broker, retry=False)
            claims.mark_sent(ids=batch)
    return len(waiting)


def enqueue_job(job_pk: int) -> int:
    """Send the messages of a job's rows that have none yet; for transaction.on_commit.

    Raises:
        QueueUnreachable: No broker; the rows wait on and are sent by recover later.
    """
    return enqueue(claims.unsent(older_than=RESEND_AFTER, job_pk=job_pk))


def check_broker() -> None:
    """Raise QueueUnreachable unless a broker takes messages."""
    with _broker():
        pass


def recover(*, now: Moment = DATABASE_TIME, at_start: bool = False) -> None:
    """Take back what dead workers held, finish what is over and send what has no message.

    Args:
        now: The time; the database's, for no worker's clock may take work away.
        at_start: Whether every waiting row gets a message, however new its last one: the broker
            may have been started anew together with this worker.

    Raises:
        QueueUnreachable: No broker.
    """
    stale_after = timedelta(seconds=settings.STALE_AFTER_S)
    claims.requeue_stale(now=now, older_than=stale_after)
    jobs.finish_if_over(now=now)
    if at_start:
        older_than = timedelta(0)
    elif _messages_waiting():
        older_than = RESEND_AFTER
    else:
        # Nothing is on its way, so what was sent a while ago and still waits is lost.
        older_than = stale_after
    enqueue(claims.unsent(now=now, older_than=older_than))


@worker_ready.connect
def start_recovering(**_: object) -> None:
    """Recover now and again and again, in a thread of the worker's main process."""
    _stopping.clear()
    Thread(target=_recover_until_stopped, name="recover", daemon=True).start()


@worker_shutting_down.connect
def stop_recovering(**_: object) -> None:
    """Let the thread end; a worker that shuts down takes nothing on."""
    _stopping.set()


# --- Private -----------------------------------------------------------------------------------


def _recover_until_stopped() -> None:
    """One round at the start, then one every RECOVER_EVERY_S; no fault ends it."""
    at_start = True
    while not _stopping.is_set():
        try:
            recover(at_start=at_start)
            at_start = False
        except (QueueUnreachable, Error) as error:
            logger.warning("Could not recover, will try again: %s", error)
        finally:
            connection.close()
        _stopping.wait(settings.RECOVER_EVERY_S)


@contextmanager
def _broker() -> Iterator[Any]:
    """A connection that works, tried once; what breaks inside the block is named as well."""
    with current_app.connection_for_write() as broker:
        try:
            broker.ensure_connection(max_retries=1, interval_start=0, timeout=5)
            yield broker
        except run_augmentation.OperationalError as error:
            # The password is masked, and the mask is shown even where there is none.
            address = broker.as_uri() if broker.password else broker.as_uri().replace(":**@", "")
            raise QueueUnreachable(address) from error


def _messages_waiting() -> int:
    """How many messages no worker has taken yet."""
    with _broker() as broker:
        queue = current_app.conf.task_default_queue
        return int(broker.default_channel.queue_declare(queue=queue).message_count)
