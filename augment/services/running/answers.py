"""The store of answers: what a request was answered before, and how an answer becomes a row.

Faults are no answers and are never served. What was served is served again from its source.
"""

from __future__ import annotations

from dataclasses import asdict
from datetime import datetime
from typing import Any

from augment.llm.messages import Reply, ToolCall
from augment.models import ModelCall
from augment.services.texts import make_document_storable, make_storable

_COPIED = ("answer", "refusal", "extras", "model_returned", "finish_reason")
_COUNTS = ("prompt_tokens", "completion_tokens")


def find_earlier_answer(
    *,
    request_hash: str,
    augmentation_pk: int,
    attempt_pk: int,
    is_fresh: bool,
    since: datetime | None = None,
) -> ModelCall | None:
    """The last call that answered the same request, None where it is to be asked.

    Args:
        request_hash: Of the request.
        augmentation_pk: The row that asks; an attempt that was stopped is replayed for it.
        attempt_pk: The attempt that asks.
        is_fresh: Whether only that replay counts: each earlier answer once, none of this attempt.
        since: The row is asked anew: as if fresh, and no answer from before counts.
    """
    calls = ModelCall.objects.filter(
        request_hash=request_hash, served_from=None, answer__isnull=False, fault=""
    )
    if since is not None:
        calls = calls.filter(started_at__gte=since)
    if is_fresh or since is not None:
        calls = (
            calls.filter(attempt__augmentation=augmentation_pk)
            .exclude(attempt=attempt_pk)
            .exclude(copies__attempt=attempt_pk)
        )
    return calls.order_by("-pk").first()


def columns_of(reply: Reply) -> dict[str, Any]:
    """The answer as columns of its call; a refusal that says nothing else is the answer."""
    return {
        "answer": make_storable(reply.text or reply.refusal or ""),
        "refusal": None if reply.refusal is None else make_storable(reply.refusal),
        "extras": _extras_of(reply),
        "model_returned": make_storable(reply.model)[:120],
        "finish_reason": make_storable(reply.finish_reason)[:40],
        "prompt_tokens": reply.prompt_tokens,
        "completion_tokens": reply.completion_tokens,
        "latency_s": reply.latency_s,
    }


def reply_of(call: ModelCall) -> Reply:
    """The answer that a call had, as it would come again; it took no time."""
    return Reply(
        text=call.answer or "",
        model=call.model_returned,
        finish_reason=call.finish_reason,
        refusal=call.refusal,
        tool_calls=tuple(ToolCall(**made) for made in (call.extras or {}).get("tool_calls", [])),
        prompt_tokens=call.prompt_tokens,
        completion_tokens=call.completion_tokens,
    )


def columns_of_copy(source: ModelCall, *, now: datetime) -> dict[str, Any]:
    """A call that was answered from another one: the same answer, and nothing spent."""
    copied = {name: getattr(source, name) for name in (*_COPIED, *_COUNTS)}
    nothing = {"spent_tokens": 0, "cost_nano_usd": 0, "started_at": now, "settled_at": now}
    return copied | nothing | {"served_from_id": source.served_from_id or source.pk}


# --- Private -----------------------------------------------------------------------------------


def _extras_of(reply: Reply) -> dict[str, Any] | None:
    """What a reply carries beside its text, None for most."""
    if not reply.tool_calls:
        return None
    extras: dict[str, Any] = {"tool_calls": [asdict(made) for made in reply.tool_calls]}
    if reply.calls_left_out:
        extras["calls_left_out"] = reply.calls_left_out
    return dict(make_document_storable(extras))
