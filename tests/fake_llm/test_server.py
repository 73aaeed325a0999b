from __future__ import annotations

import http.client
import json
import time
from collections.abc import Mapping

import pytest

from augment.fake_llm.models import MODELS
from augment.fake_llm.server import FakeServer, running

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


def test_it_lists_its_models(server: FakeServer) -> None:
    status, answer = call(server, "GET", "/v1/models")
    assert status == 200
    assert isinstance(answer["data"], list)
    assert [model["id"] for model in answer["data"]] == list(MODELS)


def test_it_answers_a_conversation_and_the_same_one_the_same(server: FakeServer) -> None:
    first, second = chat(server), chat(server)
    assert first == second
    status, answer = first
    assert status == 200
    assert answer["model"] == "fake-good"
    assert set(answer) == {"id", "object", "created", "model", "choices", "usage"}


def test_an_unknown_model_is_a_404_that_names_the_known(server: FakeServer) -> None:
    status, answer = chat(server, model="gpt")
    assert status == 404
    assert isinstance(answer["error"], dict)
    assert answer["error"]["code"] == "model_not_found"
    assert "fake-careless" in answer["error"]["message"]


def test_a_bad_request_is_a_400_that_names_the_field(server: FakeServer) -> None:
    status, answer = chat(server, colour="red")
    assert status == 400
    assert isinstance(answer["error"], dict)
    assert answer["error"]["param"] == "colour"
    assert answer["error"]["type"] == "invalid_request_error"


@pytest.mark.parametrize(
    ("method", "path", "document", "status"),
    [
        ("GET", "/", None, 404),
        ("POST", "/v1/completions", {}, 404),
        ("POST", "/v1/chat/completions", None, 400),
    ],
)
def test_other_addresses_get_an_error_in_json(
    server: FakeServer, method: str, path: str, document: object, status: int
) -> None:
    got, answer = call(server, method, path, document)
    assert got == status
    assert isinstance(answer["error"], dict)


def test_every_answer_can_be_delayed() -> None:
    with running(latency_s=0.2) as slow:
        started = time.monotonic()
        assert chat(slow)[0] == 200
        assert time.monotonic() - started >= 0.2


def test_stopping_does_not_wait_for_a_slow_answer() -> None:
    with running(slow_s=3600.0) as slow:
        connection = http.client.HTTPConnection(*slow.server_address[:2], timeout=60)  # type: ignore[arg-type]
        document = {"model": "fake-slow", "messages": [HELLO]}
        connection.request("POST", "/v1/chat/completions", json.dumps(document))
    connection.close()
