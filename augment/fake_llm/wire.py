"""The OpenAI-compatible wire as the stand-in speaks it: requests checked, answers composed.

Stricter than most servers on purpose: a client that passes here sends nothing odd.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from augment.llm.window import least_tokens

_CHARACTERS_PER_TOKEN = 4
_PNG = "data:image/png;base64,"


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


class TextPart(_Strict):
    """A piece of text in a message."""

    type: Literal["text"]
    text: str


class ImageUrl(_Strict):
    """A PNG as a data URL."""

    url: str
    detail: Literal["auto", "low", "high"] = "auto"

    @field_validator("url")
    @classmethod
    def _is_png(cls, url: str) -> str:
        if not url.startswith(_PNG):
            raise ValueError("only data:image/png;base64 is understood")
        try:
            png = base64.b64decode(url.removeprefix(_PNG), validate=True)
        except binascii.Error:
            raise ValueError("the image is not base64") from None
        if not png.startswith(b"\x89PNG"):
            raise ValueError("the image is not a PNG")
        return url


class ImagePart(_Strict):
    """A picture in a message."""

    type: Literal["image_url"]
    image_url: ImageUrl


Part = Annotated[TextPart | ImagePart, Field(discriminator="type")]


class SpokenMessage(_Strict):
    """One turn of the conversation."""

    role: Literal["system", "developer", "user", "assistant"]
    content: str | Annotated[list[Part], Field(min_length=1)]

    @property
    def text(self) -> str:
        """All text of the turn."""
        if isinstance(self.content, str):
            return self.content
        return "\n".join(part.text for part in self.content if isinstance(part, TextPart))


class ChatRequest(_Strict):
    """The body of a POST to /v1/chat/completions."""

    model: Annotated[str, Field(min_length=1)]
    messages: Annotated[list[SpokenMessage], Field(min_length=1)]
    max_completion_tokens: Annotated[int, Field(ge=1)] | None = None
    max_tokens: Annotated[int, Field(ge=1)] | None = None
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    seed: int | None = None
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
    """The request in that body.

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
    if request.messages[-1].role != "user":
        raise BadRequest("the last message must be the user's", "messages")
    for index, message in enumerate(request.messages):
        if not message.text.strip():
            raise BadRequest(f"messages.{index} is empty", f"messages.{index}.content")
        if message.role != "user" and not isinstance(message.content, str):
            raise BadRequest("only a user shows images", f"messages.{index}.content")
    return request


def completion(
    request: ChatRequest,
    text: str | None,
    *,
    finish_reason: str = "stop",
    refusal: str | None = None,
    with_usage: bool = True,
) -> dict[str, object]:
    """A chat completion with that text; the same request and text give the same document."""
    prompt_tokens = 1 + sum(_tokens(message.text) for message in request.messages)
    completion_tokens = 1 + _tokens(text or refusal or "")
    digest = hashlib.sha256((request.model_dump_json() + str(text)).encode()).hexdigest()
    made: dict[str, object] = {
        "id": f"chatcmpl-{digest[:24]}",
        "object": "chat.completion",
        "created": 0,
        "model": request.model,
        "choices": [
            {
                "index": 0,
                "message": {"role": "assistant", "content": text, "refusal": refusal},
                "finish_reason": finish_reason,
                "logprobs": None,
            }
        ],
    }
    if with_usage:
        made["usage"] = {
            "prompt_tokens": prompt_tokens,
            "completion_tokens": completion_tokens,
            "total_tokens": prompt_tokens + completion_tokens,
        }
    return made


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
