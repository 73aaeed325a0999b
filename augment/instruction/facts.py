"""What single phrases say, before they are put together into an intent."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from augment.instruction.intent import (
    Body,
    Facing,
    LaneChoice,
    LateralTarget,
    Length,
    Nearness,
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

    A plural without a number has the count None as well, but `is_plural`.
    """

    kind: Kind
    count: int | None = None
    body: Body | None = None
    is_plural: bool = False
    is_definite: bool = False


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


@dataclass(frozen=True, slots=True)
class Purpose:
    """What the ego is meant to do about it; it places nothing."""


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
    | Purpose
)
