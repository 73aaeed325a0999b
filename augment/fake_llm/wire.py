"""The OpenAI-compatible wire of the stand-in: requests that it takes, answers and errors.

Stricter than most servers on purpose: a client that passes here sends nothing odd.
"""

import base64
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from augment.llm.costs import least_tokens

Calls = tuple[tuple[str, str], ...]
"""Calls of functions: name and arguments as written."""

_PNG_URL = "data:image/png;base64,"
_CHARACTERS_PER_TOKEN = 4


class BadRequest(Exception):
    """The request breaks the wire's rules; the text says where.

    Args:
        message: What is wrong.
        param: The path of the field, None where the whole body is meant.
    """

    def __init__(self, message: str, param: str | None = None) -> None:
        self.param = param
        super().__init__(message)


class _Strict(BaseModel):
    model_config = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False, frozen=True)


class SpokenMessage(_Strict):
    """One turn of the conversation."""

    role: Literal["system", "developer", "user", "assistant", "tool"]
    content: str | Annotated[list[dict[str, Any]], Field(min_length=1)] | None
    tool_calls: Annotated[list[dict[str, Any]], Field(min_length=1)] | None = None
    tool_call_id: str | None = None

    @property
    def parts(self) -> list[dict[str, Any]]:
        """Texts and pictures of the turn."""
        if isinstance(self.content, list):
            return self.content
        return [{"type": "text", "text": self.content or ""}]

    @property
    def text(self) -> str:
        """All text of the turn."""
        return "\n".join(part["text"] for part in self.parts if part["type"] == "text")

    @property
    def images(self) -> list[bytes]:
        """All pictures of the turn, PNG."""
        urls = [part["image_url"]["url"] for part in self.parts if part["type"] == "image_url"]
        return [base64.b64decode(url.removeprefix(_PNG_URL)) for url in urls]


class ChatRequest(_Strict):
    """The body of a POST to /v1/chat/completions."""

    model: Annotated[str, Field(min_length=1)]
    messages: Annotated[list[SpokenMessage], Field(min_length=1)]
    max_completion_tokens: Annotated[int, Field(ge=1)] | None = None
    max_tokens: Annotated[int, Field(ge=1)] | None = None
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    seed: int | None = None
    tools: Annotated[list[dict[str, Any]], Field(min_length=1)] | None = None
    tool_choice: Literal["auto", "none"] | None = None
    response_format: dict[str, object] | None = None
    stream: Literal[False] = False


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


def chat_request(body: bytes) -> ChatRequest:
    """Return the request in that body.

    Raises:
        BadRequest: It is not one that this wire takes.
    """
    try:
        document = json.loads(body)
    except (ValueError, RecursionError):
        raise BadRequest("the body is not JSON") from None
    try:
        request = ChatRequest.model_validate(document)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        path = ".".join(str(part) for part in first["loc"])
        raise BadRequest(f"{path}: {first['msg']}", path) from None
    _check_turns(request)
    has_calls = any(message.tool_calls for message in request.messages)
    _refuse(
        {
            "messages": request.messages[-1].role not in ("user", "tool"),
            "tools": request.tools is not None and request.response_format is not None,
            "tool_choice": request.tools is None and (bool(request.tool_choice) or has_calls),
        }
    )
    return request


def completion(
    request: ChatRequest,
    text: str | None,
    *,
    finish_reason: str = "stop",
    refusal: str | None = None,
    calls: Calls = (),
) -> dict[str, Any]:
    """Return a chat completion; the same request and text give the same document."""
    digest = hashlib.sha256((request.model_dump_json() + str(text)).encode()).hexdigest()
    message: dict[str, Any] = {"role": "assistant", "content": text, "refusal": refusal}
    if calls:
        finish_reason = "tool_calls"
        message["tool_calls"] = [
            _signed(f"{digest}:{number}", *call) for number, call in enumerate(calls)
        ]
    choice = {"index": 0, "message": message, "finish_reason": finish_reason, "logprobs": None}
    return {
        "id": f"chatcmpl-{digest[:24]}",
        "object": "chat.completion",
        "created": 0,
        "model": request.model,
        "choices": [choice],
        "usage": usage(prompt_tokens_of(request), 1 + _tokens(text or refusal or "")),
    }


def usage(prompt_tokens: int, completion_tokens: int) -> dict[str, int]:
    """Return the tokens of a completion as the wire tells them."""
    return {
        "prompt_tokens": prompt_tokens,
        "completion_tokens": completion_tokens,
        "total_tokens": prompt_tokens + completion_tokens,
    }


def prompt_tokens_of(request: ChatRequest) -> int:
    """Return about as many tokens as the messages have."""
    return 1 + sum(_tokens(message.text) for message in request.messages)


def as_json(document: object, **changes: Any) -> Response:
    """Return a response with that document as its body."""
    return Response(body=json.dumps(document).encode(), **changes)


def error(
    status: int,
    message: str,
    *,
    kind: str = "invalid_request_error",
    param: str | None = None,
    code: str | None = None,
    headers: Mapping[str, str] | None = None,
) -> Response:
    """Return a response with OpenAI's error body."""
    body = {"error": {"message": message, "type": kind, "param": param, "code": code}}
    return as_json(body, status=status, headers=headers or {})


# Private


def _refuse(faults: Mapping[str, bool], at: str = "") -> None:
    for name, is_wrong in faults.items():
        if is_wrong:
            raise BadRequest(f"{at}{name} can't be so in this request", f"{at}{name}")


def _check_turns(request: ChatRequest) -> None:
    """Check each turn, and that every call is answered once, right behind it, as it was made."""
    open_calls: list[str] = []
    for index, message in enumerate(request.messages):
        is_tool, calls = message.role == "tool", message.tool_calls or []
        faults = {
            "content": not all(map(_is_part, message.parts))
            or not (message.text.strip() or calls)
            or (message.role != "user" and isinstance(message.content, list)),
            "role": bool(open_calls) and not is_tool,
            "tool_calls": bool(calls and message.role != "assistant")
            or any(call.get("extra_content") != _signature(call.get("id", "")) for call in calls),
            "tool_call_id": is_tool != (message.tool_call_id is not None)
            or (is_tool and message.tool_call_id not in open_calls),
        }
        _refuse(faults, f"messages.{index}.")
        if is_tool:
            open_calls.remove(str(message.tool_call_id))
        open_calls += [call["id"] for call in calls]
    _refuse({"messages": bool(open_calls)})


def _is_part(part: dict[str, Any]) -> bool:
    match part:
        case {"type": "text", "text": str(), **rest}:
            return not rest
        case {"type": "image_url", "image_url": {"url": str() as url, **more}, **rest}:
            return url.startswith(_PNG_URL) and not more and not rest
    return False


def _signed(seed: str, name: str, arguments: str) -> dict[str, object]:
    call_id = f"call_{hashlib.sha256(seed.encode()).hexdigest()[:16]}"
    return {
        "id": call_id,
        "type": "function",
        "function": {"name": name, "arguments": arguments},
        "extra_content": _signature(call_id),
    }


def _signature(call_id: str) -> dict[str, dict[str, str]]:
    """Return what this server hangs on a call, and insists on getting back."""
    return {"fake": {"signature": hashlib.sha256(call_id.encode()).hexdigest()[:16]}}


def _tokens(text: str) -> int:
    """Estimate tokens as a vocabulary counts: words of four characters, single numbers."""
    return max(len(text) // _CHARACTERS_PER_TOKEN, least_tokens(text))
