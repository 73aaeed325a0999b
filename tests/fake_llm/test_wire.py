from __future__ import annotations

import json

import pytest

from augment.fake_llm.wire import BadRequest, chat_request
from augment.llm.messages import Message, Request, Speaker, data_url
from augment.render.camera import camera_for
from tests.render.pictures import draw_original
from tests.scenes import scene

HELLO = {"role": "user", "content": "Hello"}
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


@pytest.mark.parametrize(
    ("sent", "param"),
    [
        (b"", None),
        (b"[" * 100_000, None),
        (b"[]", ""),
        (body(model=""), "model"),
        (body(model=None), "model"),
        (body(messages=[]), "messages"),
        (body(colour="red"), "colour"),
        (body(stream=True), "stream"),
        (body(temperature="0"), "temperature"),
        (body(temperature=3.0), "temperature"),
        (body(max_completion_tokens=0), "max_completion_tokens"),
        (body(messages=[HELLO | {"role": "robot"}]), "messages.0.role"),
        (body(messages=[HELLO | {"name": "x"}]), "messages.0.name"),
        (body(messages=[{"role": "user"}]), "messages.0.content"),
        (body(messages=[HELLO | {"content": " "}]), "messages.0.content"),
        (body(messages=[HELLO | {"content": []}]), None),
        (body(messages=[HELLO, {"role": "assistant", "content": "Hi"}]), "messages"),
        (
            body(messages=[{"role": "system", "content": [{"type": "text", "text": "a"}]}, HELLO]),
            "messages.0.content",
        ),
        (body(messages=[HELLO | {"content": [{"type": "audio"}]}]), None),
        (
            body(messages=[HELLO | {"content": [PNG | {"image_url": {"url": "http://a/b.png"}}]}]),
            None,
        ),
    ],
)
def test_a_request_that_breaks_the_rules_is_refused(sent: bytes, param: str | None) -> None:
    with pytest.raises(BadRequest) as raised:
        chat_request(sent)
    assert str(raised.value)
    if param is not None:
        assert raised.value.param == param
