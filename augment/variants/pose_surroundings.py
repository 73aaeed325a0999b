"""What lies around a place on a lane: the sides of the road, and who stands there.

In: the `Ground` of a scene, its shown agents under their short ids. Out: distances from a lane's
centre to both sides, and the ids of those whose boxes a new object would overlap.
Frame: ego frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

from augment.checks import Ground
from augment.errors import ToolError
from augment.geometry.frames import Box, Pose, overlap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent

FURTHEST_EDGE_M = 30.0
"""The edge of the road is looked for as far beside a lane."""

FREE_GAP_M = 0.5
"""A place that is offered as free leaves this in front of the object and behind it."""

_TOUCH_M = 0.01
_SEARCHED_M = 50.0
_STEP_M = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class RoadSide:
    """One side of a road, from the centre of a lane at a right angle.

    Attributes:
        edge_m: To the edge of the road: over all lanes beside this one, up to a carpark. None
            where the road has none within `FURTHEST_EDGE_M`.
        carpark_m, walkway_m: To where the first one begins, None without one as near.
    """

    edge_m: float | None = None
    carpark_m: float | None = None
    walkway_m: float | None = None


def side_of_road(ground: Ground, centre: Pose, turn_rad: float) -> RoadSide:
    """The side of the road in the direction that is turned so far from a lane's own."""
    x_m, y_m, heading_rad = centre.x_m, centre.y_m, centre.heading_rad + turn_rad
    carpark_m, walkway_m = (
        surface.begins_m(x_m, y_m, heading_rad, FURTHEST_EDGE_M)
        for surface in (ground.carparks, ground.walkways)
    )
    edge_m = ground.road.reach_m(x_m, y_m, heading_rad, FURTHEST_EDGE_M)
    if carpark_m is not None and 0.0 < carpark_m < (math.inf if edge_m is None else edge_m):
        edge_m = carpark_m
    return RoadSide(edge_m=edge_m, carpark_m=carpark_m, walkway_m=walkway_m)


@dataclass(frozen=True, eq=False)
class Occupancy:
    """Who stands where before the change.

    Attributes:
        agents: The shown agents, the ego among them, by short id.
    """

    agents: Mapping[str, TrafficAgent]

    def taken_by(
        self, pose: Pose, object_type: AgentType, *, gap_m: float = 0.0
    ) -> tuple[str, ...]:
        """Ids of those whose boxes an object of usual size would overlap at that pose.

        Args:
            pose: Of its centre.
            object_type: Tells its size.
            gap_m: What it is to leave free in front of it and behind it.
        """
        length_m, width_m = LENGTH_WIDTH_M[object_type]
        box = Box(pose=pose, length_m=length_m + 2.0 * gap_m, width_m=width_m)
        reach_m = math.hypot(box.length_m, box.width_m) / 2.0
        return tuple(
            name
            for name, (other, other_reach_m) in self._boxes.items()
            if math.dist((pose.x_m, pose.y_m), (other.pose.x_m, other.pose.y_m))
            <= reach_m + other_reach_m
            and overlap(box, other).depth_m > _TOUCH_M
        )

    def nearest_free_m(
        self, pose_at: Callable[[float], Pose], object_type: AgentType, distance_m: float
    ) -> float | None:
        """The distance nearest to one that is taken where the object overlaps nobody.

        Args:
            pose_at: The pose at a distance; it raises ToolError past the ends of the lanes.
            object_type: Tells the object's size.
            distance_m: Where the object was to be.
        """
        for step in range(1, int(_SEARCHED_M / _STEP_M) + 1):
            for there_m in (distance_m + step * _STEP_M, distance_m - step * _STEP_M):
                try:
                    pose = pose_at(there_m)
                except ToolError:
                    continue
                if not self.taken_by(pose, object_type, gap_m=FREE_GAP_M):
                    return there_m
        return None

    @cached_property
    def _boxes(self) -> dict[str, tuple[Box, float]]:
        """Everybody's box, and the circle around it, by short id."""
        return {
            name: (agent.box, math.hypot(agent.length_m, agent.width_m) / 2.0)
            for name, agent in self.agents.items()
        }
