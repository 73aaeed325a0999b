"""Our voting server beside Label Studio's: `python -m bench.rivals.voting [RUNS]`.

8 clients at once, each doing what one vote costs the server: ours POST the vote, whose answer
brings the next pair; Label Studio's fetch the next task and submit the answer. 200 tasks, 8
annotators, 50 votes each a run. The table goes to docs/benchmarks.md.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import warnings
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from bench.report import load, write_section
from bench.rivals import ours, weight
from bench.rivals.environments import NotInstalled, python_of
from bench.rivals.figures import CLIENTS, ELSEWHERE, TURNS, Figures, section
from bench.rivals.label_studio import server as label_studio_server
from bench.rivals.load import Turn, drive
from bench.rivals.processes import cpu_s, postgres, pss_mb

HEADING = "Voting, side by side with Label Studio"
RUNS, TASKS = 3, 200
OUR_PORT, THEIR_PORT = 9153, 9154


def measured(
    name: str, turns: Sequence[Turn], pid: int, page: Callable[[], weight.Weight], runs: int
) -> Figures:
    """All runs of one setup; the page is weighed last, so that it costs the runs nothing."""
    drive(turns, turns=3)  # everything is loaded, every connection open
    ours.pause()
    taken, spent = [], []
    for _ in range(runs):
        before = cpu_s(pid)
        run = drive(turns, turns=TURNS)
        spent.append(1000 * (cpu_s(pid) - before) / (CLIENTS * TURNS))
        taken.append(run)
        if run.errors:
            print(f"  {len(run.errors)} errors, the first: {run.errors[0]}", flush=True)
        print(f"  {name}: {run.per_second('vote'):.0f} votes/s", flush=True)
        ours.pause()
    memory = max(pss_mb(pid))
    return Figures(
        name=name,
        per_second=statistics.median(run.per_second("vote") for run in taken),
        median_ms=statistics.median(run.median_ms("vote") for run in taken),
        p95_ms=statistics.median(run.p95_ms("vote") for run in taken),
        max_ms=max(run.max_ms("vote") for run in taken),
        errors=sum(len(run.errors) for run in taken),
        cpu_ms=statistics.median(spent),
        pss_mb=memory,
        page_kb=page().kb,
    )


def of_ours(folder: Path, name: str, database: str, runs: int) -> Figures:
    votes = CLIENTS * (3 + runs * TURNS)
    with ours.arena(
        folder, port=OUR_PORT, clients=CLIENTS, votes=votes, database=database
    ) as here:
        turns = ours.voters(here, CLIENTS)
        return measured(name, turns, here.pid, lambda: weight.of_ours(here), runs)


def of_label_studio(
    python: Path, folder: Path, name: str, socket: Path | None, runs: int
) -> Figures:
    with label_studio_server.studio(
        python, folder, port=THEIR_PORT, tasks=TASKS, annotators=CLIENTS, postgres_socket=socket
    ) as here:
        turns = label_studio_server.annotators_of(here)
        return measured(name, turns, here.pid, lambda: weight.of_label_studio(here), runs)


def all_of_them(folder: Path, runs: int) -> Iterator[Figures]:
    """Every setup in turn, never two at once."""
    yield of_ours(folder / "a", "ours, SQLite", f"sqlite:///{folder}/a.sqlite3", runs)
    with postgres(folder / "pg-a") as (uri, _):
        yield of_ours(folder / "b", "ours, PostgreSQL", uri, runs)
    try:
        python = python_of("label_studio")
    except NotInstalled as error:
        print(error, file=sys.stderr)
        yield from ELSEWHERE
        return
    yield of_label_studio(python, folder / "c", ELSEWHERE[0].name, None, runs)
    with postgres(folder / "pg-d") as (_, socket):
        yield of_label_studio(python, folder / "d", ELSEWHERE[1].name, socket, runs)


def main(runs: int) -> None:
    warnings.simplefilter("ignore", RuntimeWarning)
    before = load()
    with tempfile.TemporaryDirectory(prefix="arena-bench-") as folder:
        found = list(all_of_them(Path(folder), runs))
    text = section(found, before, runs)
    print(text)
    write_section(HEADING, text)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else RUNS)
