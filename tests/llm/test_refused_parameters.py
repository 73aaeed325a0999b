"""What a 400 is about: a parameter that the request can do without, or something else."""

from __future__ import annotations

import pytest

from augment.errors import ModelFault, ParameterRefused
from augment.llm.messages import Message, Request, Speaker
from augment.llm.openai_wire import OpenAIWire
from tests.llm.recorder import recorder

KEY = "sk-planted-4f7a9c0d1e2b3a"
ASKED = Request(
    model="m", messages=(Message(speaker=Speaker.USER, text="Hello"),), temperature=0.0, seed=7
)


def error(message: str, param: str | None = None, code: str | None = None) -> object:
    return {"error": {"message": message, "type": "x", "param": param, "code": code}}


def fault(body: object, status: int = 400) -> ModelFault:
    with (
        recorder(status, body) as server,
        OpenAIWire(base_url=server.url, api_key=KEY) as client,
        pytest.raises(ModelFault) as caught,
    ):
        client.complete(ASKED)
    return caught.value


@pytest.mark.parametrize(
    ("body", "parameter"),
    [
        (error("Only the default (1) is supported.", "temperature"), "temperature"),
        (
            error("Unsupported parameter", "max_completion_tokens", "unsupported_parameter"),
            "max_completion_tokens",
        ),
        (error("Unknown field max_completion_tokens."), "max_completion_tokens"),
        ([error('Invalid JSON payload. Unknown name "seed": Cannot find field.')], "seed"),
        (error("[{'loc': ('body', 'seed'), 'msg': 'Extra inputs are not permitted'}]"), "seed"),
    ],
)
@pytest.mark.parametrize("status", [400, 422])
def test_a_parameter_that_is_not_taken_is_named(body: object, parameter: str, status: int) -> None:
    refused = fault(body, status)
    assert isinstance(refused, ParameterRefused)
    assert (refused.parameter, refused.status, refused.retryable) == (parameter, status, True)


@pytest.mark.parametrize(
    "body",
    [
        error("max_completion_tokens is too large: 8192.", "max_completion_tokens"),
        error("'max_tokens' or 'max_completion_tokens' is too large: 8192."),
        error("Too long.", "messages", "context_length_exceeded"),
        error("Not supported.", "response_format"),
        error("Something is wrong."),
        {},
        "nonsense",
    ],
)
def test_what_the_request_can_not_do_without_is_another_fault(body: object) -> None:
    other = fault(body)
    assert not isinstance(other, ParameterRefused)
    assert not other.retryable


def test_a_key_that_is_echoed_is_taken_out() -> None:
    refused = fault(error(f"seed is not known to {KEY}", "seed"))
    assert isinstance(refused, ParameterRefused)
    assert KEY not in str(refused)
