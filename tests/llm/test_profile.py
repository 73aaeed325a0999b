from __future__ import annotations

from dataclasses import replace

import pytest

from augment.errors import ModelFault
from augment.llm.client import ModelProfile
from augment.llm.messages import AnswerSchema, Message, Request, Speaker, Tool

HELLO = Message(speaker=Speaker.USER, text="Hello")
SCHEMA = AnswerSchema(name="sum", schema={"type": "object"})
TOOL = Tool(name="double", description="Doubles.", parameters={"type": "object"})
ASKED = Request(model="m", messages=(HELLO,), temperature=0.0, seed=7, answer_schema=SCHEMA)


@pytest.mark.parametrize(
    ("parameter", "left_out"),
    [("temperature", "temperature"), ("seed", "seed"), ("response_format", "answer_schema")],
)
def test_what_was_refused_is_left_out(parameter: str, left_out: str) -> None:
    fitted = ModelProfile().without(parameter).fitted(ASKED)
    assert fitted == replace(ASKED, **{left_out: None})  # type: ignore[arg-type]
    assert parameter not in fitted.to_document()


def test_a_model_without_a_limit_of_the_length_is_not_asked() -> None:
    boundless = ModelProfile().without("max_completion_tokens").without("max_tokens")
    with pytest.raises(ModelFault, match="its cost has no bound") as caught:
        boundless.fitted(ASKED)
    assert not caught.value.retryable


def test_a_blind_model_is_shown_nothing() -> None:
    seen = replace(ASKED, messages=(replace(HELLO, images=(b"\x89PNG",)),))
    assert ModelProfile(vision=True).fitted(seen) == ModelProfile().fitted(seen) == seen
    with pytest.raises(ModelFault, match="m at this endpoint can't see pictures"):
        ModelProfile(vision=False).fitted(seen)


def test_tools_and_schemas_have_the_form_of_the_wire() -> None:
    assert ASKED.to_document()["response_format"] == {
        "type": "json_schema",
        "json_schema": {"name": "sum", "schema": {"type": "object"}, "strict": True},
    }
    armed = replace(ASKED, answer_schema=None, tools=(TOOL,))
    assert armed.to_document()["tools"] == [
        {
            "type": "function",
            "function": {
                "name": "double",
                "description": "Doubles.",
                "parameters": {"type": "object"},
            },
        }
    ]
