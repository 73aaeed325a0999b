"""What our client and bookkeeping cost per call: `python -m bench.call_overhead`.

Calls of the bare `openai` client and of a worker (reserve, store the request, send, store the
answer, settle) take turns against one stand-in server in a process of its own. Every request is
another one, of the size of a real prompt, so that nothing is answered from the store.
"""

from __future__ import annotations

import os
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import django

ROOT = Path(__file__).resolve().parents[1]
CALLS = 200
WARM_UP = 20
TARGET_MS = 15.0
MODEL = "fake-good"


@contextmanager
def stand_in(environment: Mapping[str, str] | None = None) -> Iterator[str]:
    """A server in a process of its own, which looks up intents there; its base URL."""
    started = subprocess.Popen(
        [sys.executable, "manage.py", "fake_llm", "--port", "0"],
        cwd=ROOT,
        env=dict(environment or os.environ),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert started.stdout is not None
        found = re.search(r"http://\S+", started.stdout.readline())
        assert found, "the stand-in did not start"
        yield found.group()
    finally:
        started.terminate()
        started.communicate(timeout=20)


@dataclass(frozen=True, slots=True)
class Taken:
    """What a call took, in milliseconds: on the clock, and of this process's CPU.

    A busy computer stretches the first, and leaves the second nearly alone.
    """

    wall_ms: float
    cpu_ms: float

    def __sub__(self, other: Taken) -> Taken:
        return Taken(self.wall_ms - other.wall_ms, self.cpu_ms - other.cpu_ms)


def timed(call: Callable[[int], object], number: int) -> Taken:
    wall_s, cpu_s = time.perf_counter(), time.process_time()
    call(number)
    return Taken(1000.0 * (time.perf_counter() - wall_s), 1000.0 * (time.process_time() - cpu_s))


def line(name: str, times: list[Taken]) -> str:
    """A row of the table."""
    wall = sorted(taken.wall_ms for taken in times)
    p95 = wall[int(0.95 * len(wall))]
    cpu = statistics.median(taken.cpu_ms for taken in times)
    return f"{name:<28}{statistics.median(wall):9.2f}{p95:9.2f}{wall[-1]:9.2f}{cpu:12.2f}"


def median_ms(times: list[Taken]) -> float:
    return statistics.median(taken.wall_ms for taken in times)


@contextmanager
def installation(folder: str) -> Iterator[None]:
    """Django with an empty database, unless DATABASE_URL names one."""
    os.environ["DJANGO_SETTINGS_MODULE"] = "arena.config.settings"
    os.environ["ARENA_VAR_DIR"] = f"{folder}/var"
    os.environ["ARENA_MEDIA_DIR"] = f"{folder}/media"
    os.environ.setdefault("DATABASE_URL", f"sqlite:///{folder}/bench.sqlite3")
    django.setup()
    yield


def measure() -> tuple[list[Taken], list[Taken]]:
    """The calls of the bare client, and ours."""
    with (
        tempfile.TemporaryDirectory(prefix="arena-bench-") as folder,
        stand_in() as base_url,
        installation(folder),
    ):
        # What needs the settings is imported once they are there.
        from bench.calls import bare_client, conversation

        bare, ours = bare_client(base_url, MODEL), conversation(base_url, MODEL)
        pairs = [(timed(bare, number), timed(ours, number)) for number in range(WARM_UP + CALLS)]
    alone, kept = zip(*pairs[WARM_UP:], strict=True)
    return list(alone), list(kept)


def main() -> int:
    """Print the table; 1 where the overhead is above the target."""
    alone, kept = measure()
    overheads = [more - less for more, less in zip(kept, alone, strict=True)]
    overhead_ms = median_ms(overheads)
    database = os.environ["DATABASE_URL"].partition(":")[0]
    print(f"{CALLS} calls each, taking turns; {database}; milliseconds")
    print(f"{'':<28}{'median':>9}{'p95':>9}{'max':>9}{'CPU median':>12}")
    print(line("bare openai client", alone))
    print(line("our client and bookkeeping", kept))
    print(line("overhead per call", overheads))
    print(f"ratio of the medians {median_ms(kept) / median_ms(alone):.2f}")
    verdict = "below" if overhead_ms < TARGET_MS else "ABOVE"
    print(f"median overhead {overhead_ms:.2f} ms, {verdict} the target of {TARGET_MS:g} ms")
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    return 0 if overhead_ms < TARGET_MS else 1


if __name__ == "__main__":
    raise SystemExit(main())
