"""An intent as a JSON document and back; what is open is absent.

One strict shape for files, rows, forms and what a language model answers: unknown fields, unknown
words, texts for numbers and numbers that are not finite are refused with their path.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields
from enum import Enum
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, Field, Strict, model_validator

from augment.errors import InvalidDocument
from augment.scene.entities import TurnType
from augment.scene.intent import (
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Intent,
    LaneChoice,
    Lateral,
    Length,
    Move,
    Relation,
    Request,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.intent_words import (
    Bearing,
    Body,
    Facing,
    LateralTarget,
    Nearness,
    Post,
    Setting,
    Shape,
)
from augment.scene.landmarks import MapPlace, Pick, Sight
from augment.scene.schema import VERSION, Document, Id, read

INTENT_FORMAT = "scenario-arena/intent"
MOST_REQUESTS, MOST_OBJECTS = 20, 100

_Metres = Annotated[float, Field(ge=0.0, le=1000.0)]
_Degrees = Annotated[float, Field(ge=-180.0, le=180.0)]
_Count = Annotated[int, Field(ge=1, le=MOST_OBJECTS)]
_Words = Annotated[str, Field(min_length=1, max_length=300, pattern=r"\S")]
_Side = Annotated[Side, Strict(False)]
_Facing = Annotated[Facing, Strict(False)]
_Body = Annotated[Body, Strict(False)]
_Item = TypeVar("_Item")
_Several = Annotated[list[_Item], Field(fail_fast=True, max_length=MOST_OBJECTS)]


class LengthDocument(Document):
    """Metres: `low_m` alone is one length, `high_m` makes it a range."""

    low_m: _Metres
    high_m: _Metres | None = None
    is_approximate: bool = False

    @model_validator(mode="after")
    def _is_ordered(self) -> LengthDocument:
        if self.high_m is not None and self.high_m < self.low_m:
            raise ValueError("high_m is below low_m")
        return self


class LateralDocument(Document):
    """Where across its lane something stands."""

    target: Annotated[LateralTarget, Strict(False)]
    offset: LengthDocument | None = None
    nearness: Annotated[Nearness, Strict(False)] | None = None
    on_shoulder: bool = False


class PickDocument(Document):
    """A road user of the scene: which of those that fit, the nearest first, or every one."""

    kind: Annotated[Sight, Strict(False)]
    side: _Side | None = None
    lane: Annotated[LaneChoice, Strict(False)] | None = None
    relation: Annotated[Relation, Strict(False)] = Relation.AHEAD
    ordinal: _Count = 1
    every: bool = False

    @model_validator(mode="after")
    def _is_one_or_all(self) -> PickDocument:
        if self.every and self.ordinal != 1:
            raise ValueError("every one and one of a number contradict each other")
        return self


class SpotDocument(Document):
    """Where something is."""

    distance: LengthDocument | None = None
    relation: Annotated[Relation, Strict(False)] | None = None
    anchor: Id | None = None
    landmark: PickDocument | None = None
    mark: Annotated[MapPlace, Strict(False)] | None = None
    lane: Annotated[LaneChoice, Strict(False)] | None = None
    lateral: LateralDocument | None = None
    settings: _Several[Annotated[Setting, Strict(False)]] = []

    @model_validator(mode="after")
    def _says_where(self) -> SpotDocument:
        if self.distance is not None and self.relation is None:
            raise ValueError("a distance needs a relation: ahead or behind")
        if sum(one is not None for one in (self.anchor, self.landmark, self.mark)) > 1:
            raise ValueError("a distance runs from one thing: an anchor, a landmark or a mark")
        if self.landmark is not None and self.landmark.every:
            raise ValueError("a landmark is one road user, not every one")
        return self


class _RequestDocument(Document):
    name: Id | Literal[""] = ""
    spot: SpotDocument = SpotDocument()
    count: _Count | None = None


class VehiclesDocument(_RequestDocument):
    """Vehicles that stand or drive."""

    kind: Literal["vehicles"]
    body: _Body = Body.VEHICLE
    facing: _Facing | None = None
    turn_deg: _Degrees = 0.0
    speed_mps: Annotated[float, Field(ge=0.0, le=100.0)] | None = None
    spacing: LengthDocument | None = None

    @model_validator(mode="after")
    def _turns_from_something(self) -> VehiclesDocument:
        if self.turn_deg and self.facing is None:
            raise ValueError("turn_deg needs a facing that it is counted from")
        return self


class WalkDocument(_RequestDocument):
    """Pedestrians who cross the road."""

    kind: Literal["walk"]
    start: _Side | None = None
    speed_mps: Annotated[float, Field(gt=0.0, le=10.0)] | None = None
    drift_m: Annotated[float, Field(ge=-100.0, le=100.0)] | None = None
    is_file: bool = False
    behind: _Several[LengthDocument] = []
    on_road: bool = False


class ConesDocument(_RequestDocument):
    """Cones in a shape, with a worker or none."""

    kind: Literal["cones"]
    shape: Annotated[Shape, Strict(False)] | None = None
    spacing: LengthDocument | None = None
    start: _Side | None = None
    ends_in_middle: bool = False
    both_sides: bool = False
    reach_m: Annotated[float, Field(gt=0.0, le=1000.0)] | None = None
    has_worker: bool = False
    post: Annotated[Post, Strict(False)] | None = None
    post_side: _Side | None = None


class CrashedCarDocument(Document):
    """A further vehicle of an accident, against the one before it."""

    gap: LengthDocument | None = None
    bearing: Annotated[Bearing, Strict(False)] | None = None
    turn_deg: _Degrees | None = None
    is_signed: bool = False


class CrashDocument(_RequestDocument):
    """Vehicles that have run into each other."""

    kind: Literal["crash"]
    body: _Body = Body.CAR
    facing: _Facing | None = None
    others: _Several[CrashedCarDocument] = []


_AnyRequest = Annotated[
    VehiclesDocument | WalkDocument | ConesDocument | CrashDocument, Field(discriminator="kind")
]


class MoveDocument(Document):
    """A road user of the scene that is to be elsewhere."""

    who: PickDocument
    spot: SpotDocument
    facing: _Facing | None = None
    turn_deg: _Degrees = 0.0
    speed_mps: Annotated[float, Field(ge=0.0, le=100.0)] | None = None

    @model_validator(mode="after")
    def _is_one_with_a_place(self) -> MoveDocument:
        if self.who.every:
            raise ValueError("one road user is moved, not every one")
        if self.spot.anchor is not None:
            raise ValueError("a move is counted from the ego, a landmark or a mark")
        if self.turn_deg and self.facing is None:
            raise ValueError("turn_deg needs a facing that it is counted from")
        return self


_MostRequests = Field(fail_fast=True, max_length=MOST_REQUESTS)


class IntentParts(Document):
    """What an intent says, without the frame of a document: what a language model answers."""

    requests: Annotated[list[_AnyRequest], _MostRequests] = []
    moves: Annotated[list[MoveDocument], _MostRequests] = []
    removals: Annotated[list[PickDocument], _MostRequests] = []
    route: Annotated[TurnType, Strict(False)] = TurnType.STRAIGHT
    unmet: _Words | None = None
    beyond: _Several[_Words] = []

    @model_validator(mode="after")
    def _asks_for_something(self) -> IntentParts:
        asks = bool(self.requests or self.moves or self.removals)
        if self.unmet is None and not asks:
            raise ValueError("asks for nothing: no requests, moves or removals")
        if self.unmet is not None and asks:
            raise ValueError("what can't be met asks for nothing else")
        return self


class IntentDocument(IntentParts):
    """An `Intent`."""

    format: str
    version: int


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
