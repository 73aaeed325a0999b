"""Whether bytes are a whole picture: every chunk intact, every row there."""

from __future__ import annotations

import base64
import binascii
import hashlib
import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError, field_validator

from augment.llm.costs import least_tokens

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_CHANNELS = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
_MOST_PIXELS = 16_000_000


def size_of(png: bytes) -> tuple[int, int]:
    """Width and height in pixels of a PNG that can be decoded to its last row.

    Raises:
        ValueError: It can't be; the text says why.
    """
    if not png.startswith(_SIGNATURE):
        raise ValueError("the image is not a PNG")
    try:
        header, packed = _chunks(png)
        width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", header)
        if not 0 < width * height <= _MOST_PIXELS or colour not in _CHANNELS or interlaced:
            raise ValueError("the PNG has a form that is not taken")
        row = 1 + (width * depth * _CHANNELS[colour] + 7) // 8
        rows = zlib.decompressobj().decompress(packed, row * height + 1)
    except (struct.error, zlib.error):
        raise ValueError("the PNG is damaged") from None
    if len(rows) != row * height or max(rows[::row]) > 4:
        raise ValueError("the PNG lacks rows or has too many")
    return width, height


def _chunks(png: bytes) -> tuple[bytes, bytes]:
    """The header and the packed rows; every checksum is looked at."""
    header, packed, at = b"", b"", len(_SIGNATURE)
    while True:
        length, kind = struct.unpack_from(">I4s", png, at)
        data = png[at + 8 : at + 8 + length]
        (checksum,) = struct.unpack_from(">I", png, at + 8 + length)
        if checksum != zlib.crc32(kind + data):
            raise ValueError("a checksum of the PNG is wrong")
        if kind == b"IEND":
            return header, packed
        header = data if kind == b"IHDR" else header
        packed += data if kind == b"IDAT" else b""
        at += 12 + length


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
