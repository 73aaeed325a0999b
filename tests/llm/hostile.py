"""The wire to servers that drip, swell and nest: what the tests of them ask and say."""

from __future__ import annotations

import json
from typing import Any

import pytest

from augment.errors import ModelFault
from augment.llm.messages import Message, Reply, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from tests.llm.raw_server import Say, head, speaking, whole
from tests.llm.recorder import GOOD

ASKED = Request(model="m", messages=(Message(speaker=Speaker.USER, text="Hello"),))
BODY = json.dumps(GOOD).encode()
LIMIT_S = 0.25

PACKED = (
    head("Transfer-Encoding: chunked", "Content-Encoding: gzip")
    + b"a\r\n\x1f\x8b\x08\0\0\0\0\0\0\0\r\n"
)
EMPTY_BLOCK = b"5\r\n\0\0\0\xff\xff\r\n"
"""The beginning of a packed answer, and a piece that unpacks to nothing."""


def ask(say: Say, *, reads: bool = True, asked: Request = ASKED, **settings: Any) -> Reply:
    settings = {"timeout_s": 20.0, "api_key": None} | settings
    with (
        speaking(say, reads=reads) as server,
        OpenAIWire(base_url=server.url, **settings) as client,
    ):
        return client.complete(asked)


def fault(say: Say, **settings: Any) -> ModelFault:
    with pytest.raises(ModelFault) as raised:
        ask(say, **settings)
    return raised.value


def answered(body: object) -> Reply:
    return ask(whole(json.dumps(body).encode()))


def message(**parts: object) -> dict[str, object]:
    said = {"role": "assistant", "content": "Hi"} | parts
    return GOOD | {"choices": [{"index": 0, "finish_reason": "stop", "message": said}]}
