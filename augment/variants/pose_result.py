"""What the pose tool answers: one place on a lane, under the names of the answer's block."""

from __future__ import annotations

import math
from dataclasses import dataclass

from augment.geometry.frames import Pose
from augment.variants.pose_surroundings import RoadSide


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOnLane:
    """One place.

    Attributes:
        lane: The short id of the shown lane or connector under the place, None where there is
            none. Of several the one that the place was counted on.
        along_m: On the last lane of the route, from where its shown part begins.
        remaining_m: To the end of that lane.
        width_m: Of that lane, None on a curve of the model's own.
        left, right: The sides of the road, from the centre of that lane there.
        next_lanes: What follows at its end, straightest first.
        route: The lanes from the start to the place, in the order they were passed.
        taken_by: Short ids of those in whose place an object there would stand.
        nearest_free_m: The distance of the nearest free place, None where there is none near or
            the place itself is free.
        start_lateral_m: How far left of the lane the starting agent is, None without one.
    """

    pose: Pose
    lane: str | None
    along_m: float
    remaining_m: float
    width_m: float | None
    left: RoadSide
    right: RoadSide
    next_lanes: tuple[str, ...]
    route: tuple[str, ...]
    taken_by: tuple[str, ...] = ()
    nearest_free_m: float | None = None
    start_lateral_m: float | None = None

    def to_document(self) -> dict[str, object]:
        """The answer under the names of the answer's block, rounded as the prompt is."""
        document: dict[str, object] = {
            "x_m": round_number(self.pose.x_m, 2),
            "y_m": round_number(self.pose.y_m, 2),
            "heading_rad": round_number(self.pose.heading_rad, 3),
            "heading_deg": round_number(math.degrees(self.pose.heading_rad), 1),
            "lane": self.lane,
            "taken_by": list(self.taken_by) or None,
            "along_m": round_number(self.along_m, 2),
            "remaining_m": round_number(self.remaining_m, 2),
            "lane_width_m": _rounded_if_known(self.width_m),
            "edge_left_m": _rounded_if_known(self.left.edge_m),
            "edge_right_m": _rounded_if_known(self.right.edge_m),
            "next_lanes": list(self.next_lanes),
            "route": list(self.route),
        }
        begins = {
            "carpark_left_m": self.left.carpark_m,
            "carpark_right_m": self.right.carpark_m,
            "walkway_left_m": self.left.walkway_m,
            "walkway_right_m": self.right.walkway_m,
        }
        document |= {
            name: round_number(value, 2) for name, value in begins.items() if value is not None
        }
        if self.taken_by:
            document["nearest_free_m"] = _rounded_if_known(self.nearest_free_m)
        if self.start_lateral_m is not None:
            document["start_lateral_m"] = round_number(self.start_lateral_m, 2)
        return document


def round_number(value: float, digits: int) -> float:
    """Rounded, and never minus zero."""
    return round(float(value), digits) + 0.0


def _rounded_if_known(value: float | None) -> float | None:
    return None if value is None else round_number(value, 2)
