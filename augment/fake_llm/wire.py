"""The OpenAI-compatible wire of the stand-in: requests that it takes, answers and errors.

Stricter than most servers on purpose: a client that passes here sends nothing odd.
"""

import base64
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from augment.llm.costs import least_tokens
from augment.prompts.blocks import Strict

Calls = tuple[tuple[str, str], ...]
"""Calls of functions: name and arguments as written."""

_PNG_URL = "data:image/png;base64,"
_CHARACTERS_PER_TOKEN = 4


class BadRequest(Exception):
    """The request breaks the wire's rules; the text says where."""


class _Text(Strict):
    type: Literal["text"]
    text: str


class _Url(Strict):
    url: Annotated[str, Field(pattern=f"^{_PNG_URL}")]


class _Picture(Strict):
    type: Literal["image_url"]
    image_url: _Url


class SpokenMessage(Strict):
    """One turn of the conversation."""

    role: Literal["system", "developer", "user", "assistant", "tool"]
    content: str | Annotated[list[_Text | _Picture], Field(min_length=1)] | None
    tool_calls: Annotated[list[dict[str, Any]], Field(min_length=1)] | None = None
    tool_call_id: str | None = None

    @property
    def text(self) -> str:
        """All text of the turn."""
        if isinstance(self.content, list):
            return "\n".join(part.text for part in self.content if isinstance(part, _Text))
        return self.content or ""

    @property
    def images(self) -> list[bytes]:
        """All pictures of the turn, PNG."""
        parts = self.content if isinstance(self.content, list) else []
        urls = [part.image_url.url for part in parts if isinstance(part, _Picture)]
        return [base64.b64decode(url.removeprefix(_PNG_URL)) for url in urls]


class ChatRequest(Strict):
    """The body of a POST to /v1/chat/completions."""

    model: Annotated[str, Field(min_length=1)]
    messages: Annotated[list[SpokenMessage], Field(min_length=1)]
    max_completion_tokens: Annotated[int, Field(ge=1)] | None = None
    max_tokens: Annotated[int, Field(ge=1)] | None = None
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    seed: int | None = None
    tools: Annotated[list[dict[str, Any]], Field(min_length=1)] | None = None
    tool_choice: Literal["auto", "none"] | None = None
    response_format: dict[Literal["type", "json_schema", "schema"], Any] | None = None
    stream: Literal[False] = False

    @property
    def tokens(self) -> int:
        """About as many tokens as the messages have."""
        return 1 + sum(_tokens(message.text) for message in self.messages)


@dataclass(frozen=True, slots=True, kw_only=True)
class Response:
    """HTTP response: a document as JSON."""

    document: object
    status: int = 200
    headers: Mapping[str, str] = field(default_factory=dict)


def chat_request(body: bytes) -> ChatRequest:
    """Return the request in that body.

    Raises:
        BadRequest: It is not one that this wire takes.
    """
    try:
        request = ChatRequest.model_validate_json(body)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False)[0]
        path = ".".join(str(part) for part in first["loc"])
        raise BadRequest(f"{path or 'the body'}: {first['msg']}") from None
    open_calls: list[str] = []
    for index, message in enumerate(request.messages):
        if not (message.text.strip() or message.tool_calls):
            raise BadRequest(f"messages.{index}.content is empty")
        if (message.role == "tool") != (message.tool_call_id in open_calls):
            raise BadRequest(f"messages.{index}.tool_call_id answers no open call")
        if message.tool_call_id:
            open_calls.remove(message.tool_call_id)
        open_calls += [call["id"] for call in message.tool_calls or ()]
    if open_calls or message.role not in ("user", "tool"):
        raise BadRequest("messages must end with a user's, and each call needs its result")
    return request


def completion(
    request: ChatRequest,
    text: str | None,
    *,
    finish_reason: str = "stop",
    refusal: str | None = None,
    calls: Calls = (),
    usage: tuple[int, int] | None = None,
) -> Response:
    """Return a chat completion; the same request and text give the same document.

    Args:
        request: What is answered.
        text: The answer, None without one.
        finish_reason: Why it ends; with calls it is theirs.
        refusal: Why there is no answer.
        calls: Of functions.
        usage: Tokens of prompt and answer, by default about as many as there are.
    """
    digest = hashlib.sha256((request.model_dump_json() + str(text)).encode()).hexdigest()
    message: dict[str, Any] = {"role": "assistant", "content": text, "refusal": refusal}
    if calls:
        finish_reason = "tool_calls"
        message["tool_calls"] = [
            {
                "id": f"call_{digest[:12]}_{number}",
                "type": "function",
                "function": {"name": name, "arguments": arguments},
            }
            for number, (name, arguments) in enumerate(calls)
        ]
    prompt, answer = usage or (request.tokens, 1 + _tokens(text or refusal or ""))
    choice = {"index": 0, "message": message, "finish_reason": finish_reason, "logprobs": None}
    return Response(
        document={
            "id": f"chatcmpl-{digest[:24]}",
            "object": "chat.completion",
            "created": 0,
            "model": request.model,
            "choices": [choice],
            "usage": {
                "prompt_tokens": prompt,
                "completion_tokens": answer,
                "total_tokens": prompt + answer,
            },
        }
    )


def error(
    status: int, message: str, code: str | None = None, headers: Mapping[str, str] | None = None
) -> Response:
    """Return a response with OpenAI's error body."""
    body = {"error": {"message": message, "type": "error", "param": None, "code": code}}
    return Response(document=body, status=status, headers=headers or {})


def _tokens(text: str) -> int:
    """Estimate tokens as a vocabulary counts: words of four characters, single numbers."""
    return max(len(text) // _CHARACTERS_PER_TOKEN, least_tokens(text))
