from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest

from arena.serving.child import Program
from arena.serving.supervisor import ChildFailed, Supervisor

SLEEP = "import time; print('up', flush=True); time.sleep(60)"


class Said:
    """What the supervisor and its children said."""

    def __init__(self) -> None:
        self.lines: list[tuple[str, str]] = []

    def __call__(self, name: str, line: str) -> None:
        self.lines.append((name, line))


def program(
    name: str, code: str, *, is_ready: Callable[[], bool] = lambda: True, within_s: float = 10.0
) -> Program:
    return Program(
        name=name,
        arguments=(sys.executable, "-c", code),
        is_ready=is_ready,
        ready_within_s=within_s,
        grace_s=2.0,
    )


def living(pids: list[int]) -> list[int]:
    return [
        pid
        for pid in pids
        if psutil.pid_exists(pid) and psutil.Process(pid).status() != psutil.STATUS_ZOMBIE
    ]


def wait_until(condition: Callable[[], bool], within_s: float = 10.0) -> None:
    deadline = time.monotonic() + within_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.05)


def test_programs_start_in_order_and_stop_together() -> None:
    said = Said()
    supervisor = Supervisor([program("one", SLEEP), program("two", SLEEP)], said)
    supervisor.start()
    children = [child.pid for child in supervisor._children]
    wait_until(lambda: ("two", "up") in said.lines)
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
    wait_until(lambda: ("worker", "up") in said.lines)
    watcher = threading.Thread(target=supervisor.watch, daemon=True)
    watcher.start()
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: said.lines.count(("worker", "up")) == 2)
    assert supervisor._children[0].pid != first
    supervisor.ask_to_stop()
    watcher.join(timeout=5.0)
    supervisor.stop()


def test_a_program_that_keeps_crashing_stops_the_whole_with_its_last_lines() -> None:
    supervisor = Supervisor(
        [program("steady", SLEEP), program("broken", "print('disk full'); raise SystemExit(1)")],
        Said(),
    )
    supervisor.start()
    steady = supervisor._children[0].pid
    with pytest.raises(ChildFailed, match=r"(?s)broken crashed 4 times.*disk full"):
        supervisor.watch()
    assert living([steady]) == []


def test_a_program_that_does_not_listen_is_killed_with_everything_it_started() -> None:
    stubborn = (
        "import signal, subprocess, sys, time;"
        "signal.signal(signal.SIGTERM, signal.SIG_IGN);"
        "child = subprocess.Popen([sys.executable, '-c', 'import time; time.sleep(60)']);"
        "print(child.pid, flush=True); time.sleep(60)"
    )
    said = Said()
    supervisor = Supervisor([program("stubborn", stubborn)], said)
    supervisor.start()
    wait_until(lambda: bool(said.lines))
    grandchild = int(said.lines[0][1])
    supervisor.stop()
    wait_until(lambda: living([grandchild]) == [])


def test_nothing_outlives_a_killed_supervisor(tmp_path: Path) -> None:
    pids = tmp_path / "pid"
    code = f"""
import sys, time
from arena.serving.child import Child, Program
child = Child(Program(name="one", arguments=(sys.executable, "-c", "import time; time.sleep(60)"),
                      is_ready=lambda: True), print)
open({str(pids)!r}, "w").write(str(child.pid))
time.sleep(60)
"""
    outer = subprocess.Popen([sys.executable, "-c", code])
    wait_until(lambda: pids.exists() and pids.read_text() != "")
    child = int(pids.read_text())
    wait_until(lambda: "time.sleep" in " ".join(psutil.Process(child).cmdline()))
    outer.kill()
    outer.wait()
    wait_until(lambda: living([child]) == [])
