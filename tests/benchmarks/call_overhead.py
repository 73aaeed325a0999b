"""What our client and bookkeeping cost per call: `python -m tests.benchmarks.call_overhead`.

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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import django

ROOT = Path(__file__).resolve().parents[2]
CALLS = 200
WARM_UP = 20
TARGET_MS = 15.0
MODEL = "fake-good"


@contextmanager
def stand_in() -> Iterator[str]:
    """A server in a process of its own; its base URL."""
    started = subprocess.Popen(
        [sys.executable, "manage.py", "fake_llm", "--port", "0"],
        cwd=ROOT,
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


def timed(call: Callable[[int], object], number: int) -> float:
    """Milliseconds of one call."""
    started = time.perf_counter()
    call(number)
    return 1000.0 * (time.perf_counter() - started)


def line(name: str, times_ms: list[float]) -> str:
    """A row of the table."""
    ordered = sorted(times_ms)
    p95 = ordered[int(0.95 * len(ordered))]
    return f"{name:<34}{statistics.median(ordered):9.2f}{p95:9.2f}{ordered[-1]:9.2f}"


def main() -> int:
    """Print the table; 1 where the overhead is above the target."""
    with tempfile.TemporaryDirectory(prefix="arena-bench-") as folder, stand_in() as base_url:
        os.environ["DJANGO_SETTINGS_MODULE"] = "arena.config.settings"
        os.environ["ARENA_VAR_DIR"] = f"{folder}/var"
        os.environ["ARENA_MEDIA_DIR"] = f"{folder}/media"
        os.environ.setdefault("DATABASE_URL", f"sqlite:///{folder}/bench.sqlite3")
        django.setup()
        # What needs the settings is imported once they are there.
        from tests.benchmarks.calls import bare_client, conversation

        bare, ours = bare_client(base_url, MODEL), conversation(base_url, MODEL)
        alone, kept = [], []
        for number in range(-WARM_UP, CALLS):
            pair = (timed(bare, number), timed(ours, number))
            if number >= 0:
                alone.append(pair[0])
                kept.append(pair[1])
        database = os.environ["DATABASE_URL"].partition(":")[0]
    overheads = [more - less for more, less in zip(kept, alone, strict=True)]
    overhead_ms = statistics.median(overheads)
    print(f"{CALLS} calls each, taking turns; {database}; milliseconds")
    print(f"{'':<34}{'median':>9}{'p95':>9}{'max':>9}")
    print(line("bare openai client", alone))
    print(line("our client and bookkeeping", kept))
    print(line("overhead per call", overheads))
    print(f"ratio of the medians {statistics.median(kept) / statistics.median(alone):.2f}")
    verdict = "below" if overhead_ms < TARGET_MS else "ABOVE"
    print(f"median overhead {overhead_ms:.2f} ms, {verdict} the target of {TARGET_MS:g} ms")
    return 0 if overhead_ms < TARGET_MS else 1


if __name__ == "__main__":
    raise SystemExit(main())
