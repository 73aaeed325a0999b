"""What the stand-in makes of a conversation: its role, the results of its calls, the feedback.

Everything comes from the request alone.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import dataclass

from augment.fake_llm.requests import ChatRequest, SpokenMessage
from augment.prompts.fill import read_text
from augment.variants.transcript import ModelRole

_RESULT = read_text("function_result.md").partition("\n")[0]
_FEEDBACK = tuple(
    read_text(name).partition("{{")[0].strip() for name in ("feedback.md", "measured.md")
)


_OPENINGS = {read_text(f"{part}.md").partition("\n")[0]: part for part in ModelRole}


@dataclass(frozen=True, slots=True, kw_only=True)
class Heard:
    """A conversation, understood.

    Attributes:
        part: Whom it is asked to be.
        may_call: Whether it can have a function called now.
        is_native: Whether natively.
        results: Of the calls since the last feedback, in order; None for one that failed.
        called: Whether it has called anything since then.
        feedback: What reviews sent back so far.
    """

    part: ModelRole
    may_call: bool = False
    is_native: bool = False
    results: tuple[dict[str, object] | None, ...] = ()
    called: bool = False
    feedback: tuple[str, ...] = ()


def read_conversation(request: ChatRequest) -> Heard:
    """What the conversation says about the answer that is due; by default a modifier's."""
    system = next((message.text for message in request.messages if message.role == "system"), "")
    part = _OPENINGS.get(system.partition("\n")[0], ModelRole.MODIFIER)
    feedback = [message.text for message in request.messages if _is_feedback(message)]
    start = max((n for n, one in enumerate(request.messages) if _is_feedback(one)), default=0)
    since = request.messages[start:]
    native = request.tools is not None
    offered = request.tool_choice != "none" if native else '{"call": "pose_on_lane"' in system
    over = read_text("calls_are_over.md") in request.messages[-1].text
    asked_again = request.messages[-1].text.startswith(read_text("re_ask.md").partition("\n")[0])
    return Heard(
        part=part,
        may_call=offered and not over and not asked_again,
        is_native=native,
        results=tuple(_results(since)),
        called=any(one.role == "tool" or one.text.startswith(_RESULT) for one in since),
        feedback=tuple(feedback),
    )


def _is_feedback(message: SpokenMessage) -> bool:
    return message.role == "user" and message.text.startswith(_FEEDBACK)


def _results(messages: Sequence[SpokenMessage]) -> list[dict[str, object] | None]:
    results: list[dict[str, object] | None] = []
    for message in messages:
        if message.role == "tool":
            results.append(_result(message.text))
        elif message.role == "user" and message.text.startswith(_RESULT):
            lines = re.findall(r"^[0-9]+\. (\{.*\})$", message.text, re.MULTILINE)
            results += [_result(line) for line in lines]
    return results


def _result(written: str) -> dict[str, object] | None:
    try:
        result = json.loads(written)
    except ValueError:
        return None
    return None if not isinstance(result, dict) or "error" in result else result
