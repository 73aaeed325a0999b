"""A server of this computer that says whatever bytes it is told to, and keeps what it is sent."""

import socket
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from socketserver import BaseRequestHandler, ThreadingTCPServer

from tests.llm.json_server import serving

Say = Callable[[socket.socket], None]


class RawServer(ThreadingTCPServer):
    """Listens at a free port; reads one request a connection, then lets `say` answer."""

    daemon_threads = True

    def __init__(self, say: Say, *, reads: bool) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.say, self.reads = say, reads
        self.port = self.server_address[1]
        self.url = f"http://127.0.0.1:{self.port}/v1"
        self.heard: list[bytes] = []


class _Handler(BaseRequestHandler):
    server: RawServer

    def handle(self) -> None:
        # Whoever is spoken to may be gone: that is what most of these tests are about.
        with suppress(OSError):
            read = _request if self.server.reads else lambda connection: connection.recv(65536)
            self.server.heard.append(read(self.request))
            self.server.say(self.request)


def speaking(say: Say, *, reads: bool = True) -> AbstractContextManager[RawServer]:
    return serving(RawServer(say, reads=reads))


def head(*headers: str, status: str = "200 OK") -> bytes:
    lines = (f"HTTP/1.1 {status}", "Content-Type: application/json", *headers)
    return "".join(f"{line}\r\n" for line in (*lines, "")).encode("latin-1")


def whole(body: bytes, *headers: str, status: str = "200 OK") -> Say:
    """An answer with that body."""
    said = head(*headers, f"Content-Length: {len(body)}", status=status) + body
    return lambda connection: connection.sendall(said)


def drip(first: bytes, again: bytes, *, every_s: float = 0.005) -> Say:
    """Something at first, then the same again and again, for as long as anybody listens."""

    def say(connection: socket.socket) -> None:
        connection.sendall(first)
        pause = threading.Event()
        while not pause.wait(every_s):
            connection.sendall(again)

    return say


def _request(connection: socket.socket) -> bytes:
    data = b""
    while b"\r\n\r\n" not in data:
        data += connection.recv(65536)
    top, _, body = data.partition(b"\r\n\r\n")
    length = next(
        int(line.partition(b":")[2])
        for line in top.split(b"\r\n")
        if line.lower().startswith(b"content-length:")
    )
    while len(body) < length:
        body += connection.recv(65536)
    return top + b"\r\n\r\n" + body
