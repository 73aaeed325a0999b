"""What single phrases say, before they are put together into an intent."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from augment.instruction.intent import (
    Bearing,
    Body,
    Facing,
    LaneChoice,
    LateralTarget,
    Length,
    Nearness,
    Post,
    Relation,
    Setting,
    Shape,
    Side,
)


class Kind(StrEnum):
    """What a noun names."""

    VEHICLE = "vehicle"
    PEDESTRIAN = "pedestrian"
    CONES = "cones"
    ZONE = "construction zone"
    WORKER = "worker"
    CRASH = "accident"


@dataclass(frozen=True, slots=True, kw_only=True)
class Thing:
    """A noun: with its count if there is one, or as something named before ("the car").

    A plural without a number has the count None as well, but `is_plural`. One that `joins` goes
    on with the group before it ("the car behind it").
    """

    kind: Kind
    count: int | None = None
    body: Body | None = None
    is_plural: bool = False
    is_definite: bool = False
    joins: bool = False


@dataclass(frozen=True, slots=True)
class Distance:
    """How far away, without a direction."""

    length: Length


@dataclass(frozen=True, slots=True)
class Direction:
    """Ahead of the ego or behind it."""

    relation: Relation


@dataclass(frozen=True, slots=True)
class InLane:
    """In which lane."""

    lane: LaneChoice


@dataclass(frozen=True, slots=True)
class Towards:
    """The side of an offset, and how far where a word says so."""

    target: LateralTarget
    nearness: Nearness | None = None


@dataclass(frozen=True, slots=True)
class Offset:
    """The number of an offset; `length` is None for "a slight offset"."""

    length: Length | None


@dataclass(frozen=True, slots=True)
class Shoulder:
    """Beside the road: on the shoulder of that side, None for the kerb's."""

    side: Side | None
    nearness: Nearness


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the place must be in or away from."""

    setting: Setting


@dataclass(frozen=True, slots=True)
class Standing:
    """It does not move."""


@dataclass(frozen=True, slots=True)
class Moving:
    """It moves, with that speed (m/s) if the phrase names one."""

    speed_mps: float | None = None


@dataclass(frozen=True, slots=True)
class Faces:
    """Its heading by words."""

    facing: Facing


@dataclass(frozen=True, slots=True)
class Turned:
    """Its heading by an angle, positive to the left; unsigned where no side is named."""

    degrees: float
    side: Side | None = None


@dataclass(frozen=True, slots=True)
class Crosses:
    """It crosses the road."""


@dataclass(frozen=True, slots=True)
class Sides:
    """From which side of the road to which."""

    start: Side | None = None
    end: Side | None = None


@dataclass(frozen=True, slots=True)
class Formation:
    """How cones stand together."""

    shape: Shape


@dataclass(frozen=True, slots=True)
class Spacing:
    """The distance between neighbours."""

    length: Length


@dataclass(frozen=True, slots=True)
class Crashed:
    """They have run into each other."""


@dataclass(frozen=True, slots=True)
class Mention:
    """Words that only point at something said before ("the first cone", "the ego")."""


class Rank(StrEnum):
    """Which of several a sentence goes on about."""

    FIRST = "first"
    SECOND = "second"
    THIRD = "third"
    FOURTH = "fourth"
    LAST = "last"
    OTHER = "other"
    FORMER = "former"
    LATTER = "latter"


@dataclass(frozen=True, slots=True)
class Which:
    """From here on it is about that one of a group ("the second one")."""

    rank: Rank


@dataclass(frozen=True, slots=True)
class Apart:
    """A distance to a neighbour, between centres, in which direction, and to which one."""

    length: Length
    bearing: Bearing | None = None
    of: Rank | None = None


@dataclass(frozen=True, slots=True)
class Bears:
    """In which direction from its neighbour, without a distance."""

    bearing: Bearing


@dataclass(frozen=True, slots=True)
class Drifts:
    """A walk that ends further along the road than it begins, or nearer."""

    length: Length
    relation: Relation


@dataclass(frozen=True, slots=True)
class OnRoad:
    """The walk has begun: the first one stands in the ego's lane already."""


@dataclass(frozen=True, slots=True)
class Reaches:
    """From one distance ahead of the ego to another, or over a length."""

    start: Length | None
    end: Length | None
    size: Length | None = None


@dataclass(frozen=True, slots=True)
class Posted:
    """Where a worker stands by the cones."""

    post: Post
    side: Side | None = None


@dataclass(frozen=True, slots=True)
class BothSides:
    """On both sides of the lane; `is_each` if a number is that of one side."""

    is_each: bool


@dataclass(frozen=True, slots=True)
class WrongSide:
    """On the wrong side of the road, as seen from the vehicle itself."""


@dataclass(frozen=True, slots=True)
class PartlyIn:
    """It covers a part of the lane, which takes an offset to mean anything."""


@dataclass(frozen=True, slots=True)
class Row:
    """One behind the other."""


@dataclass(frozen=True, slots=True)
class Purpose:
    """What the ego is meant to do about it, or a colour; it places nothing.

    `is_passed` if the ego has to pass it or wait for it, so that it must be ahead.
    """

    is_passed: bool = False


@dataclass(frozen=True, slots=True)
class Kept:
    """The traffic of the scene stays as it is."""


Fact = (
    Thing
    | Distance
    | Direction
    | InLane
    | Towards
    | Offset
    | Shoulder
    | Surroundings
    | Standing
    | Moving
    | Faces
    | Turned
    | Crosses
    | Sides
    | Formation
    | Spacing
    | Crashed
    | Mention
    | Which
    | Apart
    | Bears
    | Drifts
    | OnRoad
    | Reaches
    | Posted
    | BothSides
    | WrongSide
    | PartlyIn
    | Row
    | Purpose
    | Kept
)
