"""The stand-in's HTTP server: /v1/chat/completions and /v1/models on this computer."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

from augment.fake_llm.models import MODELS, Surroundings, respond
from augment.fake_llm.requests import BadRequest, chat_request
from augment.fake_llm.responses import Response, as_json, error
from augment.fake_llm.sight import Intents, knows_nothing

_LONGEST_BODY = 32_000_000


class FakeServer(ThreadingHTTPServer):
    """A server that is bound but not yet serving; `serve_forever` does that.

    Args:
        host, port: Where it listens; port 0 takes a free one.
        latency_s: How long every answer takes at least.
        slow_s: How long `fake-slow` takes.
        intents: What an instruction asks for, by its text.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """

    daemon_threads = True

    def __init__(
        self,
        host: str = "127.0.0.1",
        port: int = 0,
        *,
        latency_s: float = 0.0,
        slow_s: float = 30.0,
        intents: Intents = knows_nothing,
    ) -> None:
        self.latency_s = latency_s
        self.surroundings = Surroundings(slow_s=slow_s, intents=intents)
        self.stopping = threading.Event()
        super().__init__((host, port), _Handler)

    @property
    def url(self) -> str:
        """The base URL that a client is given."""
        host, port = self.server_address[:2]
        return f"http://{host!s}:{port}/v1"

    def stop(self) -> None:
        """End serving and close; who waits for a slow answer is let go."""
        self.stopping.set()
        self.shutdown()
        self.server_close()


@contextmanager
def running(
    host: str = "127.0.0.1",
    port: int = 0,
    *,
    latency_s: float = 0.0,
    slow_s: float = 30.0,
    intents: Intents = knows_nothing,
) -> Iterator[FakeServer]:
    """A server that serves in the background until the block ends.

    Raises:
        OSError: The address is taken or is none of this computer's.
    """
    server = FakeServer(host, port, latency_s=latency_s, slow_s=slow_s, intents=intents)
    thread = threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True)
    thread.start()
    try:
        yield server
    finally:
        server.stop()
        thread.join()


class _Handler(BaseHTTPRequestHandler):
    """One connection; it may carry several requests."""

    server: FakeServer
    protocol_version = "HTTP/1.1"
    timeout = 120.0
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        """List the models."""
        if self.path.rstrip("/") == "/v1/models":
            models = [{"id": name, "object": "model", "owned_by": "fake"} for name in MODELS]
            self._send(as_json({"object": "list", "data": models}))
        else:
            self._send(_no_such_path(self.path))

    def do_POST(self) -> None:
        """Answer a conversation."""
        body = self._body()
        if body is None:
            self.close_connection = True
            self._send(error(411, "Content-Length is missing or too large"))
        elif self.path != "/v1/chat/completions":
            self._send(_no_such_path(self.path))
        else:
            self._send(self._answer(body))

    def log_message(self, format: str, *args: object) -> None:
        """Stay quiet: a request may hold what nobody wants in a log."""

    def _answer(self, body: bytes) -> Response:
        try:
            return respond(chat_request(body), self.server.surroundings)
        except BadRequest as refused:
            return error(400, str(refused), param=refused.param)

    def _body(self) -> bytes | None:
        length = self.headers.get("Content-Length", "")
        if not length.isdecimal() or int(length) > _LONGEST_BODY:
            return None
        return self.rfile.read(int(length))

    def _send(self, response: Response) -> None:
        self.server.stopping.wait(max(self.server.latency_s, response.wait_s))
        try:
            self.send_response(response.status)
            self.send_header("Content-Type", response.content_type)
            self.send_header("Content-Length", str(len(response.body)))
            for name, value in response.headers.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(response.body[: response.cut_at])
        except (BrokenPipeError, ConnectionResetError):
            # Who asked has gone: nobody is left to tell.
            self.close_connection = True
        if response.cut_at is not None:
            self.close_connection = True


def _no_such_path(path: str) -> Response:
    shown = json.dumps(path[:80])
    return error(404, f"There is no {shown}; POST to /v1/chat/completions", code="not_found")
