"""Celery tasks: doors that carry the key of a row, and what brings lost work back.

Rows are the truth. A message may come twice (the lease refuses the second) or never (recover
sends another). Services never enqueue; doors do, by transaction.on_commit. Messages are sent over
a connection that is tried once: where no broker answers, there is a sentence instead of a wait.
"""

import logging
import os
import socket
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from datetime import timedelta
from functools import partial
from threading import Event, Thread
from typing import Any

import redis
from celery import current_app, shared_task
from celery.exceptions import Reject
from celery.signals import worker_ready, worker_shutdown, worker_shutting_down
from django.conf import settings
from django.contrib.auth.models import User
from django.db import connection
from django.db.models import Model, OuterRef, Q, QuerySet, Subquery
from kombu.exceptions import OperationalError

from augment.errors import QueueFault, QueueRefused, QueueUnreachable
from augment.models import Augmentation, BaseScene, GenerationJob, JudgeRun, Scenario, Sweep
from augment.services.benchmarks.submissions import SUBMISSIONS
from augment.services.clock import DATABASE_TIME, Moment
from augment.services.driving.simulations import DRIVES
from augment.services.endpoints.probing import PROBES
from augment.services.judging.analyses import count_unmeasured, measure_job
from augment.services.running import workers
from augment.services.running.intent_readings import READINGS
from augment.services.running.judge_runs import JUDGEMENTS
from augment.services.running.runner import AUGMENTATIONS
from augment.services.scenarios import pictures
from augment.services.scenarios.uploads import MOMENTS, UPLOADS
from augment.services.work import KINDS, WorkKind, register

logger = logging.getLogger(__name__)

RESEND_AFTER = timedelta(minutes=10)
"""A message that waits longer than this may be lost; a second one does no harm."""

QUEUE_BEFORE = "celery"
"""What earlier releases called the queue of everything."""

BATCH = 100
"""So many messages are sent before the rows say so; a crash between sends them twice."""

RECENT_JOBS = 20
"""A worker that starts measures so many jobs anew; older ones wait until somebody looks."""

REFUSALS = (redis.ResponseError, redis.AuthenticationError, redis.BusyLoadingError)
"""What a Redis says that is there and takes no messages: full, read only, loading, locked."""

register(AUGMENTATIONS, DRIVES, JUDGEMENTS, READINGS, PROBES, UPLOADS, MOMENTS, SUBMISSIONS)

DRAWN: dict[str, Callable[[int], object]] = {
    "scene": pictures.draw_scene,
    "scenario": pictures.draw_scenario,
}
"""Pictures of the row with that key, as far as they are not there yet; arena adds charts."""

AFTERWARDS: dict[str, Callable[[int], object]] = {}
"""What else is sent once a row of a kind was worked on; nothing may depend on it."""


@shared_task(name="augment.work", bind=True, acks_late=True, ignore_result=True)
def work(self: Any, kind: str, pk: int) -> None:
    """Work on one row, unless another worker has it or it has an outcome."""
    if workers.stopping.is_set():
        raise Reject("this worker stops", requeue=True)
    worker = f"{self.request.hostname or 'here'} {os.getpid()}"
    KINDS[kind].perform(pk, worker=worker[:120])
    enqueue(KINDS[kind], KINDS[kind].find_unblocked(pk))
    if kind == UPLOADS.name:
        enqueue_moments(pk)
    if kind == AUGMENTATIONS.name:
        # Others of its last rows see it finished as well; one message is enough.
        ended = Augmentation.objects.filter(job=OuterRef("pk")).order_by("-finished_at", "-pk")
        finished = GenerationJob.objects.filter(augmentations=pk)
        with suppress(QueueFault):  # who looks at the job asks again
            enqueue_measures(finished.alias(last=Subquery(ended.values("pk")[:1])).filter(last=pk))
    if kind in AFTERWARDS:
        with suppress(QueueFault):
            AFTERWARDS[kind](pk)


@shared_task(name="augment.draw", acks_late=True, ignore_result=True)
def draw(what: str, pk: int) -> None:
    """Draw what is missing; a second time nothing is left to do."""
    DRAWN[what](pk)


@shared_task(name="augment.measure", acks_late=True, ignore_result=True)
def measure(pk: int) -> None:
    """Measure the rows of a finished job as far as they are not measured yet."""
    job = GenerationJob.objects.filter(pk=pk).first()
    if job is not None:
        measure_job(job)
        with suppress(QueueFault):  # who looks at a chart that is not there draws it
            send(draw, "job", pk)


# --- Sending messages --------------------------------------------------------------------------


@contextmanager
def open_broker(*, within_s: float = 5) -> Iterator[Any]:
    """Open a connection that works, tried once; what breaks inside the block is named as well.

    Args:
        within_s: How long it may take to connect, and to answer.

    Raises:
        QueueUnreachable: No broker.
        QueueRefused: It takes no messages.
    """
    with current_app.connection_for_write() as broker:
        broker.transport_options |= {
            "socket_connect_timeout": within_s,
            "socket_timeout": within_s,
        }
        try:
            broker.ensure_connection(max_retries=1, interval_start=0, timeout=within_s)
            yield broker
        except (OperationalError, redis.RedisError) as error:
            # The password is masked, and the mask is shown even where there is none.
            uri = broker.as_uri()
            address = uri if broker.password else uri.replace(":**@", "")
            cause: BaseException | None = error
            while cause is not None:
                if isinstance(cause, REFUSALS):
                    raise QueueRefused(
                        f"Redis at {address} takes no messages: {str(cause).rstrip('.')}. "
                        "What was queued is kept and runs as soon as Redis takes messages again."
                    ) from error
                cause = cause.__cause__
            raise QueueUnreachable(
                f"No Redis at {address}: start `manage.py serve` or set REDIS_URL. What was "
                "queued is kept and runs as soon as a worker starts."
            ) from error


def check_broker(*, within_s: float = 5) -> None:
    """Raise QueueFault unless a broker can be reached and answers within so many seconds."""
    with open_broker(within_s=within_s):
        pass


def send(task: Any, *arguments: str | int) -> None:
    """Send one message; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses.
    """
    with open_broker() as broker:
        task.apply_async(arguments, connection=broker, retry=False)


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
                    priority=kind.priority,
                    shadow=f"work.{kind.name}",  # in logs
                    connection=broker,
                    retry=False,
                )
            kind.mark_sent(batch)
    return len(waiting)


def sender_of(kind: WorkKind[Any], owner: str) -> Callable[[int], int]:
    """Return a function that sends messages of the rows of one owner that have none; as `enqueue`.

    Args:
        kind: The rows.
        owner: The column, or path, of what they belong to.
    """
    return lambda pk: enqueue(
        kind, kind.find_unsent(older_than=RESEND_AFTER, only=Q(**{owner: pk}))
    )


enqueue_job = sender_of(AUGMENTATIONS, "job")
enqueue_moments = sender_of(MOMENTS, "upload")
SENDERS: dict[type[Model], Callable[[int], object]] = {
    BaseScene: partial(send, draw, "scene"),
    GenerationJob: enqueue_job,
    JudgeRun: sender_of(JUDGEMENTS, "run"),
    Scenario: partial(send, draw, "scenario"),
    Sweep: sender_of(DRIVES, "swept__sweep"),
}
"""What is sent for a row that is no work itself: its work, or that its pictures are drawn."""


def enqueue_row(row: Model) -> None:
    """Send what a new or changed row needs of workers; as `enqueue`."""
    kind = KINDS.get(str(row._meta.model_name))
    if kind is None:
        SENDERS[type(row)](row.pk)
    else:
        enqueue(kind, [row.pk])


enqueue_simulations = partial(enqueue, DRIVES)


def enqueue_measures(jobs: QuerySet[GenerationJob]) -> None:
    """Have those of the jobs measured that are finished and not measured yet; as `enqueue`."""
    finished = jobs.filter(state=GenerationJob.State.FINISHED).order_by("-pk")
    for job in finished[:RECENT_JOBS]:
        if count_unmeasured(job):
            send(measure, job.pk)


enqueue_measure = partial(send, measure)


# --- Recovering lost work ----------------------------------------------------------------------


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
        try:
            kind.take_back_lost(now=now)
            kind.cleanup(now)
        except Exception:  # one kind's fault leaves the others their work
            logger.exception("Could not take back lost work of %s.", kind.model.__name__)
    queues = {kind.queue for kind in KINDS.values()}
    ages = {queue: timedelta(0) if at_start else _lost_after(queue) for queue in queues}
    for kind in KINDS.values():
        enqueue(kind, kind.find_unsent(now=now, older_than=ages[kind.queue]))
    if at_start:
        enqueue_measures(GenerationJob.objects.all())


@worker_ready.connect
def start_recovering(**_: object) -> None:
    """Show that this worker lives and recover again and again, in threads of its main process."""
    workers.stopping.clear()
    presence = workers.Presence(f"{socket.gethostname()} {os.getpid()}"[:120])
    Thread(target=_be_present, args=(presence,), name="presence", daemon=True).start()
    Thread(target=_recover_until_stopped, args=(presence,), name="recover", daemon=True).start()


@worker_shutting_down.connect
def stop_recovering(**_: object) -> None:
    """Begin nothing new; what is under way may end."""
    workers.stopping.set()


# --- Private -----------------------------------------------------------------------------------


def _recover_until_stopped(presence: workers.Presence) -> None:
    """Do one round at the start, then one every RECOVER_EVERY_S."""
    at_start = True
    while not workers.stopping.is_set():
        if workers.do_round(partial(recover, at_start=at_start), presence):
            at_start = False
        connection.close()
        workers.stopping.wait(settings.RECOVER_EVERY_S)


def _be_present(presence: workers.Presence) -> None:
    """Give a sign of life at once and every HEARTBEAT_S, until the process ends and says so."""
    ended = Event()

    def end(**_: object) -> None:
        ended.set()
        workers.survive(presence.end, "The end of this worker was not stored")

    worker_shutdown.connect(end, weak=False)
    while not ended.is_set():
        if not workers.survive(presence.beat, "No sign of life of this worker"):
            connection.close()
        ended.wait(settings.HEARTBEAT_S)
    connection.close()


def _lost_after(queue: str) -> timedelta:
    """Return how old a message in a queue is that must be lost, as its row still waits.

    Where nothing waits in the queue, nothing is on its way.
    """
    with open_broker() as broker:
        declare = broker.default_channel.queue_declare
        waiting = [int(declare(queue=name).message_count) for name in (queue, QUEUE_BEFORE)]
    return RESEND_AFTER if any(waiting) else timedelta(seconds=settings.STALE_AFTER_S)


@shared_task(name="arena.draw_checks", acks_late=True, ignore_result=True)
def draw_checks(actor_pk: int) -> None:
    """Draw the attention checks that scenarios with a reference lack; again, none is left."""
    slugs = list(Scenario.objects.exclude(reference=None).values_list("slug", flat=True))
    pictures.draw_checks(scenarios=slugs, actor=User.objects.filter(pk=actor_pk).first())


def send_checks(actor_pk: int) -> None:
    """Ask a worker to draw attention checks; for transaction.on_commit.

    Raises:
        QueueFault: No broker, or it refuses; nothing is drawn until somebody asks again.
    """
    send(draw_checks, actor_pk)
