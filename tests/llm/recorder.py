"""A server that keeps the headers it is sent, and answers the same to everybody."""

from contextlib import AbstractContextManager
from typing import Any

from tests.llm.json_server import JsonServer, serving

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
