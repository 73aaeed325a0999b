from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from arena.serving.child import Program
from arena.serving.supervisor import ChildFailed, Supervisor
from tests.processes import wait_until

SLEEP = "import time; print('up', flush=True); time.sleep(600)"


class Said:
    """What the supervisor and its children said."""

    def __init__(self) -> None:
        self.lines: list[tuple[str, str]] = []

    def __call__(self, name: str, line: str) -> None:
        self.lines.append((name, line))


def program(
    name: str, code: str, *, is_ready: Callable[[], bool] = lambda: True, within_s: float = 60.0
) -> Program:
    return Program(
        name=name,
        arguments=(sys.executable, "-c", code),
        is_ready=is_ready,
        ready_within_s=within_s,
        grace_s=2.0,
    )


def living(pids: list[int]) -> list[int]:
    return [pid for pid in pids if is_living(pid)]


def is_living(pid: int) -> bool:
    try:
        return bool(psutil.Process(pid).status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


def test_programs_start_in_order_and_stop_together() -> None:
    said = Said()
    supervisor = Supervisor([program("one", SLEEP), program("two", SLEEP)], said)
    supervisor.start()
    children = [child.pid for child in supervisor._children]
    wait_until(lambda: ("two", "up") in said.lines, what="the second one is up")
    supervisor.stop()
    assert living(children) == []


def test_a_program_that_ends_while_starting_shows_its_last_lines_and_stops_the_others() -> None:
    supervisor = Supervisor(
        [
            program("one", SLEEP),
            program("two", "print('no such table'); raise SystemExit(3)", is_ready=lambda: False),
        ],
        Said(),
    )
    with pytest.raises(ChildFailed, match=r"(?s)two ended with exit code 3.*no such table"):
        supervisor.start()
    assert supervisor._children == []


def test_a_program_that_never_gets_ready_is_named() -> None:
    supervisor = Supervisor([program("slow", SLEEP, is_ready=lambda: False, within_s=0.3)], Said())
    with pytest.raises(ChildFailed, match="slow is not ready"):
        supervisor.start()


def test_a_crashed_program_is_started_again() -> None:
    said = Said()
    supervisor = Supervisor([program("worker", SLEEP)], said)
    supervisor.start()
    first = supervisor._children[0].pid
    wait_until(lambda: ("worker", "up") in said.lines, what="the worker is up")
    watcher = threading.Thread(target=supervisor.watch, daemon=True)
    watcher.start()
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: said.lines.count(("worker", "up")) == 2, what="it is up again")
    # It may speak before the supervisor has put it into the place of the first.
    wait_until(lambda: supervisor._children[0].pid != first, what="it has taken the place")
    supervisor.ask_to_stop()
    watcher.join()
    supervisor.stop()


def test_a_program_that_keeps_crashing_stops_the_whole_with_its_last_lines(
    tmp_path: Path,
) -> None:
    full = tmp_path / "full"
    code = f"""
import os, time
while not os.path.exists({str(full)!r}):
    time.sleep(0.01)
print("disk full")
raise SystemExit(1)
"""
    supervisor = Supervisor(
        [program("steady", SLEEP), program("broken", code)],
        Said(),
        clock=lambda: 0.0,  # however long its starts take, they are all within a minute
    )
    supervisor.start()
    steady = supervisor._children[0].pid
    full.touch()  # not before it counts as started
    with pytest.raises(ChildFailed, match=r"(?s)broken crashed 4 times.*disk full"):
        supervisor.watch()
    assert living([steady]) == []


def test_a_program_that_does_not_listen_is_killed_with_everything_it_started() -> None:
    stubborn = (
        "import signal, subprocess, sys, time;"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(600)']);"
        "print(child.pid, flush=True); time.sleep(600)"
    )
    said = Said()
    supervisor = Supervisor([program("stubborn", stubborn)], said)
    supervisor.start()
    wait_until(lambda: bool(said.lines), what="it says whom it started")
    grandchild = int(said.lines[0][1])
    supervisor.stop()
    wait_until(lambda: living([grandchild]) == [], what="the grandchild is gone")


def test_nothing_outlives_a_killed_supervisor(tmp_path: Path) -> None:
    pids = tmp_path / "pid"
    code = f"""
import sys, time
from arena.serving.child import Child, Program
sleep = (sys.executable, "-c", "import time; time.sleep(600)")
child = Child(Program(name="one", arguments=sleep,
                      is_ready=lambda: True), print)
open({str(pids)!r}, "w").write(str(child.pid))
time.sleep(600)
"""
    outer = subprocess.Popen([sys.executable, "-c", code])
    wait_until(lambda: pids.exists() and pids.read_text() != "", what="the child has an id")
    child = int(pids.read_text())
    wait_until(
        lambda: "arena.serving.leash" not in psutil.Process(child).cmdline(),
        what="the leash has given way to the program",
    )
    outer.kill()
    outer.wait()
    wait_until(lambda: living([child]) == [], what="the child is gone")
