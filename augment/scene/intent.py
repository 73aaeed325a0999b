"""Intent of an instruction as frozen values; an unstated one stays open (None).

Distances run along the ego's lane, from centre to centre, in metres. Left and right are those of
the ego's direction of travel. Kerb and centre line are named as such here and become left or
right on the map, because people do not drive on one side everywhere. What may be said, and what
contradicts itself, is checked when a document is read (`codec`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, Literal, Self, TypeVar

from pydantic import Field, model_validator

from augment.scene.entities import AgentType, TurnType
from augment.scene.intent_parts import Amount as Amount
from augment.scene.intent_parts import Length as Length
from augment.scene.intent_parts import MapPlace as MapPlace
from augment.scene.intent_parts import MotionWish as MotionWish
from augment.scene.intent_parts import Purpose as Purpose
from augment.scene.intent_parts import Setting as Setting
from augment.scene.intent_parts import Side as Side
from augment.scene.intent_parts import StartWish as StartWish
from augment.scene.planned_motion import MotionPreset
from augment.scene.schema import CLOSED, MOST_OBJECTS, Count, Id, Real, Text, Yes


class IntentOrigin(StrEnum):
    """Source of an intent."""

    AUTHORED = "authored"
    ENTERED = "entered"
    READ = "read"
    DERIVED = "derived"


class LateralTarget(StrEnum):
    """Towards what something is offset within its lane."""

    LANE_CENTRE = "lane centre"
    LEFT_BOUNDARY = "left lane boundary"
    RIGHT_BOUNDARY = "right lane boundary"
    KERB = "kerb"
    CENTRE_LINE = "centre line of the road"


class Nearness(StrEnum):
    """Distance towards the target if the sentence has no number."""

    SLIGHTLY = "slightly"
    AT_EDGE = "at the edge"
    HALF_OUT = "half outside"
    OUTSIDE = "outside"


class Body(StrEnum):
    """Kind of object; `vehicle` and `car` share one size."""

    VEHICLE = "vehicle"
    CAR = "car"
    BICYCLE = "bicycle"
    VAN = "van"
    TRUCK = "truck"
    BUS = "bus"
    BARRIER = "barrier"
    CONSTRUCTION_SIGN = "construction sign"
    TRAFFIC_CONE = "traffic cone"
    PEDESTRIAN = "pedestrian"

    @classmethod
    def of(cls, kind: AgentType) -> Body:
        """Return the body of a kind of agent; of what has none of its own a vehicle's."""
        return cls.__members__.get(kind.name, cls.VEHICLE)


class Facing(StrEnum):
    """Heading relative to the direction of its lane."""

    WITH_LANE = "with the lane"
    AGAINST_LANE = "against the lane"
    ACROSS = "across the lane"

    @property
    def turn_deg(self) -> float:
        """Angle to the left of the lane's direction, in degrees."""
        return {"with the lane": 0.0, "against the lane": 180.0, "across the lane": 90.0}[self]


class Shape(StrEnum):
    """Arrangement of cones."""

    TAPER = "taper"
    LINE = "line"
    RING = "ring"
    ROW = "row across the lane"


class Bearing(StrEnum):
    """A direction from a neighbour, as seen in the ego's direction of travel."""

    AHEAD = "in front of"
    BEHIND = "behind"
    LEFT = "left of"
    RIGHT = "right of"


class Post(StrEnum):
    """Place of a worker by the cones."""

    BEHIND = "behind the cones"
    BESIDE = "beside the cones"
    AT_LAST = "beside the last cones"


class Relation(StrEnum):
    """On which end of its anchor a distance is measured."""

    AHEAD = "ahead"
    BEHIND = "behind"

    @property
    def words(self) -> str:
        """Between a place and what it is counted from."""
        return "ahead of" if self is Relation.AHEAD else "behind"


class LaneChoice(StrEnum):
    """A lane by its place beside the ego's."""

    OWN = "own"
    LEFT = "left"
    RIGHT = "right"
    ONCOMING = "oncoming"


class Sight(StrEnum):
    """Name of a road user of the scene in the sentence."""

    VEHICLE = "vehicle"
    PARKED = "parked vehicle"
    MOVING = "moving vehicle"
    BUS = "bus"
    BICYCLE = "bicycle"
    PEDESTRIAN = "pedestrian"


@dataclass(frozen=True, slots=True, kw_only=True)
class Pick:
    """A road user of the scene, by what a sentence says of it.

    Attributes:
        relation: Whether it is counted ahead of the ego or behind it, the nearest first.
        ordinal: Which of those that fit; 1 is the nearest.
        every: All that fit.
    """

    kind: Sight
    side: Side | None = None
    lane: LaneChoice | None = None
    relation: Relation = Relation.AHEAD
    ordinal: Count = 1
    every: Yes = False

    @model_validator(mode="after")
    def _is_one_or_all(self) -> Self:
        if self.every and self.ordinal != 1:
            raise ValueError("every one and one of a number contradict each other")
        return self

    def __str__(self) -> str:
        kind = f"every {self.kind}" if self.every else f"{self.kind} {self.ordinal}"
        side = f", on its {self.side}" if self.side else ""
        lane = f", in the {self.lane} lane" if self.lane else ""
        return f"{kind} {self.relation.words} the ego{side}{lane}"


MOST_REQUESTS = 20

_MetresAhead = Annotated[Real, Field(gt=0.0, le=1000.0)]
_Drift = Annotated[Real, Field(ge=-100.0, le=100.0)]
_Degrees = Annotated[Real, Field(ge=-180.0, le=180.0)]
_VehicleSpeed = Annotated[Real, Field(ge=0.0, le=100.0)]
_WalkSpeed = Annotated[Real, Field(gt=0.0, le=10.0)]
_Words = Annotated[Text, Field(min_length=1, max_length=300, pattern=r"\S")]
_Name = Id | Literal[""]
_Item = TypeVar("_Item")
_Several = Annotated[tuple[_Item, ...], Field(fail_fast=True, max_length=MOST_OBJECTS)]
_Changes = Annotated[tuple[_Item, ...], Field(fail_fast=True, max_length=MOST_REQUESTS)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Lateral:
    """Place across the lane: towards `target`, by `offset` or, without a number, by `nearness`.

    Attributes:
        on_shoulder: The sentence says that it stands (partly) beside the road, so the target has
            to be the kerb's side.
    """

    target: LateralTarget
    offset: Length | None = None
    nearness: Nearness | None = None
    on_shoulder: Yes = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A place: how far along the lane from its anchor, in which lane, where across it.

    Attributes:
        distance: None where no number is said; `relation` alone says on which side then.
        anchor: The name of an earlier request, of whose first object the distance runs; None for
            the ego, as for the two that follow, of which one alone may be given.
        landmark: A road user of the scene of whom the distance runs.
        mark: A place of the map of which the distance runs; before a crosswalk from its near
            edge, past it from its far one.
        via: A lane of the map: the distance runs along the way to it, which takes the place of
            the ego's lane; None for the intent's route.
        lane: None where no lane is said, or none is meant (walks).
    """

    distance: Length | None = None
    relation: Relation | None = None
    anchor: Id | None = None
    landmark: Pick | None = None
    mark: MapPlace | None = None
    via: Id | None = None
    lane: LaneChoice | None = None
    lateral: Lateral | None = None
    settings: _Several[Setting] = ()

    @model_validator(mode="after")
    def _says_where(self) -> Self:
        if self.distance is not None and self.relation is None:
            raise ValueError("a distance needs a relation: ahead or behind")
        starts = (self.anchor, self.landmark, self.mark, self.via)
        if sum(start is not None for start in starts) > 1:
            raise ValueError("a distance runs from an anchor, a landmark, a mark or over a lane")
        if self.landmark is not None and self.landmark.every:
            raise ValueError("a landmark is one road user, not every one")
        return self

    @property
    def span_m(self) -> tuple[float, float] | None:
        """From where to where along the lane, behind the anchor negative; None where open."""
        if self.relation is None:
            return None
        low_m, high_m = self.distance.span_m if self.distance else (0.0, math.inf)
        return (low_m, high_m) if self.relation is Relation.AHEAD else (-high_m, -low_m)


def _check_motion(motion: MotionWish | None, who: str, *presets: MotionPreset) -> None:
    if motion is not None and motion.preset not in presets:
        allowed = ", ".join(presets)
        raise ValueError(f"motion: {motion.preset} is not what {who} does; allowed: {allowed}")


_ON_FOOT = (MotionPreset.LATE_PEDESTRIAN,)
_OF_DOORS = (MotionPreset.DOOR_OPENING,)
_OPENS = MotionWish(preset=MotionPreset.DOOR_OPENING)
_DRIVEN = tuple(preset for preset in MotionPreset if preset not in (*_ON_FOOT, *_OF_DOORS))

_Turned = TypeVar("_Turned", "VehicleRequest", "Move")


def _check_turn(turned: _Turned) -> _Turned:
    if turned.turn_deg and turned.facing is None:
        raise ValueError("turn_deg needs a facing that it is counted from")
    return turned


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleRequest:
    """Vehicles that stand (speed 0) or move; the first of them at the spot.

    Attributes:
        name: What an anchor calls it by; empty where none does. So for all requests.
        turn_deg: On top of `facing`, positive to the left.
        count: More than one stand in a row along the lane, each further one further on.
        motion: What they do after t0. Who runs a red light comes from another arm of the
            junction, and needs no spot.
    """

    kind: Literal["vehicles"] = "vehicles"
    spot: Spot = Spot()
    name: _Name = ""
    body: Body = Body.VEHICLE
    facing: Facing | None = None
    turn_deg: _Degrees = 0.0
    speed_mps: _VehicleSpeed | None = None
    count: Count | None = None
    spacing: Length | None = None
    motion: MotionWish | None = None

    _is_turned_from_something = model_validator(mode="after")(_check_turn)

    @model_validator(mode="after")
    def _drives(self) -> Self:
        _check_motion(self.motion, "a vehicle", *_DRIVEN)
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkRequest:
    """Pedestrians who cross the road, side by side; the first of them at the spot.

    Attributes:
        start: From which side; they cross to the other.
        drift_m: How much further along the lane a walk ends than it begins.
        is_file: They walk one behind the other.
        behind: How far behind the first one the others walk in a file, where that is said.
        on_road: The first one stands in the ego's lane already.
        end: Where across the lane a walk ends; beyond the road's edge where nobody says. Where
            it begins is the spot's `lateral`.
        motion: They wait beside the road and start late.
    """

    kind: Literal["walk"] = "walk"
    spot: Spot = Spot()
    name: _Name = ""
    start: Side | None = None
    count: Count | None = None
    speed_mps: _WalkSpeed | None = None
    drift_m: _Drift | None = None
    is_file: Yes = False
    behind: _Several[Length] = ()
    on_road: Yes = False
    end: Lateral | None = None
    motion: MotionWish | None = None

    @model_validator(mode="after")
    def _goes_on_foot(self) -> Self:
        _check_motion(self.motion, "a pedestrian", *_ON_FOOT)
        return self


@dataclass(frozen=True, slots=True, kw_only=True)
class ConesRequest:
    """Cones in a shape, and a worker or none.

    Attributes:
        spot: Of the first cone, or of a ring's centre.
        start: The lane boundary at which a taper begins.
        ends_in_middle: A taper ends in the middle of the lane, not at its other boundary.
        both_sides: A line of `count` cones along each boundary of the lane.
        reach_m: From the first cone to the last along the lane, None where the spacing says it.
    """

    kind: Literal["cones"] = "cones"
    spot: Spot = Spot()
    name: _Name = ""
    shape: Shape | None = None
    count: Count | None = None
    spacing: Length | None = None
    start: Side | None = None
    ends_in_middle: Yes = False
    both_sides: Yes = False
    reach_m: _MetresAhead | None = None
    has_worker: Yes = False
    post: Post | None = None
    post_side: Side | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashedCar:
    """A further vehicle of an accident, against the one named before it.

    Attributes:
        gap: Between the two centres.
        turn_deg: Against the one before, positive to the left.
        is_signed: The sentence names the side that it is turned to.
    """

    gap: Length | None = None
    bearing: Bearing | None = None
    turn_deg: _Degrees | None = None
    is_signed: Yes = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashRequest:
    """Vehicles that have run into each other, and stand; the spot is that of the first.

    Attributes:
        facing: Of the first one, against its lane.
        others: What is said of the further ones in order; none where it is left open.
    """

    kind: Literal["crash"] = "crash"
    spot: Spot = Spot()
    name: _Name = ""
    count: Count | None = None
    body: Body = Body.CAR
    facing: Facing | None = None
    others: _Several[CrashedCar] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorRequest:
    """A door that opens, on the ego's side of a parked car.

    Attributes:
        spot: The car alone: a landmark, or the anchor of an earlier request.
    """

    kind: Literal["door"] = "door"
    spot: Spot
    name: _Name = ""
    count: Literal[1] | None = 1
    motion: MotionWish = _OPENS

    @model_validator(mode="after")
    def _is_of_a_car(self) -> Self:
        car = Spot(anchor=self.spot.anchor, landmark=self.spot.landmark)
        if self.spot != car or car == Spot():
            raise ValueError("a door's spot is its car: an anchor or a landmark, and no more")
        _check_motion(self.motion, "a door", *_OF_DOORS)
        return self


Request = VehicleRequest | WalkRequest | ConesRequest | CrashRequest | DoorRequest
_AnyRequest = Annotated[Request, Field(discriminator="kind")]


@dataclass(frozen=True, slots=True, kw_only=True)
class Move:
    """A road user of the scene that is to stand or drive elsewhere, or to move otherwise.

    Attributes:
        spot: Where it belongs, sides and distances as for what is added; open where it stays.
        speed_mps: None where it keeps its speed.
    """

    who: Pick
    spot: Spot = Spot()
    facing: Facing | None = None
    turn_deg: _Degrees = 0.0
    speed_mps: _VehicleSpeed | None = None
    motion: MotionWish | None = None

    @model_validator(mode="after")
    def _is_one_with_a_place(self) -> Self:
        if self.who.every:
            raise ValueError("one road user is moved, not every one")
        _check_motion(self.motion, "a road user", *_DRIVEN, *_ON_FOOT)
        if self.spot.anchor is not None:
            raise ValueError("a move is counted from the ego, a landmark or a mark")
        return self

    _is_turned_from_something = model_validator(mode="after")(_check_turn)

    @property
    def stays(self) -> bool:
        """True if it stays at its place and only its heading, speed or motion changes."""
        return self.spot == Spot()

    def as_request(self, kind: AgentType) -> VehicleRequest:
        """Return the same as a request for one of a kind."""
        same = ("spot", "facing", "turn_deg", "speed_mps", "motion")
        return VehicleRequest(
            body=Body.of(kind), count=1, **{name: getattr(self, name) for name in same}
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """All that was asked for.

    Attributes:
        requests: What is to be added.
        moves: Who of the scene is to be elsewhere.
        removals: Who of the scene is to go.
        purpose: What the change is for, if any change will do that has this effect.
        route: Where the way leads along which the distances run, where it first parts.
        unmet: Why the wish can't be met in its scene; then nothing else is asked for, and the
            right outcome is a refusal. None where it can be met.
        beyond: Parts of the sentence that these fields can't hold, in its own words.
    """

    __pydantic_config__ = CLOSED

    requests: _Changes[_AnyRequest] = ()
    moves: _Changes[Move] = ()
    removals: _Changes[Pick] = ()
    purpose: Purpose | None = None
    route: TurnType = TurnType.STRAIGHT
    unmet: _Words | None = None
    beyond: _Several[_Words] = ()

    @model_validator(mode="after")
    def _asks_for_something(self) -> Self:
        asks = bool(self.requests or self.moves or self.removals or self.purpose)
        if self.unmet is None and not asks:
            raise ValueError("asks for nothing: no requests, moves, removals or purpose")
        if self.unmet is not None and asks:
            raise ValueError("what can't be met asks for nothing else")
        return self
