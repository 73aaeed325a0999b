"""The words of an intent: what may stand where a sentence leaves only a few things to be said."""

from __future__ import annotations

from enum import StrEnum


class IntentOrigin(StrEnum):
    """Where an intent comes from."""

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
    """How far towards the target, where the sentence gives no number."""

    SLIGHTLY = "slightly"
    AT_EDGE = "at the edge"
    HALF_OUT = "half outside"
    OUTSIDE = "outside"


class Body(StrEnum):
    """What is meant to stand or drive; `vehicle` and `car` share one size."""

    VEHICLE = "vehicle"
    CAR = "car"
    BICYCLE = "bicycle"
    VAN = "van"
    TRUCK = "truck"
    BUS = "bus"
    BARRIER = "barrier"
    CONSTRUCTION_SIGN = "construction sign"


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
    """A named place: what the surroundings must be."""

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
