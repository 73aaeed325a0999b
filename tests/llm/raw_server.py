"""A server of this computer that says whatever bytes it is told to, and keeps what it is sent."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

Say = Callable[[socket.socket], None]


class RawServer:
    """Listens at a free port; reads one request a connection, then lets `say` answer."""

    def __init__(self, say: Say, *, reads: bool = True) -> None:
        self._say, self._reads = say, reads
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port = self._listening.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}/v1"
        self.heard: list[bytes] = []
        self.stopped = threading.Event()

    def serve(self) -> None:
        while True:
            try:
                connection, _ = self._listening.accept()
            except OSError:
                return
            threading.Thread(target=self._one, args=(connection,), daemon=True).start()

    def close(self) -> None:
        self.stopped.set()
        with suppress(OSError):
            self._listening.shutdown(socket.SHUT_RDWR)
        self._listening.close()

    def _one(self, connection: socket.socket) -> None:
        # Whoever is spoken to may be gone: that is what most of these tests are about.
        with connection, suppress(OSError):
            if self._reads:
                self.heard.append(_request(connection))
            else:
                self.heard.append(connection.recv(65536))
            self._say(connection)


@contextmanager
def speaking(say: Say, *, reads: bool = True) -> Iterator[RawServer]:
    server = RawServer(say, reads=reads)
    thread = threading.Thread(target=server.serve, daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join()


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
