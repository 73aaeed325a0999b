"""A job while everything around it breaks: `python -m bench.outages [--kills N]`.

Two hosts that share no folder work on 200 augmentations (50 scenarios, four contestants, two of
them the stand-in language model over HTTP) with PostgreSQL, Redis over TCP and a bucket.
Meanwhile workers are killed with `kill -9` one after the other, Redis is killed and comes back
empty, PostgreSQL is restarted, and the bucket is gone for a while. At the end every row must have
exactly one outcome, nothing may be charged twice, and the cap must never have been passed.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from argparse import ArgumentParser
from collections import Counter
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field

from psycopg import Error

from bench.call_overhead import stand_in
from tests.hosts import Host, Services, services
from tests.processes import Process, wait_until

CONTESTANTS = ("reference", "rule-placer", "sim-otm", "sim-tqa")
CAP_CALLS = 600
RETRY = (
    "from augment.models import GenerationJob; from augment.services.running import jobs; "
    "from augment.tasks import enqueue_job; job = GenerationJob.objects.get(); "
    "enqueue_job(jobs.retry_failed(job).pk)"
)
BUCKET_GONE_S = 6.0
ROWS = "SELECT COUNT(*) FROM augment_augmentation"
USED = "SELECT reserved_calls + spent_calls FROM augment_generationjob"


@dataclass(slots=True)
class Watch:
    """Looks again and again, from outside, at what the job says it has used."""

    host: Host
    most_calls: int = 0
    looks: int = 0
    _over: threading.Event = field(default_factory=threading.Event)

    def look_on(self) -> None:
        while not self._over.wait(0.1):
            try:
                used = self.host.rows(USED)
            except Error:  # PostgreSQL is being restarted
                continue
            self.looks += 1
            self.most_calls = max(self.most_calls, *(calls for (calls,) in used))

    def stop(self) -> None:
        self._over.set()


def main() -> int:
    """Print what happened and each check; 1 if one does not hold."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=10)
    given = parser.parse_args()
    before, began = os.getloadavg()[0], time.perf_counter()
    with ExitStack() as opened:
        around = opened.enter_context(services())
        clerk = around.host("clerk")
        clerk.must_all(("migrate", "--verbosity", "0"), ("load_catalogue",))
        _add_contestants(clerk, opened.enter_context(stand_in(clerk.environment)))
        watch = Watch(clerk)
        looking = threading.Thread(target=watch.look_on, daemon=True)
        workers = {name: around.host(name) for name in ("first", "second")}
        running = {name: host.worker(concurrency=4) for name, host in workers.items()}
        try:
            clerk.must(
                *("generate", "--contestants", *CONTESTANTS, "--scenarios", "paper"),
                *("--name", "outages", "--cap-calls", str(CAP_CALLS)),
            )
            looking.start()
            _break_everything(around, clerk, workers, running, kills=given.kills)
            wait_until(lambda: not _left(clerk), what="all rows have an outcome", within_s=900)
            _tell_failures(clerk)
            clerk.must("shell", "--verbosity", "0", "-c", RETRY)
            wait_until(lambda: not _left(clerk), what="retried rows are done", within_s=900)
        finally:
            watch.stop()
            for worker in running.values():
                worker.stop()
        looking.join()
        took_s = time.perf_counter() - began
        print(f"{took_s:.0f} s, load average before {before:.1f}, {os.cpu_count()} cores\n")
        return _report(clerk, around, watch)


# --- Private -----------------------------------------------------------------------------------


def _add_contestants(clerk: Host, base_url: str) -> None:
    clerk.must_all(
        *(
            (
                *("add_contestant", slug, "--variant", variant, "--endpoint", "bench"),
                *("--model", "fake-good"),
                *(("--base-url", base_url, "--simulated") if variant == "otm" else ()),
            )
            for slug, variant in (("sim-otm", "otm"), ("sim-tqa", "tqa"))
        ),
        ("probe_endpoint", "bench", "--model", "fake-good", "--sees", "yes"),
    )


def _tell_failures(clerk: Host) -> None:
    """What the bucket's absence cost; one line a reason."""
    reasons = "SELECT reason, COUNT(*) FROM augment_augmentation WHERE state = 'failed' GROUP BY 1"
    for reason, count in clerk.rows(reasons):
        print(f"failed {count} times: {reason}")
    print("all of them are retried", flush=True)


def _left(clerk: Host) -> int:
    try:
        ((count,),) = clerk.rows(f"{ROWS} WHERE state IN ('queued', 'running')")
    except Error:
        return -1
    return int(count)


def _break_everything(
    around: Services,
    clerk: Host,
    workers: dict[str, Host],
    running: dict[str, Process],
    *,
    kills: int,
) -> None:
    """One kill after each equal share of the work, and the other outages between them."""
    between: dict[int, tuple[str, Callable[[], None]]] = {
        kills * 2 // 10: ("Redis is killed and comes back empty", lambda: _empty_redis(around)),
        kills * 5 // 10: ("PostgreSQL is restarted", around.restart_postgres),
        kills * 8 // 10: ("the bucket is gone for a while", lambda: _lose_bucket(around)),
    }
    total = _left(clerk)
    for number in range(kills):
        share = total - total * (number + 1) // (kills + 1)
        wait_until(lambda at=share: 0 <= _left(clerk) <= at, what="some are done", within_s=900)  # type: ignore[misc]
        if number in between:
            name, happen = between[number]
            print(f"with {_left(clerk)} of {total} left {name}", flush=True)
            happen()
        name = ("first", "second")[number % 2]
        running[name].kill()
        print(f"kill -9 of the {name} worker", flush=True)
        running[name] = workers[name].worker(concurrency=4)


def _empty_redis(around: Services) -> None:
    around.kill_redis()
    time.sleep(1)
    around.start_redis()


def _lose_bucket(around: Services) -> None:
    around.bucket.stop()
    time.sleep(BUCKET_GONE_S)
    around.bucket.start()


def _report(clerk: Host, around: Services, watch: Watch) -> int:
    states = Counter(
        dict(clerk.rows("SELECT state, COUNT(*) FROM augment_augmentation GROUP BY 1"))
    )
    ended = Counter(dict(clerk.rows("SELECT outcome, COUNT(*) FROM augment_attempt GROUP BY 1")))
    print(f"rows: {dict(states)}; attempts: {dict(ended)}")
    checks = {name: clerk.rows(query) for name, query in MUST_BE_EMPTY.items()}
    kept = {name.removeprefix("arena/") for name in around.bucket.names()}
    images = {name for (name,) in clerk.rows("SELECT image FROM augment_augmentation") if name}
    checks["pictures that are not in the bucket"] = [(name,) for name in sorted(images - kept)]
    print("| check | exceptions |\n|---|---|")
    for name, exceptions in checks.items():
        print(f"| {name} | {len(exceptions)} {exceptions[:3] or ''} |")
    print(
        f"| calls reserved or spent, at most, in {watch.looks} looks (cap {CAP_CALLS}) "
        f"| {watch.most_calls} |"
    )
    return int(any(checks.values()) or watch.most_calls > CAP_CALLS or not watch.looks)


_ENDS = "('done', 'refused', 'unreadable', 'failed')"
MUST_BE_EMPTY = {
    "rows without an outcome": f"SELECT id FROM augment_augmentation WHERE state NOT IN {_ENDS}",
    "rows whose attempts have not exactly one outcome, retried failures apart": (
        "SELECT a.id FROM augment_augmentation a "
        "JOIN augment_attempt t ON t.augmentation_id = a.id WHERE t.outcome <> 'failed' "
        f"GROUP BY a.id HAVING SUM(CASE WHEN t.outcome IN {_ENDS} THEN 1 ELSE 0 END) <> 1"
    ),
    "attempts that failed without a reason": (
        "SELECT id FROM augment_attempt WHERE outcome = 'failed' AND reason = ''"
    ),
    "done rows without a picture": (
        "SELECT id FROM augment_augmentation WHERE state = 'done' AND image = ''"
    ),
    "requests of one row that were answered twice": (
        "SELECT t.augmentation_id, c.request_hash FROM augment_modelcall c "
        "JOIN augment_attempt t ON c.attempt_id = t.id WHERE c.answer IS NOT NULL "
        "AND c.served_from_id IS NULL "
        "GROUP BY 1, 2, c.number HAVING COUNT(*) > 1"
    ),
    "jobs with something still reserved": (
        "SELECT id FROM augment_generationjob WHERE reserved_calls + reserved_tokens <> 0"
    ),
    "jobs that were charged another sum than their calls": (
        "SELECT j.id, j.spent_calls, j.spent_tokens, COUNT(c.id), SUM(c.spent_tokens) "
        "FROM augment_generationjob j JOIN augment_augmentation a ON a.job_id = j.id "
        "JOIN augment_attempt t ON t.augmentation_id = a.id "
        "JOIN augment_modelcall c ON c.attempt_id = t.id WHERE c.spent_tokens IS NOT NULL "
        "GROUP BY j.id HAVING j.spent_tokens <> SUM(c.spent_tokens)"
    ),
}


if __name__ == "__main__":
    sys.exit(main())
