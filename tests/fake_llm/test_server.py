from __future__ import annotations

import http.client
import json
from collections.abc import Mapping

from augment.fake_llm.server import FakeServer

HELLO = {"role": "user", "content": "Hello"}


def call(
    server: FakeServer, method: str, path: str, document: object = None
) -> tuple[int, Mapping[str, object]]:
    connection = http.client.HTTPConnection(*server.server_address[:2], timeout=60)  # type: ignore[arg-type]
    try:
        body = None if document is None else json.dumps(document)
        connection.request(method, path, body)
        response = connection.getresponse()
        return response.status, json.loads(response.read())
    finally:
        connection.close()


def chat(server: FakeServer, **changes: object) -> tuple[int, Mapping[str, object]]:
    document = {"model": "fake-good", "messages": [HELLO]} | changes
    return call(server, "POST", "/v1/chat/completions", document)


def test_it_answers_a_conversation_and_the_same_one_the_same(server: FakeServer) -> None:
    first, second = chat(server), chat(server)
    assert first == second
    status, answer = first
    assert status == 200
    assert answer["model"] == "fake-good"
    assert set(answer) == {"id", "object", "created", "model", "choices", "usage"}


def test_a_bad_request_is_a_400_that_names_the_field(server: FakeServer) -> None:
    status, answer = chat(server, colour="red")
    assert status == 400
    assert isinstance(answer["error"], dict)
    assert answer["error"]["param"] == "colour"
    assert answer["error"]["type"] == "invalid_request_error"
