"""A transcript says where a call was other than chosen because of its endpoint or model."""

from __future__ import annotations

from typing import Any

import pytest

from augment.models import ModelCall, TranscriptNote
from augment.services.running.transcript_records import changes_of

pytestmark = pytest.mark.django_db

ASKED = {"model": "m", "messages": [{"role": "user", "content": "Go"}], "max_completion_tokens": 9}
TOOLS = {"tools": [{"type": "function"}]}
CALLED = TranscriptNote(kind="tool_call", document={})


def call(role: str = "modifier", *, lacks: str = "", **columns: Any) -> ModelCall:
    request = {**ASKED, **columns.pop("request", {})}
    request.pop(lacks, None)
    return ModelCall(role=role, request=request, **{"answer": "Yes.", "fault": "", **columns})


REFUSED = call(request={"temperature": 0.7}, answer=None, fault="HTTP 400: no temperature")


@pytest.mark.parametrize(
    ("made", "options", "before", "notes", "said"),
    [
        (call(), {}, None, [], ""),
        (call(request={"temperature": 0.7}), {"temperature": 0.7}, None, [], ""),
        (call(), {"temperature": 0.7}, None, [], "temperature was to be 0.7 and is not sent"),
        (call("viewer"), {"seed": 3}, None, [], "seed was to be 3 and is not sent"),
        (call(request={"reasoning_effort": "none"}), {}, None, [], "entered for the model"),
        (call(), {}, REFUSED, [], "Sent again without temperature, which the endpoint refused."),
        (call("viewer"), {}, REFUSED, [], ""),
        (call(request={"messages": []}), {}, REFUSED, [], ""),
        (
            call(request={"max_tokens": 9}, lacks="max_completion_tokens"),
            {},
            None,
            [],
            "is sent as max_tokens: the endpoint refused max_completion_tokens",
        ),
        (call(), {"max_output_tokens": 10}, None, [], "9 tokens, not 10"),
        (call(), {"max_output_tokens": 9}, None, [], ""),
        (call(), {"protocol": "native"}, None, [], "was to be called natively and was not"),
        (call("reviewer"), {"protocol": "native"}, None, [], ""),
        (call(request=TOOLS), {"protocol": "native"}, None, [], ""),
        (call(request=TOOLS), {}, None, [CALLED], "the model wrote its call into the answer"),
        (call(request=TOOLS, extras={"tool_calls": [{}]}), {}, None, [CALLED], ""),
        (call(), {}, None, [CALLED], ""),
        (call(model_returned="M-2026-11"), {}, None, [], ""),
        (call(model_returned="gpt-2"), {}, None, [], "the endpoint says that gpt-2 answered"),
    ],
)
def test_each_change_is_said_and_nothing_else(
    made: ModelCall,
    options: dict[str, Any],
    before: ModelCall | None,
    notes: list[TranscriptNote],
    said: str,
) -> None:
    found = changes_of(made, options=options, before=before, notes=notes)
    assert len(found) == bool(said)
    assert said in "".join(found)
