"""What readers make of a source's map, and what becomes of it: values alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    TrafficLight,
    TrafficSide,
    TurnType,
)

FloatArray = NDArray[np.float64]
Name = int | str

FURTHEST_M = 1e8
"""Nothing on earth is further from the origin of a map."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A piece of lane in the source's world frame, in the direction of travel.

    Attributes:
        name: Its id in the source; all of one map are of one kind.
        centerline: (P, 2); None for the middle between the boundaries.
        left, right: (P, 2), None where the source has no boundaries.
        width_m: None to measure it between the boundaries.
        crosses: Whether it lies in an intersection.
        successors, predecessors: Names; a joint counts if either end names it.
        left_neighbors, right_neighbors: Names of what lies beside it; what is oncoming is passed
            over.
        light: Of the segment itself, or of all that follows it where it lies in no intersection.
        turn: None for what the shape says.
    """

    name: Name
    crosses: bool = False
    centerline: FloatArray | None = None
    left: FloatArray | None = None
    right: FloatArray | None = None
    width_m: float | None = None
    successors: tuple[Name, ...] = ()
    predecessors: tuple[Name, ...] = ()
    left_neighbors: tuple[Name, ...] = ()
    right_neighbors: tuple[Name, ...] = ()
    speed_limit_mps: float | None = None
    light: TrafficLight = TrafficLight.UNKNOWN
    turn: TurnType | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadMap:
    """What a source's map holds, in its world frame.

    Attributes:
        what, place: How faults call the source and the file.
        side: Where the lanes do not tell on which side people drive.
    """

    what: str
    place: str
    segments: tuple[Segment, ...]
    areas: tuple[tuple[AreaKind, FloatArray], ...] = ()
    side: TrafficSide = TrafficSide.RIGHT


@dataclass(frozen=True, slots=True, kw_only=True)
class MapExtract:
    """What a scene takes from the map; ids count from the nearest to the ego.

    Attributes:
        side_is_assumed: Whether no two oncoming lanes told the side.
        far: How many segments and areas lie too far from the ego and were left out.
    """

    traffic_side: TrafficSide
    lanes: tuple[Lane, ...]
    connectors: tuple[LaneConnector, ...]
    areas: tuple[Area, ...]
    side_is_assumed: bool = False
    far: int = 0
