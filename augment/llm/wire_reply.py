"""From whatever the `openai` package returns for a 200 to a Reply.

The package does not check what a server sent: an answer may be a plain `str`, have no choices,
or lack any field. So nothing here is taken on trust.
"""

from __future__ import annotations

import json

from augment.errors import ModelFault
from augment.llm.messages import Reply, ToolCall
from augment.llm.wire_faults import Secret


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
    return Reply(
        text=secret.out_of(_text(getattr(message, "content", None))),
        model=secret.out_of(_text(getattr(answer, "model", None)))[:120],
        finish_reason=secret.out_of(_text(getattr(choices[0], "finish_reason", None)))[:40],
        refusal=secret.out_of(refusal) if isinstance(refusal, str) and refusal else None,
        prompt_tokens=_count(getattr(usage, "prompt_tokens", None)),
        completion_tokens=_count(getattr(usage, "completion_tokens", None)),
        latency_s=latency_s,
        tool_calls=_tool_calls(getattr(message, "tool_calls", None), secret),
    )


def _tool_calls(calls: object, secret: Secret) -> tuple[ToolCall, ...]:
    """Those calls that name a function; their arguments stay as they came."""
    made = []
    for number, call in enumerate(calls if isinstance(calls, list) else [], start=1):
        function = getattr(call, "function", None)
        name = _text(getattr(function, "name", None))
        extra = getattr(call, "model_extra", None)
        if name:
            made.append(
                ToolCall(
                    # Some servers number no calls; the answer to one must name it.
                    id=secret.out_of(_text(getattr(call, "id", None))) or f"call_{number}",
                    name=secret.out_of(name),
                    arguments=secret.out_of(_text(getattr(function, "arguments", None))),
                    extra=secret.out_of(json.dumps(extra, sort_keys=True)) if extra else "",
                )
            )
    return tuple(made)


def _text(value: object) -> str:
    return value if isinstance(value, str) else ""


def _count(value: object) -> int | None:
    known = isinstance(value, int) and not isinstance(value, bool) and value >= 0
    return value if known and isinstance(value, int) else None
