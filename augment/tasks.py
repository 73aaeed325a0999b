"""Celery tasks: doors that carry the key of a row, and what brings lost work back.

Rows are the truth. A message may come twice (the lease refuses the second) or never (recover
sends another). Services never enqueue; doors do, by transaction.on_commit.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Iterable, Mapping
from datetime import timedelta
from functools import partial
from threading import Event, Thread
from typing import Any

from celery import shared_task
from celery.exceptions import Reject
from celery.signals import worker_ready, worker_shutdown, worker_shutting_down
from django.conf import settings
from django.db import connection
from django.db.models import Q

from augment.broker import open_broker, send
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.endpoints.probing import PROBES
from augment.services.judging import findings
from augment.services.judging.simulations import DRIVES
from augment.services.running import workers
from augment.services.running import workers as stopping
from augment.services.running.intent_readings import READINGS
from augment.services.running.runner import AUGMENTATIONS
from augment.services.scenarios import pictures, prompts
from augment.services.scenarios.uploads import MOMENTS, UPLOADS
from augment.services.work import KINDS, WorkKind, register

logger = logging.getLogger(__name__)

RESEND_AFTER = timedelta(minutes=10)
"""A message that waits longer than this may be lost; a second one does no harm."""

QUEUE_BEFORE = "celery"
"""What earlier releases called the queue of everything."""

BATCH = 100
"""So many messages are sent before the rows say so; a crash between sends them twice."""


register(AUGMENTATIONS, DRIVES, READINGS, PROBES, UPLOADS, MOMENTS)

DRAWN: Mapping[str, Callable[[int], object]] = {
    "marks": lambda pk: findings.draw_marked(augmentation_pk=pk),
    "scene": pictures.draw_scene,
    "scenario": pictures.draw_scenario,
    "prompts": prompts.draw_prompts,
}
"""Pictures of the row with that key, as far as they are not there yet."""


@shared_task(name="augment.work", bind=True, acks_late=True, ignore_result=True)
def work(self: Any, kind: str, pk: int) -> None:
    """Work on one row, unless somebody else has it or it has an outcome."""
    if stopping.is_stop_requested():
        raise Reject("this worker stops", requeue=True)
    worker = f"{self.request.hostname or 'here'} {os.getpid()}"
    KINDS[kind].perform(pk, worker=worker[:120])


@shared_task(name="augment.draw", acks_late=True, ignore_result=True)
def draw(what: str, pk: int) -> None:
    """Draw what is missing; a second time nothing is left to do."""
    DRAWN[what](pk)


def enqueue(kind: WorkKind[Any], pks: Iterable[int]) -> int:
    """Send one message per row and remember when; for transaction.on_commit.

    Returns:
        How many were sent.

    Raises:
        QueueFault: No broker, or it refuses; the rows wait on and are sent by recover later.
    """
    waiting = list(pks)
    if not waiting:
        return 0
    with open_broker() as broker:
        for start in range(0, len(waiting), BATCH):
            batch = waiting[start : start + BATCH]
            for pk in batch:
                work.apply_async(
                    (kind.name, pk),
                    queue=kind.queue,
                    shadow=f"work.{kind.name}",  # in logs
                    connection=broker,
                    retry=False,
                )
            kind.mark_sent(batch)
    return len(waiting)


def enqueue_job(job_pk: int) -> int:
    """Send the messages of a job's rows that have none yet; as `enqueue`."""
    unsent = AUGMENTATIONS.find_unsent(older_than=RESEND_AFTER, only=Q(job=job_pk))
    return enqueue(AUGMENTATIONS, unsent)


def sender(kind: WorkKind[Any]) -> Callable[[int], int]:
    """Return what sends the message of one row; as `enqueue`."""
    return lambda pk: enqueue(kind, [pk])


enqueue_moment = sender(MOMENTS)
enqueue_probe = sender(PROBES)
enqueue_reading = sender(READINGS)
enqueue_upload = sender(UPLOADS)
enqueue_simulations = partial(enqueue, DRIVES)

enqueue_marks = partial(send, draw, "marks")
enqueue_prompts = partial(send, draw, "prompts")
enqueue_scenario = partial(send, draw, "scenario")
enqueue_scene = partial(send, draw, "scene")


def recover(*, now: Moment = DATABASE_TIME, at_start: bool = False) -> None:
    """Take back what dead workers held, finish what is over and send what has no message.

    Args:
        now: The time; the database's, for no worker's clock may take work away.
        at_start: Whether every waiting row gets a message, however new its last one: the broker
            may have been started anew together with this worker.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    for kind in KINDS.values():
        kind.take_back_lost(now=now)
        kind.tidy(now)
    queues = {kind.queue for kind in KINDS.values()}
    ages = {queue: timedelta(0) if at_start else _lost_after(queue) for queue in queues}
    for kind in KINDS.values():
        enqueue(kind, kind.find_unsent(now=now, older_than=ages[kind.queue]))


@worker_ready.connect
def start_recovering(**_: object) -> None:
    """Show that this worker lives and recover again and again, in threads of its main process."""
    stopping.withdraw_stop()
    presence = workers.Presence(workers.worker_name(os.getpid()))
    Thread(target=_be_present, args=(presence,), name="presence", daemon=True).start()
    Thread(target=_recover_until_stopped, args=(presence,), name="recover", daemon=True).start()


@worker_shutting_down.connect
def stop_recovering(**_: object) -> None:
    """Begin nothing new; what is under way may end."""
    stopping.request_stop()


# --- Private -----------------------------------------------------------------------------------


def _recover_until_stopped(presence: workers.Presence) -> None:
    """One round at the start, then one every RECOVER_EVERY_S."""
    rounds = workers.RecoveryRounds(lambda at_start: recover(at_start=at_start), presence)
    while not stopping.is_stop_requested():
        rounds.go_on()
        connection.close()
        stopping.wait(settings.RECOVER_EVERY_S)


def _be_present(presence: workers.Presence) -> None:
    """A sign of life at once and every HEARTBEAT_S, until the process ends and says so."""
    ended = Event()

    def end(**_: object) -> None:
        ended.set()
        with workers.Survived() as ending:
            presence.end()
        if ending.fault is not None:
            logger.warning("The end of this worker was not stored: %s", ending.fault)

    worker_shutdown.connect(end, weak=False)
    while not ended.is_set():
        with workers.Survived() as beat:
            presence.beat()
        if beat.fault is not None:
            logger.warning("No sign of life of this worker: %s", beat.fault)
            connection.close()
        ended.wait(settings.HEARTBEAT_S)
    connection.close()


def _lost_after(queue: str) -> timedelta:
    """How old a message in a queue is that must be lost, as its row still waits.

    Where nothing waits in the queue, nothing is on its way.
    """
    if _messages_waiting({queue, QUEUE_BEFORE}):
        return RESEND_AFTER
    return timedelta(seconds=settings.STALE_AFTER_S)


def _messages_waiting(queues: Iterable[str]) -> int:
    """How many messages of these queues no worker has taken yet."""
    with open_broker() as broker:
        declare = broker.default_channel.queue_declare
        return sum(int(declare(queue=name).message_count) for name in queues)
