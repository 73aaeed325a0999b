"""Messages to and from a language model, in no vendor's words.

Everything that is stored, replayed or shown goes through these values.
"""

import base64
import hashlib
import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from enum import StrEnum
from typing import Any

from augment.llm.vendors import says

DEFAULT_MAX_TOKENS = 8192
CALL_FIELDS = ("id", "type", "function")
MESSAGE_FIELDS = ("role", "content", "tool_calls", "tool_call_id")


ImageUrl = Callable[[bytes], str]
"""How an image is written into a document: on the wire as the image itself."""


def data_url(png: bytes) -> str:
    """The image itself as a URL."""
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


class Speaker(StrEnum):
    """Speaker of a message in a conversation."""

    SYSTEM = "system"
    USER = "user"
    ASSISTANT = "assistant"
    TOOL = "tool"


@dataclass(frozen=True, slots=True, kw_only=True)
class ToolCall:
    """A function that the model wants called.

    Attributes:
        arguments: The JSON text as it came; it may be broken.
        extra: What else the endpoint hung on the call, such as a signature of the model's
            thoughts, as JSON; some endpoints refuse the next request where it does not come back.
    """

    id: str
    name: str
    arguments: str
    extra: str = ""

    def to_document(self) -> dict[str, object]:
        """The call in the form of the OpenAI-compatible wire, with all that hung on it."""
        function = {"name": self.name, "arguments": self.arguments}
        document: dict[str, object] = json.loads(self.extra or "{}")
        return document | {"id": self.id, "type": "function", "function": function}


@dataclass(frozen=True, slots=True, kw_only=True)
class Message:
    """One turn of a conversation.

    Attributes:
        images: PNG files that go with the text, in order; only a user shows images.
        calls: Of tools, made by an assistant.
        answers: The id of the call that a tool's message answers, empty for all others.
        extra: What has to come back beside an assistant's calls, as `Reply.extra` has it.
    """

    speaker: Speaker
    text: str
    images: tuple[bytes, ...] = ()
    calls: tuple[ToolCall, ...] = ()
    answers: str = ""
    extra: str = ""

    def to_document(self, *, image_url: ImageUrl = data_url) -> dict[str, object]:
        """The message in the form of the OpenAI-compatible wire."""
        document: dict[str, object] = {"role": self.speaker.value, "content": self.text}
        if self.calls:
            # Several servers refuse an empty text beside calls.
            calls = [call.to_document() for call in self.calls]
            document |= json.loads(self.extra or "{}")
            return document | {"content": self.text or None, "tool_calls": calls}
        if self.answers:
            return document | {"tool_call_id": self.answers}
        if not self.images:
            return document
        parts: list[dict[str, object]] = [{"type": "text", "text": self.text}]
        parts += [{"type": "image_url", "image_url": {"url": image_url(i)}} for i in self.images]
        return {"role": self.speaker.value, "content": parts}


def message_from_document(document: Mapping[str, Any]) -> Message:
    """Return the message that `to_document` wrote, for one without images."""
    return Message(
        speaker=Speaker(document["role"]),
        text=document["content"] or "",
        calls=tuple(
            ToolCall(id=call["id"], **call["function"], extra=extra_of(call, CALL_FIELDS))
            for call in document.get("tool_calls", ())
        ),
        answers=document.get("tool_call_id", ""),
        extra=extra_of(document, MESSAGE_FIELDS),
    )


def extra_of(document: Mapping[str, object], read: Collection[str]) -> str:
    """Return what a document has beside the fields that are read, as JSON; empty for nothing."""
    rest = {name: value for name, value in document.items() if name not in read}
    return json.dumps(rest, sort_keys=True) if rest else ""


class LengthName(StrEnum):
    """Name on the wire of the limit on the answer's length; old servers know one."""

    MAX_COMPLETION_TOKENS = "max_completion_tokens"
    MAX_TOKENS = "max_tokens"


class SchemaForm(StrEnum):
    """Form in which a request asks for an answer by a JSON schema; servers know one, or none."""

    JSON_SCHEMA = "json_schema"
    JSON_OBJECT = "json_object"

    def to_document(self, schema: Mapping[str, object]) -> dict[str, object]:
        """Return the request's `response_format`: OpenAI's, or that of llama-cpp-python."""
        if self is SchemaForm.JSON_OBJECT:
            return {"type": self.value, "schema": schema}
        named = {"name": "block", "strict": True, "schema": schema}
        return {"type": self.value, self.value: named}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tool:
    """A function that a model may call.

    Attributes:
        parameters: A JSON schema of its arguments.
    """

    name: str
    description: str
    parameters: dict[str, object]

    def to_document(self) -> dict[str, object]:
        """The tool in the form of the OpenAI-compatible wire."""
        return {"type": "function", "function": asdict(self)}


class ToolChoice(StrEnum):
    """Permission of a model to call the tools that a request names."""

    AUTO = "auto"
    NONE = "none"


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """One question to one model; it knows neither address nor key.

    Attributes:
        max_tokens: The most that the answer may have, reasoning included.
        temperature, seed, reasoning_effort: Left out of the request where None.
        tools: What the model may call natively.
        tool_choice: Counts only where there are tools.
        schema: A JSON schema that the answer has to obey, None for free text.
        schema_form: Counts only where there is a schema.
    """

    model: str
    messages: tuple[Message, ...]
    max_tokens: int = DEFAULT_MAX_TOKENS
    temperature: float | None = None
    seed: int | None = None
    reasoning_effort: str | None = None
    tools: tuple[Tool, ...] = ()
    tool_choice: ToolChoice = ToolChoice.AUTO
    length_name: LengthName = LengthName.MAX_COMPLETION_TOKENS
    schema: Mapping[str, object] | None = None
    schema_form: SchemaForm = SchemaForm.JSON_SCHEMA

    def to_document(self, *, image_url: ImageUrl = data_url) -> dict[str, object]:
        """The body of the request on the OpenAI-compatible wire, ready for JSON."""
        document: dict[str, object] = {
            "model": self.model,
            "messages": [message.to_document(image_url=image_url) for message in self.messages],
            self.length_name.value: self.max_tokens,
        }
        for name in ("temperature", "seed", "reasoning_effort"):
            value = getattr(self, name)
            if value is not None:
                document[name] = value
        if self.tools:
            document["tools"] = [tool.to_document() for tool in self.tools]
            document["tool_choice"] = self.tool_choice.value
        if self.schema is not None:
            document["response_format"] = self.schema_form.to_document(self.schema)
        return document


@dataclass(frozen=True, slots=True, kw_only=True)
class Reply:
    """One answer as it came, before anybody reads it. Unknown is None, never zero.

    Attributes:
        text: The answer, empty where the model said nothing.
        model: The model id that the server named, empty where it named none.
        finish_reason: Why the model stopped ("stop", "length", ...), empty where unknown.
        refusal: What the model, or a filter, said when it declined; None where neither did.
        cached_tokens: So many of the prompt's came from the endpoint's cache.
        tool_calls: What the model wants called natively.
        reasoning: What the model thought aloud, apart from its answer.
        extra: Thoughts that several endpoints insist on getting back with the calls, as JSON.
        remarks: What of the answer was not understood, or contradicts what was sent.
        latency_s: From sending the request to the whole answer.
    """

    text: str
    model: str = ""
    finish_reason: str = ""
    refusal: str | None = None
    prompt_tokens: int | None = None
    completion_tokens: int | None = None
    latency_s: float | None = None
    tool_calls: tuple[ToolCall, ...] = ()
    cached_tokens: int | None = None
    reasoning: str = ""
    extra: str = ""
    remarks: tuple[str, ...] = ()

    @property
    def is_cut_off(self) -> bool:
        """True if the answer stopped at its length limit."""
        return says("cut_off", self.finish_reason)

    @property
    def is_withheld(self) -> bool:
        """True if the endpoint's filter withheld the answer."""
        return says("withheld", self.finish_reason)


IMAGE_SCHEME = "sha256:"


def image_reference(png: bytes) -> str:
    """Return an image's name in a stored request: the hash of its bytes."""
    return IMAGE_SCHEME + hashlib.sha256(png).hexdigest()


def request_hash(
    *,
    base_url: str,
    document: dict[str, object],
    prompt_version: str,
    options: Mapping[str, object] | None = None,
) -> str:
    """The SHA-256 of everything that an answer depends on, as 64 hexadecimal digits.

    Args:
        base_url: Where the request goes.
        document: The stored request: model, messages with references to images, parameters.
        prompt_version: Of the texts that the messages were made from.
        options: What else keeps answers apart: options of who asks, the number of the sample.
    """
    content: dict[str, object] = {
        "base_url": base_url.rstrip("/"),
        "prompt_version": prompt_version,
        "request": document,
    }
    if options:
        content["options"] = dict(options)
    canonical = json.dumps(content, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(canonical.encode("ascii")).hexdigest()


def shorten(text: str, most: int) -> str:
    """The text, or its beginning with a mark of how long it was: at most `most` characters."""
    mark = f"… [cut: {len(text)} characters]"
    return text if len(text) <= most else text[: most - len(mark)] + mark
