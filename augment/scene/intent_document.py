"""The shape of an intent as a document: what may be said, and what contradicts itself."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import Field, Strict, model_validator

from augment.scene.entities import TurnType
from augment.scene.intent import LaneChoice, Relation, Side
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
from augment.scene.landmarks import MapPlace, Sight
from augment.scene.schema import Document, Id

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
