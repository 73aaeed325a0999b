"""What a killed supervisor left behind is ended, and nothing else."""

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import psutil
import pytest

from arena.serving.ledger import MARK, Ledger, end_orphans

SLEEP = (sys.executable, "-c", "import time; time.sleep(600)")


@pytest.fixture
def started() -> Iterator[list[subprocess.Popen[bytes]]]:
    """Two processes that only the test ends, else."""
    with ExitStack() as stack:
        made = [subprocess.Popen(SLEEP), subprocess.Popen(SLEEP)]
        for process in made:
            stack.callback(process.wait)
            stack.callback(process.kill)
        yield made


def dead_supervisor(folder: Path, *, children: list[dict[str, object]], secret: str = "x") -> Path:
    """The list of one whose number is somebody else's by now."""
    path = folder / "serving-1.json"
    supervisor = {"pid": os.getpid(), "started": psutil.Process().create_time() - 3600.0}
    path.write_text(json.dumps({"supervisor": supervisor, "secret": secret, "children": children}))
    return path


def line(process: subprocess.Popen[bytes], *, earlier_s: float = 0.0) -> dict[str, object]:
    start = psutil.Process(process.pid).create_time()
    return {"name": "web", "pid": process.pid, "started": start - earlier_s}


def test_what_was_written_down_is_ended_and_the_list_with_it(
    tmp_path: Path, started: list[subprocess.Popen[bytes]]
) -> None:
    ours, other = started
    path = dead_supervisor(tmp_path, children=[line(ours)])
    said: list[str] = []
    assert end_orphans(tmp_path, said.append) == 1
    assert ours.poll() is not None
    assert other.poll() is None
    assert said == [f"An earlier run was killed and left 1 processes: ending {ours.pid}."]
    assert not path.exists()


def test_a_number_that_is_somebody_elses_by_now_is_left_alone(
    tmp_path: Path, started: list[subprocess.Popen[bytes]]
) -> None:
    path = dead_supervisor(tmp_path, children=[line(started[0], earlier_s=60.0)])
    assert end_orphans(tmp_path, print) == 0
    assert started[0].poll() is None
    assert not path.exists()


def test_what_a_child_started_is_known_by_its_mark(tmp_path: Path) -> None:
    grandchild = subprocess.Popen(SLEEP, env={**os.environ, MARK: "our-secret"})
    other = subprocess.Popen(SLEEP, env={**os.environ, MARK: "another-secret"})
    try:
        dead_supervisor(tmp_path, children=[], secret="our-secret")
        assert end_orphans(tmp_path, print) == 1
        assert grandchild.poll() is not None
        assert other.poll() is None
    finally:
        for process in (grandchild, other):
            process.kill()
            process.wait()


def test_what_a_living_supervisor_runs_is_left_alone(
    tmp_path: Path, started: list[subprocess.Popen[bytes]]
) -> None:
    ledger = Ledger(tmp_path)
    ledger.note("web", started[0].pid)
    assert end_orphans(tmp_path, print) == 0
    assert started[0].poll() is None
    ledger.close()
    assert list(tmp_path.iterdir()) == []


def test_the_list_holds_who_lives_and_their_mark(
    tmp_path: Path, started: list[subprocess.Popen[bytes]]
) -> None:
    ledger = Ledger(tmp_path)
    for process in started:
        ledger.note("worker", process.pid)
        process.kill()
        process.wait()
    again = subprocess.Popen(SLEEP)
    ledger.note("worker", again.pid)
    (path,) = tmp_path.iterdir()
    kept = json.loads(path.read_text())
    assert [child["pid"] for child in kept["children"]] == [again.pid]
    assert ledger.environment == {MARK: kept["secret"]}
    again.kill()
    again.wait()
