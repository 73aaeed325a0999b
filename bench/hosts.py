"""What more hosts bring, and what they wait for: `python -m bench.hosts`.

    python -m bench.hosts [--rounds N] [--only drawing|contention]

PostgreSQL, Redis over TCP and a bucket, as several machines have them; no folder is shared.
Drawing: the rule placer on the catalogue, whose work is drawing, by 1, 2 and 4 hosts with one
worker each. Contention: threads with a connection of their own take and settle the rows of one
job and reserve and settle a call for each, with nothing between: far more often than any model
answers. What the job's row keeps waiting is what a statement on it takes.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import time
from argparse import ArgumentParser
from contextlib import ExitStack

from tests.hosts import Host, Services, services
from tests.processes import ROOT, wait_until

HOSTS = (1, 2, 4)
WORKERS = (1, 8, 16, 64)
ROWS = 640
ENDED = "SELECT COUNT(*) FROM augment_augmentation WHERE job_id = {job} AND state <> 'queued'"
TOOK = (
    "SELECT COUNT(*), EXTRACT(EPOCH FROM MAX(t.finished_at) - MIN(t.started_at)) "
    "FROM augment_attempt t JOIN augment_augmentation a ON t.augmentation_id = a.id "
    "WHERE a.job_id = {job} AND t.outcome IN ('done', 'refused')"
)


def main() -> None:
    """Print both tables."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", choices=["drawing", "contention"])
    given = parser.parse_args()
    before = os.getloadavg()[0]
    with services() as around:
        clerk = around.host("clerk")
        clerk.must_all(("migrate", "--verbosity", "0"), ("load_catalogue",))
        print(f"{os.cpu_count()} cores, load average before {before:.1f}")
        if given.only != "contention":
            _print_drawing(around, clerk, given.rounds)
        if given.only != "drawing":
            _print_contention(clerk, given.rounds)


# --- Private -----------------------------------------------------------------------------------


def _print_drawing(around: Services, clerk: Host, rounds: int) -> None:
    print("\n| hosts | pictures per second | times one host |\n|---|---|---|")
    alone = 0.0
    for count in HOSTS:
        rate = statistics.median(
            _drawn_per_second(around, clerk, count, f"{count}-{number}")
            for number in range(rounds)
        )
        alone = alone or rate
        print(f"| {count} | {rate:.1f} | {rate / alone:.2f} |", flush=True)


def _drawn_per_second(around: Services, clerk: Host, count: int, name: str) -> float:
    """From the first claim to the last outcome; every picture is drawn anew."""
    around.bucket.clear()
    with ExitStack() as opened:
        for number in range(count):
            worker = around.host(f"host-{name}-{number}").worker(pool="prefork", concurrency=1)
            opened.callback(worker.stop)
        clerk.must(
            *("generate", "--contestants", "rule-placer", "--scenarios", "catalogue"),
            *("--name", name, "--fresh"),
        )
        ((job,),) = clerk.rows(f"SELECT id FROM augment_generationjob WHERE name = '{name}'")
        left = (
            "SELECT COUNT(*) FROM augment_augmentation "
            f"WHERE job_id = {job} AND state IN ('queued', 'running')"
        )
        wait_until(lambda: clerk.rows(left) == [(0,)], what="all are drawn", within_s=600)
    ((drawn, took_s),) = clerk.rows(TOOK.format(job=job))
    return int(drawn) / float(took_s)


def _print_contention(clerk: Host, rounds: int) -> None:
    print(
        "\n| workers | rows/s | waited for a statement on the job: median | p95 | max "
        "| for the end of a row: median | p95 |\n|---|---|---|---|---|---|---|"
    )
    for count in WORKERS:
        runs = [_contended(clerk, count) for _ in range(rounds)]
        middle = [statistics.median(column) for column in zip(*runs, strict=True)]
        rate, *waits = middle
        print(f"| {count} | {rate:.0f} | " + " | ".join(f"{one:.1f} ms" for one in waits) + " |")


def _contended(clerk: Host, count: int) -> list[float]:
    """In a process of its own, whose threads are the workers."""
    said = subprocess.run(
        [sys.executable, "-m", "bench.contention", str(count), str(ROWS)],
        cwd=ROOT,
        env=clerk.environment | {"DJANGO_SETTINGS_MODULE": "arena.config.settings"},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    ).stdout
    return [float(number) for number in said.split()]


if __name__ == "__main__":
    began = time.monotonic()
    main()
    print(f"\n{time.monotonic() - began:.0f} s")
