"""Workers that do nothing but keep the books of one job: `... contention WORKERS ROWS`.

Run by bench.hosts in an installation on PostgreSQL. Every worker is a thread with a
connection of its own, in eight processes at most: takes a row, reserves, stores, sends and settles
one call, writes the outcome, looks whether the job is over. Prints rows per second, then in
milliseconds median, 95th percentile and maximum of the statements that lock the job's row, and
median and 95th percentile of what one row takes.
"""

from __future__ import annotations

import json
import statistics
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import django

PROCESSES = 8
LOCKS_THE_JOB = ('UPDATE "augment_generationjob"', "FOR UPDATE")


def main(workers: int, rows: int) -> None:
    """Make the job, let the processes work on it together and print what they measured."""
    keys = _waiting(_launched(f"{workers} workers"), rows)
    processes = min(PROCESSES, workers)
    started = [
        subprocess.Popen(
            [
                sys.executable,
                "-m",
                "bench.contention",
                "share",
                str(workers // processes),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        for _ in range(processes)
    ]
    for one in started:  # all are ready before any begins
        assert one.stdout is not None
        assert one.stdout.readline() == "ready\n"
    began = time.perf_counter()
    for number, one in enumerate(started):
        assert one.stdin is not None
        one.stdin.write(json.dumps(keys[number::processes]) + "\n")
        one.stdin.flush()
    told = [json.loads(one.communicate()[0]) for one in started]
    took_s = time.perf_counter() - began
    locks = sorted(ms for share in told for ms in share["locks"])
    each = sorted(ms for share in told for ms in share["rows"])
    assert len(each) == rows, f"{len(each)} of {rows} rows were done"
    print(
        rows / took_s,
        *(statistics.median(locks), locks[int(0.95 * len(locks))], locks[-1]),
        *(statistics.median(each), each[int(0.95 * len(each))]),
    )


# --- Private -----------------------------------------------------------------------------------


def _launched(name: str) -> Any:
    """A job of one model on one scenario, in an installation that may have had others."""
    from augment.models import Contestant
    from augment.services.running import jobs
    from tests.jobs.models import llama_job

    if not Contestant.objects.filter(slug="llama").exists():
        llama_job()
    return jobs.launch(name=name, contestants=["llama"], scenarios=["street-1"])


def _waiting(job: Any, rows: int) -> list[int]:
    """So many waiting rows of the job, as samples of one scenario."""
    from augment.models import Augmentation

    first = job.augmentations.get()
    Augmentation.objects.bulk_create(
        Augmentation(job=job, scenario=first.scenario, contestant=first.contestant, sample=number)
        for number in range(2, rows + 1)
    )
    return list(job.augmentations.order_by("pk").values_list("pk", flat=True))


def _share(threads: int) -> None:
    """One process: connects, says that it is ready, works off the rows that it is told."""
    from django.db import connection

    locks: list[float] = []
    rows: list[float] = []
    connected = threading.Barrier(threads + 1)
    keys: list[int] = []
    told = threading.Event()

    def work(number: int) -> None:
        connection.ensure_connection()
        connected.wait()
        told.wait()
        with _timed(locks):
            for pk in keys[number::threads]:
                began = time.perf_counter()
                _keep_books(pk)
                rows.append(1e3 * (time.perf_counter() - began))
        connection.close()

    workers = [threading.Thread(target=work, args=(number,)) for number in range(threads)]
    for worker in workers:
        worker.start()
    connected.wait()
    print("ready", flush=True)
    keys += json.loads(sys.stdin.readline())
    told.set()
    for worker in workers:
        worker.join()
    print(json.dumps({"locks": locks, "rows": rows}))


@contextmanager
def _timed(locks: list[float]) -> Iterator[None]:
    """Milliseconds of every statement that waits for the job's row."""
    from django.db import connection

    def watch(execute: Any, sql: str, params: Any, many: bool, context: Any) -> Any:
        if not ("augment_generationjob" in sql and any(sign in sql for sign in LOCKS_THE_JOB)):
            return execute(sql, params, many, context)
        began = time.perf_counter()
        try:
            return execute(sql, params, many, context)
        finally:
            locks.append(1e3 * (time.perf_counter() - began))

    with connection.execute_wrapper(watch):
        yield


def _keep_books(pk: int) -> None:
    from augment.llm.messages import Message, Request, Speaker
    from augment.models import Augmentation
    from augment.services.running import jobs, leases
    from augment.services.running.transcripts import RowTranscript
    from augment.variants.transcript import ModelRole
    from tests.jobs.models import MODEL, reply
    from tests.jobs.rows import failed

    held = leases.take_lease(augmentation_pk=pk, worker="here")
    assert held is not None
    row = Augmentation.objects.select_related("job", "contestant__endpoint").get(pk=pk)
    assert row.contestant.endpoint is not None
    request = Request(
        model=MODEL, messages=(Message(speaker=Speaker.USER, text="Park a car. " * 500),)
    )
    transcript = RowTranscript(held, row, row.contestant.endpoint)
    number = transcript.asked(ModelRole.MODIFIER, request, "1")
    transcript.sending(number)
    transcript.answered(number, reply())
    leases.settle(held=held, settlement=failed())
    jobs.finish_if_over(job_pk=row.job_id)


if __name__ == "__main__":
    django.setup()
    if sys.argv[1] == "share":
        _share(int(sys.argv[2]))
    else:
        main(int(sys.argv[1]), int(sys.argv[2]))
