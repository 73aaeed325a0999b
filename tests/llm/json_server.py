"""Local servers that answer every POST with JSON: what is up to subclasses, or the same to all."""

import json
import threading
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from socketserver import TCPServer
from typing import Any, TypeVar


class JsonServer(ThreadingHTTPServer, ABC):
    """Listens at a free port of this computer.

    Args:
        headers: Are sent with every answer.
    """

    daemon_threads = True

    def __init__(self, headers: dict[str, str] | None = None) -> None:
        super().__init__(("127.0.0.1", 0), _Handler)
        self.headers = headers or {}

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}/v1"

    def hear(self, headers: dict[str, str]) -> None:
        """Is told the headers of every request, named in small letters."""

    @abstractmethod
    def answer(self, body: dict[str, Any]) -> tuple[int, object]:
        """Status and document for a request."""


class _Handler(BaseHTTPRequestHandler):
    server: JsonServer

    def do_POST(self) -> None:
        asked = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.hear({name.lower(): value for name, value in self.headers.items()})
        status, document = self.server.answer(asked)
        body = json.dumps(document).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(body)))
        for name, value in self.server.headers.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: object) -> None:
        pass


Server = TypeVar("Server", bound=TCPServer)


@contextmanager
def serving(server: Server) -> Iterator[Server]:
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        server.server_close()
        thread.join()


GOOD = {
    "id": "1",
    "object": "chat.completion",
    "created": 0,
    "model": "m",
    "choices": [
        {"index": 0, "finish_reason": "stop", "message": {"role": "assistant", "content": "Hi"}}
    ],
}


class Recorder(JsonServer):
    """Keeps the headers that it is sent."""

    def __init__(self, status: int, body: object, headers: dict[str, str] | None) -> None:
        super().__init__(headers)
        self.status, self.body = status, body
        self.heard: list[dict[str, str]] = []

    def hear(self, headers: dict[str, str]) -> None:
        self.heard.append(headers)

    def answer(self, body: dict[str, Any]) -> tuple[int, object]:
        return self.status, self.body


def recorder(
    status: int = 200, body: object = GOOD, headers: dict[str, str] | None = None
) -> AbstractContextManager[Recorder]:
    return serving(Recorder(status, body, headers))
