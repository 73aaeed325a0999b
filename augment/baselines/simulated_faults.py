"""Faults made on purpose, each by its kind; the kind is the true label.

A kind applies where it makes a difference that a person would see, measured against the placement
before it; where it makes none it gives None. Nothing here looks at the checks.
"""

from __future__ import annotations

import random
from collections.abc import Callable
from enum import StrEnum

from augment.baselines import simulated_logic as logic
from augment.baselines import simulated_places as places
from augment.baselines.simulated_road import Agents
from augment.scene.ego_route import EgoRoute


class FaultKind(StrEnum):
    """What goes wrong in a placement, by the class that it belongs to."""

    NEIGHBOUR_LANE = "neighbour-lane"
    STRAIGHT_LINE = "straight-line"
    ALONG_LANE = "along-lane"
    OFF_ROAD = "off-road"
    BEYOND_JUNCTION = "beyond-junction"
    EGO_HEADING = "ego-heading"
    FLIPPED = "flipped"
    DEGREES = "degrees-as-radians"
    FACING_AWAY = "facing-away"
    OVERLAP = "overlap"
    MISSING = "missing-object"
    EXTRA = "extra-object"
    WRONG_SIDE = "wrong-side"
    WRONG_TYPE = "wrong-type"
    MOVING = "moving-parked"


POSITION_KINDS = (
    FaultKind.NEIGHBOUR_LANE,
    FaultKind.STRAIGHT_LINE,
    FaultKind.ALONG_LANE,
    FaultKind.OFF_ROAD,
    FaultKind.BEYOND_JUNCTION,
)
HEADING_KINDS = (
    FaultKind.EGO_HEADING,
    FaultKind.FLIPPED,
    FaultKind.DEGREES,
    FaultKind.FACING_AWAY,
)
LOGIC_KINDS = (
    FaultKind.OVERLAP,
    FaultKind.MISSING,
    FaultKind.EXTRA,
    FaultKind.WRONG_SIDE,
    FaultKind.WRONG_TYPE,
    FaultKind.MOVING,
)


def inject_fault(
    route: EgoRoute, agents: Agents, kind: FaultKind, rng: random.Random
) -> Agents | None:
    """The agents with that fault, None where it makes no difference here."""
    return _MAKERS[kind](route, agents, rng) if agents else None


# Private

_MAKERS: dict[FaultKind, Callable[[EgoRoute, Agents, random.Random], Agents | None]] = {
    FaultKind.NEIGHBOUR_LANE: places.neighbour_lane,
    FaultKind.STRAIGHT_LINE: places.straight_line,
    FaultKind.ALONG_LANE: places.along_lane,
    FaultKind.OFF_ROAD: places.off_road,
    FaultKind.BEYOND_JUNCTION: places.beyond_junction,
    FaultKind.EGO_HEADING: places.ego_heading,
    FaultKind.FLIPPED: places.flip_vehicle,
    FaultKind.DEGREES: places.degrees,
    FaultKind.FACING_AWAY: places.facing_away,
    FaultKind.OVERLAP: logic.overlap,
    FaultKind.MISSING: logic.missing,
    FaultKind.EXTRA: logic.extra,
    FaultKind.WRONG_SIDE: logic.wrong_side,
    FaultKind.WRONG_TYPE: logic.wrong_type,
    FaultKind.MOVING: logic.moving,
}
