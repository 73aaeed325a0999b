"""Where a call was other than its contestant's options say, because of its endpoint or model.

In: a stored request and what it was made with. Out: a sentence for each change, for transcripts.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from augment.models import ModelCall, TranscriptNote
from augment.variants.options import ToolProtocol
from augment.variants.respondents import ModelRole, NoteKind

_OLD_NAME, _NEW_NAME = "max_tokens", "max_completion_tokens"
_SENT = ("temperature", "seed", "reasoning_effort")


def changes_of(
    call: ModelCall,
    *,
    options: Mapping[str, Any] | None,
    before: ModelCall | None,
    notes: Sequence[TranscriptNote],
) -> tuple[str, ...]:
    """What of a call was not as chosen.

    Args:
        call: Which one.
        options: With which its augmentation was made; None where that is not known.
        before: The call before it in its attempt.
        notes: What happened after it and before the next one.
    """
    return (
        *_refused(call, before),
        *_not_sent(call.request, options or {}),
        *_of_length(call.request, options or {}),
        *_of_protocol(call, options or {}, notes),
        *_of_model(call),
    )


# --- Private -----------------------------------------------------------------------------------


def _refused(call: ModelCall, before: ModelCall | None) -> list[str]:
    """What the same request had before it was refused."""
    if before is None or before.role != call.role or not before.fault or before.answer is not None:
        return []
    if before.request.get("messages") != call.request.get("messages"):
        return []
    gone = [name for name in before.request if name not in call.request]
    return [f"Sent again without {name}, which the endpoint refused." for name in gone]


def _not_sent(request: Mapping[str, Any], options: Mapping[str, Any]) -> list[str]:
    found = [
        (
            f"{name} was to be {_written(options[name])} and is not sent: the model does not "
            "take it."
        )
        for name in _SENT
        if name in options and name not in request
    ]
    effort = request.get("reasoning_effort")
    if effort is not None and "reasoning_effort" not in options:
        found.append(
            f"reasoning_effort {effort} is sent because it is entered for the model, "
            "not because it was chosen."
        )
    return found


def _of_length(request: Mapping[str, Any], options: Mapping[str, Any]) -> list[str]:
    found = []
    if _OLD_NAME in request:
        found.append(
            f"The limit of the answer is sent as {_OLD_NAME}: the endpoint refused {_NEW_NAME}."
        )
    wanted, sent = options.get("max_output_tokens"), request.get(_NEW_NAME, request.get(_OLD_NAME))
    if wanted is not None and sent is not None and sent < wanted:
        found.append(
            f"An answer may have {int(sent)} tokens, not {int(wanted)}: more the model does "
            "not give."
        )
    return found


def _of_protocol(
    call: ModelCall, options: Mapping[str, Any], notes: Sequence[TranscriptNote]
) -> list[str]:
    if call.role != ModelRole.MODIFIER:
        return []
    is_offered = bool(call.request.get("tools"))
    if options.get("protocol") == ToolProtocol.NATIVE and not is_offered:
        return ["The function was to be called natively and was not offered so."]
    has_called = any(note.kind == NoteKind.TOOL_CALL for note in notes)
    if is_offered and has_called and not (call.extras or {}).get("tool_calls"):
        return [
            ("The function was offered natively, and the model wrote its call into the answer.")
        ]
    return []


def _of_model(call: ModelCall) -> list[str]:
    asked, answered = str(call.request.get("model", "")), call.model_returned
    if not answered or asked.lower() in answered.lower() or answered.lower() in asked.lower():
        return []
    return [f"{asked} was asked and the endpoint says that {answered} answered."]


def _written(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
