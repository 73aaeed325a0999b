"""What the pose tool answers: one place on a lane, under the names of the answer's block."""

from __future__ import annotations

import math
from dataclasses import dataclass

from augment.geometry.frames import Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseOnLane:
    """One place.

    Attributes:
        lane: The short id of the lane or connector that the place was counted on, None on a
            curve of the model's own, and where the place is beside the lane's width.
        other_lane: Beside it: the lane or connector under the place, None where there is none.
        is_beside: Whether the place is outside the lane's width.
        along_m: From where the shown part of that lane begins.
        remaining_m: From the place to the end of that lane.
        width_m: Of that lane, None on a foreign curve.
        edge_left_m, edge_right_m: From the centre of the lane there to the edge of the road, at a
            right angle; None where the road has none within 30 m.
        next_lanes: What follows at its end, straightest first.
        route: The lanes from the start to the place, in the order they were passed.
        start_lateral_m: How far left of the lane the starting agent is, None without one.
    """

    pose: Pose
    lane: str | None
    along_m: float
    remaining_m: float
    width_m: float | None
    edge_left_m: float | None
    edge_right_m: float | None
    next_lanes: tuple[str, ...]
    route: tuple[str, ...]
    is_beside: bool = False
    other_lane: str | None = None
    start_lateral_m: float | None = None

    def to_document(self) -> dict[str, object]:
        """The answer under the names of the answer's block, rounded as the prompt is."""
        document: dict[str, object] = {
            "x_m": round_number(self.pose.x_m, 2),
            "y_m": round_number(self.pose.y_m, 2),
            "heading_rad": round_number(self.pose.heading_rad, 3),
            "heading_deg": round_number(math.degrees(self.pose.heading_rad), 1),
            "lane": self.lane,
            "along_m": round_number(self.along_m, 2),
            "remaining_m": round_number(self.remaining_m, 2),
            "lane_width_m": _rounded_if_known(self.width_m),
            "edge_left_m": _rounded_if_known(self.edge_left_m),
            "edge_right_m": _rounded_if_known(self.edge_right_m),
            "next_lanes": list(self.next_lanes),
            "route": list(self.route),
        }
        if self.is_beside:
            document["other_lane"] = self.other_lane
        if self.start_lateral_m is not None:
            document["start_lateral_m"] = round_number(self.start_lateral_m, 2)
        return document


def round_number(value: float, digits: int) -> float:
    """Rounded, and never minus zero."""
    return round(float(value), digits) + 0.0


def _rounded_if_known(value: float | None) -> float | None:
    return None if value is None else round_number(value, 2)
