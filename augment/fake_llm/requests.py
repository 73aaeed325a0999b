"""The requests of the OpenAI-compatible wire as the stand-in takes them.

Stricter than most servers on purpose: a client that passes here sends nothing odd.
"""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from augment.fake_llm.png import size_of

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
        size_of(png)
        return url

    @property
    def size_px(self) -> tuple[int, int]:
        """Width and height."""
        return size_of(base64.b64decode(self.url.removeprefix(_PNG)))


class ImagePart(_Strict):
    """A picture in a message."""

    type: Literal["image_url"]
    image_url: ImageUrl


Part = Annotated[TextPart | ImagePart, Field(discriminator="type")]


class CalledFunction(_Strict):
    """A function with its arguments, a JSON text."""

    name: str
    arguments: str


class CalledTool(_Strict):
    """A call that an assistant made; what this server hung on it has to come back."""

    id: Annotated[str, Field(min_length=1)]
    type: Literal["function"]
    function: CalledFunction
    extra_content: dict[str, dict[str, str]]


class SpokenMessage(_Strict):
    """One turn of the conversation."""

    role: Literal["system", "developer", "user", "assistant", "tool"]
    content: str | Annotated[list[Part], Field(min_length=1)] | None
    tool_calls: Annotated[list[CalledTool], Field(min_length=1)] | None = None
    tool_call_id: str | None = None

    @property
    def text(self) -> str:
        """All text of the turn."""
        if self.content is None:
            return ""
        if isinstance(self.content, str):
            return self.content
        return "\n".join(part.text for part in self.content if isinstance(part, TextPart))

    @property
    def images(self) -> list[ImageUrl]:
        """All pictures of the turn."""
        parts = self.content if isinstance(self.content, list) else []
        return [part.image_url for part in parts if isinstance(part, ImagePart)]


class OfferedFunction(_Strict):
    """A function that may be called."""

    name: Annotated[str, Field(pattern=r"^[a-zA-Z0-9_-]{1,64}$")]
    description: str
    parameters: dict[str, object]


class OfferedTool(_Strict):
    """A tool that may be called."""

    type: Literal["function"]
    function: OfferedFunction


class NamedSchema(_Strict):
    """A JSON schema that the answer must fit."""

    name: Annotated[str, Field(pattern=r"^[a-zA-Z0-9_-]{1,64}$")]
    schema_: Annotated[dict[str, object], Field(alias="schema")]
    strict: bool = False


class ResponseFormat(_Strict):
    """The form of the answer."""

    type: Literal["json_schema"]
    json_schema: NamedSchema


class ChatRequest(_Strict):
    """The body of a POST to /v1/chat/completions."""

    model: Annotated[str, Field(min_length=1)]
    messages: Annotated[list[SpokenMessage], Field(min_length=1)]
    max_completion_tokens: Annotated[int, Field(ge=1)] | None = None
    max_tokens: Annotated[int, Field(ge=1)] | None = None
    temperature: Annotated[float, Field(ge=0.0, le=2.0)] | None = None
    seed: int | None = None
    tools: Annotated[list[OfferedTool], Field(min_length=1)] | None = None
    tool_choice: Literal["auto", "none"] | None = None
    response_format: ResponseFormat | None = None
    stream: Literal[False] = False


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
    for index, message in enumerate(request.messages):
        _check_turn(index, message)
    _check_calls(request)
    _check_end(request)
    return request


def signature_of(call_id: str) -> str:
    """What this server hangs on a call, and insists on getting back."""
    return hashlib.sha256(call_id.encode()).hexdigest()[:16]


def _check_turn(index: int, message: SpokenMessage) -> None:
    if not message.text.strip() and not message.tool_calls:
        raise BadRequest(f"messages.{index} is empty", f"messages.{index}.content")
    if message.role != "user" and isinstance(message.content, list):
        raise BadRequest("only a user shows images", f"messages.{index}.content")
    if message.tool_calls and message.role != "assistant":
        raise BadRequest("only an assistant calls tools", f"messages.{index}.tool_calls")
    if (message.role == "tool") != (message.tool_call_id is not None):
        raise BadRequest("a tool, and nobody else, names a call", f"messages.{index}.tool_call_id")


def _check_calls(request: ChatRequest) -> None:
    """Every call is answered once, right behind it, and comes back as it was made."""
    open_calls: list[str] = []
    for index, message in enumerate(request.messages):
        path = f"messages.{index}"
        if message.role == "tool":
            if message.tool_call_id not in open_calls:
                raise BadRequest("there is no such call", f"{path}.tool_call_id")
            open_calls.remove(message.tool_call_id)
            continue
        if open_calls:
            raise BadRequest(f"the call {open_calls[0]!r} is not answered", path)
        for call in message.tool_calls or []:
            if call.extra_content != {"fake": {"signature": signature_of(call.id)}}:
                raise BadRequest("the signature of a call is missing", f"{path}.tool_calls")
            open_calls.append(call.id)
    if open_calls:
        raise BadRequest(f"the call {open_calls[0]!r} is not answered", "messages")


def _check_end(request: ChatRequest) -> None:
    if request.messages[-1].role not in ("user", "tool"):
        raise BadRequest("the last message must be the user's", "messages")
    if request.tools is not None:
        if request.response_format is not None:
            raise BadRequest("tools and a schema of the answer exclude each other", "tools")
        return
    if request.tool_choice is not None:
        raise BadRequest("there are no tools to choose from", "tool_choice")
    if any(message.tool_calls for message in request.messages):
        raise BadRequest("tools are called and none is named", "tools")
