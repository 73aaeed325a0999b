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

from arena.serving import web_worker
from arena.serving.probes import port_answers
from arena.serving.web_worker import Connection, make_room
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
        environment={**os.environ, "HELD": str(folder)},
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


# --- Which connections are closed ----------------------------------------------------------------


@pytest.fixture
def connections() -> Iterator[list[Connection]]:
    """Three, none of which has sent anything."""
    server = SimpleNamespace(active_channels={}, add_task=lambda _: None)
    with ExitStack() as sockets:
        made = []
        for _ in range(3):
            ours, theirs = socket.socketpair()
            sockets.enter_context(ours)
            sockets.enter_context(theirs)
            made.append(Connection(server, ours, ("127.0.0.1", 1), Adjustments(), map={}))
        yield made


def closed(connections: list[Connection]) -> list[bool]:
    return [bool(connection.will_close) for connection in connections]


@pytest.mark.parametrize(
    ("after_s", "is_closed"), [(29.0, False), (30.0, False), (30.1, True), (500.0, True)]
)
def test_a_request_that_never_ends_is_closed(
    connections: list[Connection], after_s: float, is_closed: bool
) -> None:
    connections[0].received(b"GET / HT")
    connections[0].waits_since, connections[0].came_in = 100.0, 0
    make_room(connections, now=100.0 + after_s)
    assert closed(connections) == [is_closed, False, False]


def test_a_byte_a_second_does_not_keep_it_and_a_slow_line_does(
    connections: list[Connection],
) -> None:
    for connection, came_in in zip(connections, (60, 29_999, 30_000), strict=True):
        connection.received(b"POST / HTTP/1.1\r\nContent-Length: 900000\r\n\r\n")
        connection.waits_since, connection.came_in = 100.0, came_in
    make_room(connections, now=160.0)
    assert closed(connections) == [True, True, False]


def test_who_waits_the_longest_makes_room(
    connections: list[Connection], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_worker, "CONNECTIONS", 2)
    for connection, since in zip(connections, (102.0, 101.0, 103.0), strict=True):
        connection.waits_since = since
    make_room(connections, now=104.0)
    assert closed(connections) == [False, True, False]


def test_who_is_being_answered_never_makes_room(
    connections: list[Connection], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(web_worker, "CONNECTIONS", 0)
    connections[1].received(b"GET / HTTP/1.1\r\n\r\n")
    make_room(connections, now=connections[1].waits_since + 3600.0)
    assert closed(connections) == [True, False, True]
