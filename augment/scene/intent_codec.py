"""An intent as a JSON document and back; what is open is absent.

One strict shape (`intent_document`) for files, rows, forms and what a language model answers:
unknown fields, unknown words, texts for numbers and numbers that are not finite are refused with
their path.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from enum import Enum
from typing import Any

from pydantic import BaseModel

from augment.errors import InvalidDocument
from augment.scene.entities import TurnType
from augment.scene.intent import (
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Intent,
    Lateral,
    Length,
    Move,
    Request,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.intent_document import (
    ConesDocument,
    CrashDocument,
    CrashedCarDocument,
    IntentDocument,
    IntentParts,
    LateralDocument,
    LengthDocument,
    MoveDocument,
    PickDocument,
    SpotDocument,
    VehiclesDocument,
    WalkDocument,
)
from augment.scene.landmarks import Pick
from augment.scene.schema import VERSION, Document, read

INTENT_FORMAT = "scenario-arena/intent"

_KINDS: dict[type[Request], str] = {
    VehicleRequest: "vehicles",
    WalkRequest: "walk",
    ConesRequest: "cones",
    CrashRequest: "crash",
}
_VALUES = {kind: request for request, kind in _KINDS.items()}


def intent_to_document(intent: Intent) -> dict[str, Any]:
    """The intent as a JSON document; open parts and plain defaults are left out."""
    return {"format": INTENT_FORMAT, "version": VERSION, **intent_to_parts(intent)}


def intent_to_parts(intent: Intent) -> dict[str, Any]:
    """The requests, and whatever else the intent says."""
    requests = [
        {"kind": _KINDS[type(request)], **_written(request)} for request in intent.requests
    ]
    others = {
        "moves": [_written(move) for move in intent.moves],
        "removals": [_written(removal) for removal in intent.removals],
        "route": "" if intent.route is TurnType.STRAIGHT else intent.route.value,
        "unmet": intent.unmet,
        "beyond": list(intent.beyond),
    }
    return {"requests": requests} | {name: part for name, part in others.items() if part}


def intent_from_document(document: object) -> Intent:
    """The intent that a JSON document describes.

    Raises:
        InvalidDocument: With the path and the reason of every fault.
    """
    given = read(document, IntentDocument, what="intent", format_name=INTENT_FORMAT)
    return intent_from_parts(given)


def intent_from_parts(given: IntentParts) -> Intent:
    """The intent of parts that have the right shape.

    Raises:
        InvalidDocument: They contradict each other.
    """
    intent = Intent(
        requests=tuple(_request(request) for request in given.requests),
        moves=_value(given.moves),
        removals=_value(given.removals),
        route=given.route,
        unmet=given.unmet or "",
        beyond=tuple(given.beyond),
    )
    problems = list(_contradictions(intent))
    if problems:
        raise InvalidDocument("intent", problems)
    return intent


# Private


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


def _request(given: VehiclesDocument | WalkDocument | ConesDocument | CrashDocument) -> Request:
    kind = _VALUES[given.kind]
    return kind(**{name: _value(value) for name, value in _pairs(given) if name != "kind"})


def _pairs(given: BaseModel) -> Iterator[tuple[str, Any]]:
    return ((name, getattr(given, name)) for name in type(given).model_fields)


_PARTS: Mapping[type[Document], type] = {
    LateralDocument: Lateral,
    SpotDocument: Spot,
    CrashedCarDocument: CrashedCar,
    PickDocument: Pick,
    MoveDocument: Move,
}


def _value(value: Any) -> Any:
    """A part of a document as the value that it stands for."""
    if isinstance(value, LengthDocument):
        high_m = value.low_m if value.high_m is None else value.high_m
        return Length(low_m=value.low_m, high_m=high_m, is_approximate=value.is_approximate)
    if isinstance(value, list):
        return tuple(_value(one) for one in value)
    if isinstance(value, Document):
        return _PARTS[type(value)](**{name: _value(part) for name, part in _pairs(value)})
    return value


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
    if not hasattr(value, "__dataclass_fields__"):
        return value
    kept = ((field.name, getattr(value, field.name), field.default) for field in fields(value))
    always = "body" if isinstance(value, (VehicleRequest, CrashRequest)) else ""
    return {
        name: _written(part) for name, part, default in kept if part != default or name == always
    }
