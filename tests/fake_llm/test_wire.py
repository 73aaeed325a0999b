from __future__ import annotations

import json

import pytest

from augment.fake_llm.wire import BadRequest, chat_request, completion
from augment.llm.messages import Message, Request, Speaker

HELLO = {"role": "user", "content": "Hello"}
PNG = {"type": "image_url", "image_url": {"url": "data:image/png;base64,iVBORw0KGgo="}}


def body(**changes: object) -> bytes:
    document = {"model": "fake-good", "messages": [HELLO]} | changes
    return json.dumps(document).encode()


def test_what_our_own_client_sends_is_accepted() -> None:
    messages = (
        Message(speaker=Speaker.SYSTEM, text="Be good."),
        Message(speaker=Speaker.USER, text="Look", images=(b"\x89PNG",)),
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


def test_an_image_must_be_a_png_in_base64() -> None:
    text = {"type": "text", "text": "Look"}
    assert chat_request(body(messages=[HELLO | {"content": [text, PNG]}]))
    for url in ("data:image/png;base64,!", "data:image/png;base64,AAAA"):
        with pytest.raises(BadRequest):
            chat_request(
                body(messages=[HELLO | {"content": [text, PNG | {"image_url": {"url": url}}]}])
            )


def test_tokens_are_counted_from_what_was_said() -> None:
    request = chat_request(body(messages=[HELLO | {"content": "x" * 400}]))
    usage = completion(request, "y" * 40)["usage"]
    assert usage == {"prompt_tokens": 101, "completion_tokens": 11, "total_tokens": 112}
