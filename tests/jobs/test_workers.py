"""Signs of life of workers, and what brings lost work back whatever happens."""

import shutil
import tempfile
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest
import redis
from celery import current_app
from django.db import OperationalError

from arena.serving.probes import find_redis_server, redis_answers
from augment import tasks
from augment.errors import QueueRefused, QueueUnreachable
from augment.models import Worker
from augment.services.benchmarks.submissions import SUBMISSIONS
from augment.services.clock import DATABASE_TIME
from augment.services.driving.simulations import DRIVES
from augment.services.endpoints.probing import PROBES
from augment.services.running.runner import AUGMENTATIONS
from augment.services.running.workers import Presence, do_round, workforce
from tests.jobs.rows import launch, only_row
from tests.processes import Process, wait_until

pytestmark = pytest.mark.django_db


def living(name: str = "here 1") -> Worker:
    presence = Presence(name)
    presence.record_recovery()
    return Worker.objects.get(name=name)


def long_ago(worker: Worker, column: str, seconds: float) -> None:
    when = DATABASE_TIME - timedelta(seconds=seconds)
    Worker.objects.filter(pk=worker.pk).update(**{column: when})
    worker.refresh_from_db()


# --- Who lives -----------------------------------------------------------------------------------


@pytest.mark.parametrize(("silent_s", "count"), [(0, 1), (15, 1), (25, 0)])
def test_a_worker_silent_too_long_is_dead_since_its_last_word(silent_s: float, count: int) -> None:
    worker = living()
    long_ago(worker, "seen_at", silent_s)
    found = workforce()
    assert found.living == count
    assert found.silent_since == (None if count else worker.seen_at)


# --- Bringing lost work back ---------------------------------------------------------------------


@pytest.mark.parametrize(
    "fault",
    [
        QueueRefused("Redis at redis://here/0 takes no messages: OOM."),
        OperationalError("database is locked"),
        KeyError("nobody foresaw this"),
        MemoryError(),
    ],
)
def test_faults_are_told_and_end_nothing(
    fault: Exception, caplog: pytest.LogCaptureFixture
) -> None:
    def fail() -> None:
        raise fault

    presence = Presence("here 1")
    assert not do_round(fail, presence)
    assert "Could not bring lost work back" in caplog.messages[0]
    assert workforce().fault == (str(fault) or "MemoryError")
    assert do_round(lambda: None, presence)
    assert workforce().works


# --- A Redis that is there and refuses -----------------------------------------------------------


@pytest.fixture
def refusing(request: pytest.FixtureRequest) -> Iterator[str]:
    """A Redis that takes nothing any more: its memory is full, or it is a replica."""
    folder = Path(tempfile.mkdtemp(prefix="arena-"))  # a socket's path has 108 bytes
    socket = folder / "redis.sock"
    process = Process(
        [
            *(str(find_redis_server()), "--port", "0", "--unixsocket", str(socket)),
            *("--save", "", "--dir", str(folder)),
        ],
        environment={},
        log=folder / "redis.log",
    )
    before = current_app.conf.broker_url
    try:
        wait_until(
            lambda: redis_answers(f"unix://{socket}"), what=process.said() or "Redis answers"
        )
        client: Any = redis.Redis(unix_socket_path=str(socket))
        client.execute_command(*request.param)
        client.close()
        current_app.conf.broker_url = f"redis+socket://{socket}"
        yield str(socket)
    finally:
        current_app.conf.broker_url = before
        process.stop()
        shutil.rmtree(folder)


FULL = ("CONFIG", "SET", "maxmemory", "1")
READ_ONLY = ("REPLICAOF", "127.0.0.1", "1")


@pytest.mark.redis
@pytest.mark.parametrize(
    ("refusing", "says"),
    [(FULL, "command not allowed"), (READ_ONLY, "read only replica")],
    indirect=["refusing"],
)
def test_a_redis_that_refuses_is_not_called_missing(refusing: str, says: str) -> None:
    job = launch()
    with pytest.raises(QueueRefused, match=rf"Redis at .* takes no messages: .*{says}") as caught:
        tasks.enqueue_job(job.pk)
    assert not isinstance(caught.value, QueueUnreachable)
    assert "No Redis" not in str(caught.value)
    assert only_row(job).sent_at is None
    assert not do_round(tasks.recover, Presence("here 1"))
    assert says in workforce().fault


@pytest.mark.redis
@pytest.mark.parametrize("refusing", [("PING",)], indirect=True)
def test_what_somebody_waits_for_is_taken_before_drives_and_jobs(refusing: str) -> None:
    for kind in (DRIVES, SUBMISSIONS, AUGMENTATIONS, PROBES):
        tasks.enqueue(kind, [1])
    with current_app.connection_for_write() as broker:
        for queue, *taken in (
            ("drawing", "submission", "simulation"),
            ("models", "probe", "augmentation"),
        ):
            messages = broker.SimpleQueue(queue)
            assert [messages.get(block=False).payload[0][0] for _ in taken] == taken
