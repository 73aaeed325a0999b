"""An intent as a JSON document and back; what is open is absent.

One strict shape (`Intent`) for files, rows, forms and what a language model answers: unknown
fields, unknown words, texts for numbers and numbers that are not finite are refused with their
path.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any

from pydantic import TypeAdapter, ValidationError

from augment.errors import InvalidDocument
from augment.scene.intent import CrashRequest, Intent, Length, WalkRequest
from augment.scene.schema import VERSION, problems_of, read

INTENT_FORMAT = "scenario-arena/intent"

_INTENT = TypeAdapter(Intent)
_ALWAYS_WRITTEN = ("requests", "kind", "body")


def intent_to_document(intent: Intent) -> dict[str, Any]:
    """The intent as a JSON document; open parts and plain defaults are left out."""
    return {"format": INTENT_FORMAT, "version": VERSION, **intent_to_parts(intent)}


def intent_to_parts(intent: Intent) -> dict[str, Any]:
    """The requests, and whatever else the intent says."""
    parts: dict[str, Any] = _written(intent)
    return parts


def intent_from_document(document: object) -> Intent:
    """The intent that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    return _checked(read(document, _INTENT, what="intent", format_name=INTENT_FORMAT))


def intent_from_parts(parts: object) -> Intent:
    """The intent of a document without its frame: what a language model answers.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    try:
        return _checked(_INTENT.validate_python(parts))
    except ValidationError as fault:
        raise InvalidDocument("intent", problems_of(fault)) from None


def parts_schema() -> dict[str, Any]:
    """The JSON schema of such parts, with a line on each."""
    schema = _INTENT.json_schema()
    for part in (schema, *schema["$defs"].values()):
        part["description"] = part["description"].partition("\n")[0]
        if "const" in part.get("properties", {}).get("kind", {}):
            part["required"] = ["kind"]
    schema["$defs"]["Length"]["required"] = ["low_m"]
    return schema


# Private


def _checked(intent: Intent) -> Intent:
    problems = list(_contradictions(intent))
    if problems:
        raise InvalidDocument("intent", problems)
    return intent


def _contradictions(intent: Intent) -> Iterator[tuple[str, str]]:
    known: list[str] = []
    for number, request in enumerate(intent.requests):
        at, anchor = f"requests[{number}]", request.spot.anchor
        if anchor is not None and anchor not in known:
            names = ", ".join(known) or "none"
            text = f"{anchor!r} is the name of no earlier request; those before it: {names}"
            yield f"{at}.spot.anchor", text
        if request.name and request.name in known:
            yield f"{at}.name", f"{request.name!r} is taken by an earlier request"
        known += [request.name] if request.name else []
        further = {WalkRequest: "behind", CrashRequest: "others"}.get(type(request))
        if further and request.count is not None:
            given = len(getattr(request, further))
            if given > request.count - 1:
                text = f"tells of {given} further ones, but the count is {request.count}"
                yield f"{at}.{further}", text


def _written(value: Any) -> Any:
    """A value as a part of a document, without what is at its default."""
    if isinstance(value, Length):
        written: dict[str, Any] = {"low_m": value.low_m}
        if value.is_range:
            written["high_m"] = value.high_m
        return written | ({"is_approximate": True} if value.is_approximate else {})
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, tuple):
        return [_written(one) for one in value]
    if not is_dataclass(value):
        return value
    return {
        field.name: _written(part)
        for field in fields(value)
        if (part := getattr(value, field.name)) != field.default or field.name in _ALWAYS_WRITTEN
    }
