"""What an instruction asks for, as frozen values; distances in metres along the ego's lane.

Left and right are those of the ego's direction of travel. Kerb and centre line are named as such
here and become left or right on the map, because people do not drive on one side everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

SLIGHT_OFFSET_M = 0.75
"""What "slightly" means without a number: the middle of the paper's range of 0 to 1.5 m."""

CONE_COUNT = 6
CONE_SPACING_M = 2.5
"""A construction zone without numbers: interPlan's median count and neighbour distance."""


class Side(StrEnum):
    """A side of the ego's direction of travel."""

    LEFT = "left"
    RIGHT = "right"

    @property
    def other(self) -> Side:
        """The opposite side."""
        return Side.RIGHT if self is Side.LEFT else Side.LEFT


class Relation(StrEnum):
    """On which end of the ego a distance is measured."""

    AHEAD = "ahead"
    BEHIND = "behind"


class LaneChoice(StrEnum):
    """A lane by its place beside the ego's."""

    OWN = "own"
    LEFT = "left"
    RIGHT = "right"
    ONCOMING = "oncoming"


class LateralTarget(StrEnum):
    """Towards what something is offset within its lane."""

    LANE_CENTRE = "lane centre"
    LEFT_BOUNDARY = "left lane boundary"
    RIGHT_BOUNDARY = "right lane boundary"
    KERB = "kerb"
    CENTRE_LINE = "centre line of the road"


class Nearness(StrEnum):
    """How far towards the target, where the sentence gives no number."""

    SLIGHTLY = "slightly"
    AT_EDGE = "at the edge"
    HALF_OUT = "half outside"
    OUTSIDE = "outside"


class Body(StrEnum):
    """What kind of vehicle is meant; `vehicle` and `car` share one size."""

    VEHICLE = "vehicle"
    CAR = "car"
    VAN = "van"
    TRUCK = "truck"
    BUS = "bus"


class Facing(StrEnum):
    """Where something looks, against the direction of its lane."""

    WITH_LANE = "with the lane"
    AGAINST_LANE = "against the lane"
    ACROSS = "across the lane"


class Shape(StrEnum):
    """How cones stand together."""

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
    """Where a worker stands by the cones."""

    BEHIND = "behind the cones"
    BESIDE = "beside the cones"
    AT_LAST = "beside the last cones"


class Setting(StrEnum):
    """What the surroundings of the place must be."""

    BEFORE_INTERSECTION = "before the intersection"
    IN_INTERSECTION = "in the intersection"
    AT_INTERSECTION = "at the intersection"
    AFTER_INTERSECTION = "past the intersection"
    IN_BEND = "in the bend"
    ON_CROSSWALK = "on the crosswalk"
    OFF_CROSSWALK = "away from the crosswalk"
    BY_PARKED = "beside parked vehicles"
    BY_PARKED_LEFT = "between parked vehicles on the left"
    BY_PARKED_RIGHT = "between parked vehicles on the right"


@dataclass(frozen=True, slots=True, kw_only=True)
class Length:
    """A length or a range of lengths; `is_approximate` if the sentence says "about"."""

    low_m: float
    high_m: float
    is_approximate: bool = False

    @property
    def is_range(self) -> bool:
        """Whether a value has to be drawn from it."""
        return self.high_m > self.low_m

    def __str__(self) -> str:
        about = "about " if self.is_approximate else ""
        if self.is_range:
            return f"{about}{self.low_m:g} to {self.high_m:g} m"
        return f"{about}{self.low_m:g} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lateral:
    """Where across the lane: towards `target`, by `offset` or, without a number, by `nearness`.

    Attributes:
        on_shoulder: The sentence says that it stands (partly) beside the road, so the target has
            to be the kerb's side.
        also: A second name of the same side, "the kerb side (left)", which the map has to bear
            out.
    """

    target: LateralTarget = LateralTarget.LANE_CENTRE
    offset: Length | None = None
    nearness: Nearness = Nearness.SLIGHTLY
    on_shoulder: bool = False
    also: LateralTarget | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Spot:
    """A place by its distance from the ego's centre along the ego's lane, and its lane."""

    distance: Length
    relation: Relation
    lane: LaneChoice = LaneChoice.OWN
    lateral: Lateral = Lateral()
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleRequest:
    """Vehicles that stand (speed 0) or move; the first of them at the spot.

    Attributes:
        turn_deg: On top of `facing`, positive to the left.
        count: More than one stand in a row along the lane, each further one further on.
        spacing: Between the centres of neighbours in a row, None for a default.
    """

    spot: Spot
    body: Body
    facing: Facing = Facing.WITH_LANE
    turn_deg: float = 0.0
    speed_mps: float = 0.0
    count: int = 1
    spacing: Length | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class WalkRequest:
    """Pedestrians who cross the road, side by side; the first of them at the spot.

    Attributes:
        speed_mps: None where the sentence names none; a walk takes 15 s then.
        drift_m: How much further along the lane a walk ends than it begins.
        is_file: They walk one behind the other.
        behind: How far behind the first one the others walk in a file, where that is said.
        on_road: The first one stands in the ego's lane already.
    """

    spot: Spot
    start: Side
    count: int = 1
    speed_mps: float | None = None
    drift_m: float = 0.0
    is_file: bool = False
    behind: tuple[Length, ...] = ()
    on_road: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ConesRequest:
    """Cones in a shape, and a worker or none.

    Attributes:
        spot: Of the first cone, or of a ring's centre.
        start: The lane boundary at which a taper begins, None for the kerb's.
        ends_in_middle: A taper ends in the middle of the lane, not at its other boundary.
        both_sides: A line of `count` cones along each boundary of the lane.
        reach_m: From the first cone to the last along the lane, None where the spacing says it.
        post: Where the worker stands, None for a default of the shape.
        post_side: To which side of the cones, where that is said.
    """

    spot: Spot
    shape: Shape
    count: int
    spacing: Length
    start: Side | None = None
    ends_in_middle: bool = False
    both_sides: bool = False
    reach_m: float | None = None
    has_worker: bool = False
    post: Post | None = None
    post_side: Side | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashedCar:
    """A further vehicle of an accident, against the one named before it.

    Attributes:
        gap: Between the two centres, None for as close as they get.
        turn_deg: Against the one before, positive to the left; None where none is named.
        is_signed: The sentence names the side that it is turned to.
    """

    gap: Length | None = None
    bearing: Bearing = Bearing.AHEAD
    turn_deg: float | None = None
    is_signed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class CrashRequest:
    """Vehicles that have run into each other; the spot is that of the first.

    Attributes:
        turn_deg: The angle between neighbours, None where the sentence names none.
        facing: Of the first one, against its lane.
        others: What is said of the further ones in order; none where it is left open.
    """

    spot: Spot
    count: int
    body: Body = Body.CAR
    turn_deg: float | None = None
    facing: Facing = Facing.WITH_LANE
    others: tuple[CrashedCar, ...] = ()


Request = VehicleRequest | WalkRequest | ConesRequest | CrashRequest


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """All that was asked for, and how the sentence was read.

    Attributes:
        understood: The parts that were read, in order, in the sentence's own words.
        ignored: Parts that were read and change nothing (what the ego should do about it).
        not_understood: Words that nothing is known about but that they change nothing.
        assumed: What the sentence left open and a documented default filled.
    """

    requests: tuple[Request, ...]
    understood: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()
    not_understood: tuple[str, ...] = ()
    assumed: tuple[str, ...] = ()
