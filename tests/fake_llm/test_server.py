import http.client
import json
import os
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pytest

from augment.fake_llm.server import FakeServer
from augment.fake_llm.wire import BadRequest, chat_request
from augment.llm.messages import Message, Request, Speaker, data_url
from augment.render.camera import camera_for
from tests.render.pictures import draw_original
from tests.scenes import scene

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


PICTURE = draw_original(scene(), camera_for(scene(), None))
PNG = {"type": "image_url", "image_url": {"url": data_url(PICTURE)}}


def body(**changes: object) -> bytes:
    document = {"model": "fake-good", "messages": [HELLO]} | changes
    return json.dumps(document).encode()


def test_what_our_own_client_sends_is_accepted() -> None:
    messages = (
        Message(speaker=Speaker.SYSTEM, text="Be good."),
        Message(speaker=Speaker.USER, text="Look", images=(PICTURE,)),
        Message(speaker=Speaker.ASSISTANT, text="Yes"),
        Message(speaker=Speaker.USER, text="Again"),
    )
    sent = Request(model="fake-good", messages=messages, temperature=0.5, seed=3)
    request = chat_request(json.dumps(sent.to_document()).encode())
    assert [message.text for message in request.messages] == ["Be good.", "Look", "Yes", "Again"]


def test_a_request_that_breaks_the_rules_is_refused() -> None:
    for sent, place in (
        *((b"", "the body"), (b"[" * 100_000, "the body"), (body(model=None), "model")),
        *((body(messages=[]), "messages"), (body(colour="red"), "colour")),
        *((body(stream=True), "stream"), (body(temperature="0"), "temperature")),
        (body(max_completion_tokens=0), "max_completion_tokens"),
        (body(messages=[HELLO | {"role": "robot"}]), "messages.0.role"),
        (body(messages=[HELLO | {"content": " "}]), "messages.0.content"),
        (body(messages=[HELLO, {"role": "assistant", "content": "Hi"}]), "messages"),
        (body(messages=[HELLO | {"role": "tool", "tool_call_id": "c1"}]), "messages.0"),
        (
            body(messages=[HELLO | {"content": [PNG | {"image_url": {"url": "http://a/b.png"}}]}]),
            "messages.0.content",
        ),
    ):
        with pytest.raises(BadRequest, match=f"^{place}"):
            chat_request(sent)


MANAGE = Path(__file__).parents[2] / "manage.py"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_it_says_where_it_listens_and_stops_cleanly(number: signal.Signals) -> None:
    command = [sys.executable, str(MANAGE), "fake_llm", "--port", "0"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=os.environ
    ) as process:
        line = process.stdout.readline()
        assert "http://127.0.0.1:" in line
        port = int(line.rsplit(":", 1)[1].split("/")[0])
        socket.create_connection(("127.0.0.1", port), timeout=60).close()
        process.send_signal(number)
        out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (0, "")
    assert "has stopped" in out
