"""An address that leads elsewhere: nothing is posted half, and nobody else is shown the token."""

import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from client.arena_client import ApiError, Arena


@pytest.fixture
def moved() -> Iterator[tuple[str, list[str]]]:
    """A server that sends everybody elsewhere, and what it was asked."""
    asked: list[str] = []

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append(f"{self.command} {self.path}")
            self.send_response(301)
            self.send_header("Location", "/there")
            self.send_header("Content-Length", "0")
            self.end_headers()

        do_POST = do_GET

        def log_message(self, *args: Any) -> None:
            """Nothing."""

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01}).start()
    yield f"http://127.0.0.1:{server.server_port}", asked
    server.shutdown()
    server.server_close()


@pytest.mark.parametrize("way", ["vote", "get"])
def test_a_redirect_is_told_and_not_followed(moved: tuple[str, list[str]], way: str) -> None:
    address, asked = moved
    arena = Arena(address, "arena_secret")
    with pytest.raises(ApiError, match="301 moved: this leads to /there") as told:
        arena.vote(
            {"matchup": "m", "question": "instruction"}, "A"
        ) if way == "vote" else arena.get("votes")
    assert told.value.code == "moved"
    assert asked == ["POST /api/v1/votes" if way == "vote" else "GET /api/v1/votes"]
