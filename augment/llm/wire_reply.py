"""From whatever the `openai` package returns for a 200 to a Reply.

The package does not check what a server sent: an answer may be a plain `str`, have no choices,
or lack any field. So nothing here is taken on trust. What is no answer to be read as a whole (a
refusal, calls of tools) is cut here, at the border, so that a run and its replay from the store
see the same.
"""

from __future__ import annotations

import json

from augment.errors import ModelFault
from augment.llm.cutting import shorten
from augment.llm.messages import Reply, ToolCall
from augment.llm.wire_faults import Secret

LONGEST_REFUSAL = 4_000
LONGEST_NAME = 200
LONGEST_ARGUMENTS = 10_000
"""Of one call, in characters."""

LONGEST_EXTRA = 100_000
"""What hangs on a call goes back as it came, so it can't be cut: longer ones are left out."""

MOST_CALLS = 64
"""Of one answer."""

MOST_TOKENS = 100_000_000
"""A count beyond is none: no model reads or writes so much at once."""


def reply_of(answer: object, *, latency_s: float, secret: Secret) -> Reply:
    """The reply in an answer of the package.

    Args:
        answer: A `ChatCompletion`, or what came instead of one.
        latency_s: How long it took.
        secret: Is taken out of every text, should a server echo it.

    Raises:
        ModelFault: It is no completion.
    """
    if isinstance(answer, str):
        raise ModelFault(
            "the endpoint answered with a page of text instead of JSON: is its base URL right?",
            retryable=False,
            status=200,
        )
    choices = getattr(answer, "choices", None)
    if not isinstance(choices, list) or not choices:
        raise ModelFault("the endpoint answered without a choice", retryable=True, status=200)
    message = getattr(choices[0], "message", None)
    if message is None:
        raise ModelFault("the endpoint answered without a message", retryable=True, status=200)
    usage = getattr(answer, "usage", None)
    refusal = getattr(message, "refusal", None)
    calls = _tool_calls(getattr(message, "tool_calls", None), secret)
    return Reply(
        text=secret.out_of(_text(getattr(message, "content", None))),
        model=shorten(secret.out_of(_text(getattr(answer, "model", None))), 120),
        finish_reason=shorten(
            secret.out_of(_text(getattr(choices[0], "finish_reason", None))), 40
        ),
        refusal=shorten(secret.out_of(_text(refusal)), LONGEST_REFUSAL) or None,
        prompt_tokens=_count(getattr(usage, "prompt_tokens", None)),
        completion_tokens=_count(getattr(usage, "completion_tokens", None)),
        latency_s=latency_s,
        tool_calls=calls[:MOST_CALLS],
        calls_left_out=len(calls[MOST_CALLS:]),
    )


def _tool_calls(calls: object, secret: Secret) -> tuple[ToolCall, ...]:
    """Those calls that name a function; their arguments stay as they came."""
    made = []
    for number, call in enumerate(calls if isinstance(calls, list) else [], start=1):
        function = getattr(call, "function", None)
        name = _text(getattr(function, "name", None))
        if name:
            made.append(
                ToolCall(
                    # Some servers number no calls; the answer to one must name it.
                    id=shorten(secret.out_of(_text(getattr(call, "id", None))), LONGEST_NAME)
                    or f"call_{number}",
                    name=shorten(secret.out_of(name), LONGEST_NAME),
                    arguments=shorten(
                        secret.out_of(_text(getattr(function, "arguments", None))),
                        LONGEST_ARGUMENTS,
                    ),
                    extra=_extra(getattr(call, "model_extra", None), secret),
                )
            )
    return tuple(made)


def _extra(extra: object, secret: Secret) -> str:
    """What else hangs on a call, as JSON; empty where there is nothing, or too much."""
    text = secret.out_of(json.dumps(extra, sort_keys=True)) if extra else ""
    return text if len(text) <= LONGEST_EXTRA else ""


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _count(value: object) -> int | None:
    """A count of tokens, None where it can't be one; some servers write whole numbers as 12.0."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int):
        return None
    return value if 0 <= value <= MOST_TOKENS else None
