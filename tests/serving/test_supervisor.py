import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

from arena.serving.supervisor import ALIVE_EVERY_S, ChildFailed, Program, Supervisor
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
    children = [place.child.pid for place in supervisor._places]
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
    assert supervisor._places == []


def test_a_crashed_program_is_started_again() -> None:
    said = Said()
    supervisor = Supervisor([program("worker", SLEEP)], said)
    supervisor.start()
    first = supervisor._places[0].child.pid
    wait_until(lambda: ("worker", "up") in said.lines, what="the worker is up")
    watcher = threading.Thread(target=supervisor.watch, daemon=True)
    watcher.start()
    os.kill(first, signal.SIGKILL)
    wait_until(lambda: said.lines.count(("worker", "up")) == 2, what="it is up again")
    # It may speak before the supervisor has put it into the place of the first.
    wait_until(lambda: supervisor._places[0].child.pid != first, what="it has taken the place")
    supervisor.ask_to_stop()
    watcher.join()
    supervisor.stop()


class Clock:
    """Seconds that go on when they are told to."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def crash(supervisor: Supervisor, place: int) -> None:
    """Let the program of that place end, and let it be noticed."""
    child = supervisor._places[place].child
    os.kill(child.pid, signal.SIGKILL)
    wait_until(lambda: child.exit_code is not None, what="it has crashed")
    supervisor.check()


def test_a_program_that_hangs_is_killed_and_started_again(clock: Clock) -> None:
    hung: list[int] = []
    sleeper = replace(program("worker", SLEEP), is_alive=lambda pid: pid not in hung)
    supervisor = Supervisor([sleeper], said := Said(), clock=clock)
    supervisor.start()
    hung.append(first := supervisor._places[0].child.pid)
    clock.now += ALIVE_EVERY_S
    supervisor.check()  # asked, killed
    assert not is_living(first)
    supervisor.check()  # buried
    supervisor.check()  # started again at once
    second = supervisor._places[0].child.pid
    assert second != first
    assert is_living(second)
    assert ("worker", "hangs; killing it") in said.lines
    supervisor.stop()


def test_who_keeps_crashing_waits_longer_each_time_and_the_others_live_on(clock: Clock) -> None:
    said = Said()
    supervisor = Supervisor([program("web", SLEEP), program("worker", SLEEP)], said, clock=clock)
    supervisor.start()
    web = supervisor._places[0].child.pid
    waits = []
    for _ in range(5):
        crash(supervisor, 1)
        crashed = supervisor._places[1]
        assert crashed.due_at is not None
        waits.append(crashed.due_at - clock.now)
        if crashed.due_at > clock.now:
            clock.now = crashed.due_at - 0.1
            supervisor.check()
            assert crashed.child.exit_code is not None, "not before its time"
        clock.now = crashed.due_at
        supervisor.check()
        assert crashed.child.exit_code is None
    assert waits == [0.0, 1.0, 2.0, 4.0, 8.0]
    assert supervisor._places[0].child.pid == web
    assert living([web]) == [web]
    assert ("worker", "ended with exit code -9; starting it again in 8 s") in said.lines
    assert ("worker", "keeps crashing; everything else goes on without it") in said.lines
    supervisor.stop()


DRAINS = """
import os, signal, sys, time
def drain(*_):
    print("draining", flush=True)
    while not os.path.exists(sys.argv[1]):
        time.sleep(0.01)
    print("drained", flush=True)
    raise SystemExit(0)
signal.signal(signal.SIGTERM, drain)
print("up", flush=True)
time.sleep(600)
"""


def draining(said: Said, may_end: Path) -> tuple[Supervisor, threading.Thread]:
    """A supervisor that stops, whose program ends once a file is there."""
    worker = Program(
        name="worker",
        arguments=(sys.executable, "-c", DRAINS, str(may_end)),
        is_ready=lambda: ("worker", "up") in said.lines,
        grace_s=600.0,
    )
    supervisor = Supervisor([worker], said)
    supervisor.start()
    stopping = threading.Thread(target=supervisor.stop, daemon=True)
    stopping.start()
    wait_until(lambda: ("worker", "draining") in said.lines, what="it was told to stop")
    return supervisor, stopping


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
from arena.serving.supervisor import Child, Program
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
