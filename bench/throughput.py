"""Augmentations per second over the whole catalogue: `python -m bench.throughput`.

    python -m bench.throughput [ROUNDS] [--concurrency N] [--pool threads|prefork]

Everything is real: a new installation in every round, its Redis, a worker, the stand-in language
model behind HTTP, SQLite, pictures on disk. Each contestant runs all 50 scenarios in a job of its
own that asks everything anew, and every phase is reported.
"""

from __future__ import annotations

import os
import statistics
import time
from argparse import ArgumentParser
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime

from bench.call_overhead import stand_in
from tests.processes import Machine, machine, wait_until

ROUNDS = 3
CONTESTANTS = (
    ("rule-placer", ""),
    ("sim-otm", "otm"),
    ("sim-fc", "fc"),
    ("sim-tqa", "tqa"),
    ("sim-vqa", "vqa"),
)
MODEL = "fake-good"
_USUAL = {"ARENA_HEARTBEAT_S": "5", "ARENA_STALE_AFTER_S": "20", "ARENA_RECOVER_EVERY_S": "30"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """One job.

    Attributes:
        done: Rows with a modification; the others were refused, which is quicker.
        queued_s: From the job's row to the last message sent.
        worked_s: From the first claim to the last outcome.
        each_ms: Median from claim to outcome.
        calls_ms: Median of the calls' own latencies, None without any.
    """

    rows: int
    done: int
    calls: int
    queued_s: float
    worked_s: float
    each_ms: float
    calls_ms: float | None

    @property
    def per_second(self) -> float:
        return self.rows / self.worked_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """One installation, from nothing to all jobs done."""

    phases_s: dict[str, float]
    runs: dict[str, Run]


def measured(concurrency: int, pool: str) -> Round:
    """One round."""
    phases: dict[str, float] = {}
    with _timed(phases, "migrate an empty database"):
        opened = machine(_USUAL)
        made = opened.__enter__()
    try:
        with _timed(phases, "start Redis"):
            redis = made.redis()
        with _timed(phases, "start the stand-in"):
            served = stand_in()
            base_url = served.__enter__()
        try:
            with _timed(phases, "load the catalogue"):
                made.must("load_catalogue")
            with _timed(phases, "add four contestants"):
                _add_contestants(made, base_url)
            with _timed(phases, "start the worker"):
                worker = made.worker(pool=pool, concurrency=concurrency)
            runs = {slug: _run(made, slug, phases) for slug, _ in CONTESTANTS}
            worker.stop()
        finally:
            served.__exit__(None, None, None)
            redis.stop()
    finally:
        opened.__exit__(None, None, None)
    return Round(phases_s=phases, runs=runs)


def main() -> None:
    """Print both tables."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument("rounds", nargs="?", type=int, default=ROUNDS)
    parser.add_argument("--concurrency", type=int, default=4)
    parser.add_argument("--pool", choices=["threads", "prefork"], default="threads")
    given = parser.parse_args()
    before = os.getloadavg()[0]
    rounds = [measured(given.concurrency, given.pool) for _ in range(given.rounds)]
    print(
        f"{given.rounds} rounds, medians; pool {given.pool}, concurrency {given.concurrency}; "
        f"{os.cpu_count()} cores, load average before {before:.1f}"
    )
    _print_runs(rounds)
    _print_phases(rounds)


# --- Private -----------------------------------------------------------------------------------


@contextmanager
def _timed(phases: dict[str, float], name: str) -> Iterator[None]:
    began = time.perf_counter()
    yield
    phases[name] = time.perf_counter() - began


def _add_contestants(made: Machine, base_url: str) -> None:
    for slug, variant in CONTESTANTS:
        if variant:
            new = ("--base-url", base_url, "--simulated") if variant == "otm" else ()
            made.must(
                *("add_contestant", slug, "--variant", variant),
                *("--endpoint", "bench", "--model", MODEL, *new),
            )
    made.must("probe_endpoint", "bench", "--model", MODEL, "--sees", "yes")
    # More places than the worker can ask for: the queue at the endpoint is not what is measured.
    made.must("shell", "-c", _WIDE)


_WIDE = (
    "from augment.models import Endpoint; "
    "Endpoint.objects.update(max_concurrency=64, requests_per_minute=None)"
)


def _run(made: Machine, slug: str, phases: dict[str, float]) -> Run:
    """One contestant on the whole catalogue; no row may fail."""
    with _timed(phases, f"generate {slug}, with start-up and waiting"):
        said = made.must(
            *("generate", "--contestants", slug, "--scenarios", "catalogue"),
            *("--name", slug, "--fresh", "--wait"),
        )
    wait_until(
        lambda: bool(made.rows(f"SELECT 1 FROM {_JOB} WHERE name = '{slug}' AND finished_at > 0")),
        what="the job is finished",
    )
    ((created,),) = made.rows(f"SELECT created_at FROM {_JOB} WHERE name = '{slug}'")
    attempts = (
        f"augment_attempt t JOIN augment_augmentation a ON t.augmentation_id = a.id "
        f"JOIN {_JOB} j ON a.job_id = j.id"
    )
    only = f"WHERE j.name = '{slug}'"
    rows = made.rows(
        f"SELECT a.state, a.sent_at, t.started_at, t.finished_at FROM {attempts} {only}"
    )
    states = [row[0] for row in rows]
    assert set(states) <= {"done", "refused"}, said
    latencies = made.rows(
        f"SELECT c.latency_s FROM {attempts} "
        f"JOIN augment_modelcall c ON c.attempt_id = t.id {only}"
    )
    sent, started, finished = ([_at(row[column]) for row in rows] for column in (1, 2, 3))
    took = [end - start for start, end in zip(started, finished, strict=True)]
    return Run(
        rows=len(rows),
        done=states.count("done"),
        calls=len(latencies),
        queued_s=max(sent) - _at(created),
        worked_s=max(finished) - min(started),
        each_ms=1e3 * statistics.median(took),
        calls_ms=1e3 * statistics.median(row[0] for row in latencies) if latencies else None,
    )


_JOB = "augment_generationjob"


def _at(text: str) -> float:
    return datetime.fromisoformat(text).timestamp()


def _print_runs(rounds: list[Round]) -> None:
    print(
        "| contestant | augmentations per second | lowest, highest | done, refused | calls "
        "| queued | worked | one, claim to outcome | one call |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for slug, _ in CONTESTANTS:
        runs = [one.runs[slug] for one in rounds]
        rates = sorted(run.per_second for run in runs)
        middle = statistics.median
        calls_ms = [run.calls_ms for run in runs if run.calls_ms is not None]
        call = f"{middle(calls_ms):.0f} ms" if calls_ms else "none"
        print(
            f"| {slug} | {middle(rates):.1f} | {rates[0]:.1f}, {rates[-1]:.1f} "
            f"| {runs[0].done}, {runs[0].rows - runs[0].done} | {runs[0].calls} "
            f"| {middle(run.queued_s for run in runs):.2f} s "
            f"| {middle(run.worked_s for run in runs):.2f} s "
            f"| {middle(run.each_ms for run in runs):.0f} ms | {call} |"
        )


def _print_phases(rounds: list[Round]) -> None:
    print("| phase | seconds |")
    print("|---|---|")
    for name in rounds[0].phases_s:
        print(f"| {name} | {statistics.median(one.phases_s[name] for one in rounds):.2f} |")


if __name__ == "__main__":
    main()
