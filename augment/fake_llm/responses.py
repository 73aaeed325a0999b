"""What the stand-in answers over the wire: completions, tool calls and errors."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from augment.fake_llm.requests import ChatRequest, signature_of
from augment.llm.costs import least_tokens

_CHARACTERS_PER_TOKEN = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """What goes back over HTTP.

    Attributes:
        wait_s: How long nothing is sent before.
        cut_at: After how many bytes of the body the connection drops; None sends all.
    """

    status: int = 200
    body: bytes = b""
    content_type: str = "application/json"
    headers: Mapping[str, str] = field(default_factory=dict)
    wait_s: float = 0.0
    cut_at: int | None = None


def tool_calls(calls: Sequence[tuple[str, str]], seed: str) -> list[dict[str, object]]:
    """Calls (name, arguments) in the form of the wire, numbered and signed."""
    entries: list[dict[str, object]] = []
    for number, (name, arguments) in enumerate(calls):
        digest = hashlib.sha256(f"{seed}:{number}".encode()).hexdigest()
        call_id = f"call_{digest[:16]}"
        entries.append(
            {
                "id": call_id,
                "type": "function",
                "function": {"name": name, "arguments": arguments},
                "extra_content": {"fake": {"signature": signature_of(call_id)}},
            }
        )
    return entries


def completion(
    request: ChatRequest,
    text: str | None,
    *,
    finish_reason: str = "stop",
    refusal: str | None = None,
    with_usage: bool = True,
    calls: Sequence[tuple[str, str]] = (),
) -> dict[str, object]:
    """A chat completion with that text; the same request and text give the same document."""
    prompt_tokens = prompt_tokens_of(request)
    completion_tokens = 1 + _tokens(text or refusal or "")
    digest = hashlib.sha256((request.model_dump_json() + str(text)).encode()).hexdigest()
    message: dict[str, object] = {"role": "assistant", "content": text, "refusal": refusal}
    if calls:
        message["tool_calls"] = tool_calls(calls, digest)
    document: dict[str, object] = {
        "id": f"chatcmpl-{digest[:24]}",
        "object": "chat.completion",
        "created": 0,
        "model": request.model,
        "choices": [
            {
                "index": 0,
                "message": message,
                "finish_reason": "tool_calls" if calls else finish_reason,
                "logprobs": None,
            }
        ],
    }
    if with_usage:
        document["usage"] = {
            "prompt_tokens": prompt_tokens,
            "completion_tokens": completion_tokens,
            "total_tokens": prompt_tokens + completion_tokens,
        }
    return document


def prompt_tokens_of(request: ChatRequest) -> int:
    """About as many tokens as the messages have."""
    return 1 + sum(_tokens(message.text) for message in request.messages)


def _tokens(text: str) -> int:
    """About as many as a vocabulary makes of it: words of four characters, single numbers."""
    return max(len(text) // _CHARACTERS_PER_TOKEN, least_tokens(text))


def as_json(document: object, **changes: object) -> Response:
    """A response with that document as its body."""
    body = json.dumps(document).encode()
    return Response(body=body, **changes)  # type: ignore[arg-type]


def error(
    status: int,
    message: str,
    *,
    kind: str = "invalid_request_error",
    param: str | None = None,
    code: str | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """A response with OpenAI's error body."""
    body = {"error": {"message": message, "type": kind, "param": param, "code": code}}
    return as_json(body, status=status, headers=headers or {})
