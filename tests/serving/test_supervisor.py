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

from arena.serving.supervisor import ChildFailed, Program, Supervisor
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
    children = [child.process.pid for child in supervisor.children]
    wait_until(lambda: ("two", "up") in said.lines, what="the second one is up")
    supervisor.stop()
    assert living(children) == []


def test_what_comes_to_be_missing_is_started_once_and_stops_with_the_others() -> None:
    supervisor, later = Supervisor([], Said()), program("later", SLEEP)
    watching = threading.Thread(target=supervisor.watch, args=[lambda: [later]])
    watching.start()
    wait_until(lambda: len(supervisor.children) == 1, what="it is started")
    time.sleep(1.5)
    (child,) = supervisor.children
    supervisor.ask_to_stop()
    watching.join()
    supervisor.stop()
    assert living([child.process.pid]) == []


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
    assert supervisor.children == []


def test_a_crashed_program_is_started_again_and_waits_longer_each_time() -> None:
    supervisor = Supervisor([program("web", SLEEP), program("worker", SLEEP)], said := Said())
    supervisor.start()
    web, worker = supervisor.children
    first, waits = web.process.pid, []

    def is_up_again() -> bool:
        supervisor.check()
        return worker.due_at is None

    for _ in range(5):
        os.kill(worker.process.pid, signal.SIGKILL)
        wait_until(lambda: worker.exit_code is not None, what="it has crashed")
        supervisor.check()
        assert worker.due_at is not None
        waits.append(round(worker.due_at - time.monotonic()))
        worker.due_at -= waits[-1]
        wait_until(is_up_again, what="it runs again")
    assert waits == [0, 1, 2, 4, 8]
    assert living([first]) == [first]
    assert ("worker", "ended with exit code -9; starting it again in 8 s") in said.lines
    with pytest.raises(ChildFailed, match="worker crashed 5 times in a row"):
        supervisor.insist_on_steadiness()
    supervisor.stop()


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
open({str(pids)!r}, "w").write(str(child.process.pid))
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
