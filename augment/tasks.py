"""Celery tasks of augment: doors that carry one id, and what brings lost work back.

Rows are the truth. A message may come twice (the lease refuses the second) or never (recover
sends another). Services never enqueue; doors call `enqueue_job` by transaction.on_commit.
"""

from __future__ import annotations

import logging
import os
from collections.abc import Iterable
from datetime import timedelta
from threading import Event, Thread
from typing import Any

from celery import current_app, shared_task
from celery.exceptions import Reject
from celery.signals import worker_ready, worker_shutdown, worker_shutting_down
from django.conf import settings
from django.db import connection

from augment import scene_tasks
from augment.broker import open_broker, send
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.endpoints import probing
from augment.services.judging import marked_pictures, simulations
from augment.services.running import (
    intent_readings,
    jobs,
    leases,
    runner,
    stopping,
    workers,
)

logger = logging.getLogger(__name__)

RESEND_AFTER = timedelta(minutes=10)
"""A message that waits longer than this may be lost; a second one does no harm."""

QUEUE_BEFORE = "celery"
"""What earlier releases called the queue of everything."""

BATCH = 100
"""So many messages are sent before the rows say so; a crash between sends them twice."""


@shared_task(name="augment.run_augmentation", bind=True, acks_late=True, ignore_result=True)
def run_augmentation(self: Any, augmentation_pk: int) -> None:
    """Run one row, unless somebody else has it or it has an outcome."""
    if stopping.is_stop_requested():
        raise Reject("this worker stops", requeue=True)
    worker = f"{self.request.hostname or 'here'} {os.getpid()}"
    runner.work_on(augmentation_pk=augmentation_pk, worker=worker[:120])


@shared_task(name="augment.draw_marks", ignore_result=True)
def draw_marks(augmentation_pk: int) -> None:
    """Draw the faults that the checks find in one row; a second time nothing is left to do."""
    marked_pictures.draw_marked(augmentation_pk=augmentation_pk)


@shared_task(name="augment.run_simulation", acks_late=True, ignore_result=True)
def run_simulation(simulation_pk: int) -> None:
    """Drive one row, unless somebody else has it or it has an outcome."""
    if stopping.is_stop_requested():
        raise Reject("this worker stops", requeue=True)
    simulations.drive(simulation_pk=simulation_pk)


@shared_task(name="augment.read_intent", acks_late=True, ignore_result=True)
def read_intent(reading_pk: int) -> None:
    """Have a model read an instruction, unless somebody has done so for this row."""
    if stopping.is_stop_requested():
        raise Reject("this worker stops", requeue=True)
    intent_readings.read_planned(reading_pk)


@shared_task(name="augment.make_probe", acks_late=True, ignore_result=True)
def make_probe(probe_pk: int) -> None:
    """Ask a model what it can do, unless somebody has done so for this row."""
    if stopping.is_stop_requested():
        raise Reject("this worker stops", requeue=True)
    probing.make_probe(probe_pk)


def enqueue_probe(probe_pk: int) -> None:
    """Have a model probed; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the probe fails after a while.
    """
    with open_broker() as broker:
        make_probe.apply_async((probe_pk,), connection=broker, retry=False)


def enqueue_reading(reading_pk: int) -> None:
    """Have an instruction read; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the reading fails after a while.
    """
    send(read_intent, reading_pk)


def enqueue_simulations(ids: Iterable[int]) -> None:
    """Have drives driven and remember when; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the rows wait on and are sent by recover later.
    """
    waiting = list(ids)
    if not waiting:
        return
    with open_broker() as broker:
        for start in range(0, len(waiting), BATCH):
            batch = waiting[start : start + BATCH]
            for pk in batch:
                run_simulation.apply_async((pk,), connection=broker, retry=False)
            simulations.mark_sent(batch)


def enqueue_marks(augmentation_pk: int) -> None:
    """Have a row's faults drawn; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    send(draw_marks, augmentation_pk)


def enqueue(ids: Iterable[int]) -> int:
    """Send one message per row and remember when.

    Returns:
        How many were sent.

    Raises:
        QueueFault: No broker, or it refuses; the rows wait on and are sent by recover later.
    """
    waiting = list(ids)
    if not waiting:
        return 0
    with open_broker() as broker:
        for start in range(0, len(waiting), BATCH):
            batch = waiting[start : start + BATCH]
            for pk in batch:
                run_augmentation.apply_async((pk,), connection=broker, retry=False)
            leases.mark_sent(ids=batch)
    return len(waiting)


def enqueue_job(job_pk: int) -> int:
    """Send the messages of a job's rows that have none yet; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; the rows wait on and are sent by recover later.
    """
    return enqueue(leases.find_unsent(older_than=RESEND_AFTER, job_pk=job_pk))


def recover(*, now: Moment = DATABASE_TIME, at_start: bool = False) -> None:
    """Take back what dead workers held, finish what is over and send what has no message.

    Args:
        now: The time; the database's, for no worker's clock may take work away.
        at_start: Whether every waiting row gets a message, however new its last one: the broker
            may have been started anew together with this worker.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    stale_after = timedelta(seconds=settings.STALE_AFTER_S)
    leases.take_back_stale(now=now, older_than=stale_after)
    jobs.finish_if_over(now=now)
    intent_readings.give_up_stale(now=now)
    probing.give_up_stale(now=now)
    lost_after = timedelta(0) if at_start else _lost_after(run_augmentation)
    enqueue(leases.find_unsent(now=now, older_than=lost_after))
    simulations.requeue_stale(now=now, older_than=stale_after)
    lost_after = timedelta(0) if at_start else _lost_after(run_simulation)
    enqueue_simulations(simulations.find_unsent(now=now, older_than=lost_after))
    scene_tasks.resend_lost(now=now)


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


def _lost_after(task: Any) -> timedelta:
    """How old a message of a task is that must be lost, as its row still waits.

    Where nothing waits in its queue, nothing is on its way.
    """
    queue = current_app.amqp.router.route({}, task.name)["queue"].name
    if _messages_waiting({queue, QUEUE_BEFORE}):
        return RESEND_AFTER
    return timedelta(seconds=settings.STALE_AFTER_S)


def _messages_waiting(queues: Iterable[str]) -> int:
    """How many messages of these queues no worker has taken yet."""
    with open_broker() as broker:
        declare = broker.default_channel.queue_declare
        return sum(int(declare(queue=name).message_count) for name in queues)
