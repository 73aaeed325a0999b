from __future__ import annotations

import base64

from augment.llm.messages import Message, Reply, Request, Speaker


def test_a_request_says_only_what_was_asked_for() -> None:
    request = Request(model="m", messages=(Message(speaker=Speaker.USER, text="Hello"),))
    assert request.to_document() == {
        "model": "m",
        "messages": [{"role": "user", "content": "Hello"}],
        "max_completion_tokens": 8192,
    }


def test_an_image_goes_as_a_png_data_url_after_the_text() -> None:
    message = Message(speaker=Speaker.USER, text="Look", images=(b"\x89PNG",))
    content = message.to_document()["content"]
    assert isinstance(content, list)
    assert [part["type"] for part in content] == ["text", "image_url"]
    url = content[1]["image_url"]["url"]
    assert base64.b64decode(url.removeprefix("data:image/png;base64,")) == b"\x89PNG"


def test_an_answer_that_ran_into_its_limit_is_cut_off() -> None:
    assert Reply(text="a", finish_reason="length").is_cut_off
    assert not Reply(text="a", finish_reason="stop").is_cut_off
