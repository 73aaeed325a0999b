"""Who sends or reads slowly holds a connection, never a thread: gunicorn with one, for real."""

import http.client
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest
from waitress.adjustments import Adjustments

from arena.serving.probes import port_answers
from arena.serving.web_worker import Connection
from tests.processes import Process, wait_until
from tests.stack import free_port

GENEROUS_S = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Served:
    port: int
    process: Process
    folder: Path

    def get(self, path: str = "/", headers: dict[str, str] | None = None) -> bytes:
        wire = http.client.HTTPConnection("127.0.0.1", self.port, timeout=GENEROUS_S)
        with closing(wire):
            wire.request("GET", path, headers=headers or {})
            return wire.getresponse().read()

    def sent(self, beginning: bytes) -> socket.socket:
        wire = socket.create_connection(("127.0.0.1", self.port), timeout=GENEROUS_S)
        wire.sendall(beginning)
        return wire


@contextmanager
def serving(folder: Path) -> Iterator[Served]:
    port = free_port()
    process = Process(
        [
            *(sys.executable, "-m", "gunicorn", "tests.serving.served"),
            *("--worker-class", "arena.serving.web_worker.BufferingWorker"),
            *("--bind", f"127.0.0.1:{port}", "--workers", "1", "--threads", "2"),
            *("--worker-tmp-dir", str(folder), "--no-control-socket"),
        ],
        environment={**os.environ, "HELD": str(folder), "ARENA_UPLOAD_MB": "1"},
        log=folder / "web.log",
    )
    try:
        wait_until(lambda: port_answers("127.0.0.1", port), what=process.said() or "it listens")
        yield Served(port=port, process=process, folder=folder)
    finally:
        process.stop()


@pytest.fixture(scope="module")
def served(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with serving(tmp_path_factory.mktemp("served")) as found:
        yield found


@pytest.mark.parametrize(
    ("count", "beginning"),
    [
        (32, b""),
        (32, b"GET / HTTP/1.1\r\nHost: localhost\r\nX-Slow: a"),
        (32, b"POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\nonly"),
        (4, b"GET /long HTTP/1.1\r\nHost: localhost\r\n\r\n"),
    ],
    ids=["silent", "half a header", "half a body", "does not read"],
)
def test_slow_connections_block_nobody(served: Served, count: int, beginning: bytes) -> None:
    with ExitStack() as slow:
        for _ in range(count):
            slow.enter_context(served.sent(beginning))
        assert served.get() == b"hello"


def test_headers_of_proxies_are_left_to_the_settings(served: Served) -> None:
    assert served.get(headers={"X-Forwarded-For": "192.0.2.7"}) == b"192.0.2.7"


@pytest.mark.parametrize(
    ("size", "is_chunked", "answer"),
    [
        (5_000_000, False, b"5000000 None"),
        (5_000_000, True, b"5000000 None"),
        (5_000_001, False, b"5000000 1"),
        (90_000_000, False, b"5000000 1"),
        (90_000_000, True, b"5000000 1"),
    ],
)
def test_a_body_beyond_the_limit_is_answered_and_never_reset(
    served: Served, size: int, is_chunked: bool, answer: bytes
) -> None:
    wire = http.client.HTTPConnection("127.0.0.1", served.port, timeout=GENEROUS_S)
    body = [b"x" * 1_000_000] * (size // 1_000_000) if is_chunked else b"x" * size
    with closing(wire):
        for _ in range(2):  # the connection is as good as before
            wire.request("POST", "/", body=body, encode_chunked=is_chunked)
            assert wire.getresponse().read() == answer


# --- Which connections are closed ----------------------------------------------------------------


@pytest.fixture
def connection() -> Iterator[Connection]:
    """One that has begun a request 100 s after the machine's start."""
    server = SimpleNamespace(active_channels={}, add_task=lambda _: None)
    ours, theirs = socket.socketpair()
    with ours, theirs:
        made = Connection(server, ours, ("127.0.0.1", 1), Adjustments(), map={})
        made.received(b"POST / HTTP/1.1\r\nContent-Length: 900000\r\n\r\n")
        made.began_at = 100.0
        yield made


@pytest.mark.parametrize(
    ("came_in", "after_s", "is_late"),
    [
        *((0, 29.0, False), (0, 30.0, False), (0, 30.1, True), (60, 60.0, True)),
        *((29_999, 60.0, True), (30_000, 60.0, False)),
    ],
)
def test_a_request_that_never_ends_is_closed_and_a_slow_line_is_not(
    connection: Connection, came_in: int, after_s: float, is_late: bool
) -> None:
    connection.came_in = came_in
    assert connection.is_late(100.0 + after_s) == is_late


def test_a_connection_without_a_request_is_never_late(connection: Connection) -> None:
    connection.request = None
    assert not connection.is_late(1e6)
