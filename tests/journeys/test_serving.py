"""`manage.py serve` on a real machine after the worst: it was killed, and its web workers hang."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import psutil
import pytest

from tests.processes import ROOT, copy_database, wait_until
from tests.stack import Home, answers, free_port

pytestmark = [pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]


@contextmanager
def serve(home: Home, port: int, log: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A running one; whatever becomes of it, nothing of it is left."""
    with log.open("w") as file:
        process = subprocess.Popen(
            [sys.executable, "manage.py", "serve", "--port", str(port)],
            cwd=ROOT,
            env=home.environment,
            stdout=file,
            stderr=subprocess.STDOUT,
        )
    family: list[psutil.Process] = []
    try:
        wait_until(
            lambda: "Ctrl-C stops it" in log.read_text() or process.poll() is not None,
            what="everything is up",
            within_s=240.0,
        )
        assert process.poll() is None, log.read_text()
        family = psutil.Process(process.pid).children(recursive=True)
        yield process
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(timeout=240)
        for left in family:
            with suppress(psutil.NoSuchProcess):
                left.kill()


def serving_workers(served: subprocess.Popen[bytes]) -> list[psutil.Process]:
    """The web workers that have their threads."""
    return [
        process
        for process in psutil.Process(served.pid).children(recursive=True)
        if "gunicorn" in " ".join(process.cmdline()) and process.num_threads() > 4
    ]


def test_after_kill_9_one_serve_starts_again_and_nothing_else_is_ended(
    migrated: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("home")
    home, port = Home.at(folder), free_port()
    copy_database(migrated, home.database)
    with serve(home, port, folder / "first.log") as first:
        # Gunicorn's port answers before its workers are up; one that was just forked hears of
        # its parent's end only once it runs again.
        wait_until(lambda: len(serving_workers(first)) == 2, what="both workers serve")
        gunicorn = serving_workers(first)[0].parent()
        assert gunicorn is not None
        # What hangs notices nothing, and holds the port.
        for process in (gunicorn, *gunicorn.children()):
            os.kill(process.pid, signal.SIGSTOP)
        first.kill()
        first.wait(60)
        with serve(home, port, folder / "second.log"):
            assert answers(f"http://127.0.0.1:{port}/login/")
