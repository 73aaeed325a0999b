"""The ego's own way: what is ahead, behind and beside, counted as instructions count it.

Frame: the scene's. Ahead runs along the ego's lane and what follows it straightest, from the
ego's centre; left is across it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from augment.checks.ground import REACH_M, Ground
from augment.checks.ways import Beside, best_aligned
from augment.geometry.angles import difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import TrafficAgent
from augment.scene.intent import LaneChoice
from augment.scene.lane_graph import LaneGraph

_BESIDE_M = 1.0
"""A lane whose centre is nearer than this is the same lane."""
_ALONG_DEG, _AGAINST_DEG = 45.0, 135.0
_JOINT_M = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class OnWay:
    """A place: along the way (negative behind the ego), left of it, and the way's direction."""

    ahead_m: float
    left_m: float
    tangent_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """A lane at one station: where its centre is, left of the own way, and how it runs there."""

    left_m: float
    width_m: float
    tangent_rad: float


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnWay:
    """The line of the own way.

    Attributes:
        zero_m: Where on the line the ego is.
    """

    line: Polyline
    zero_m: float
    ground: Ground

    @classmethod
    def of(cls, ground: Ground) -> OwnWay | None:
        """The way of the ground's ego, None where the map has no lane for it."""
        place = ground.ego_place
        if place is None:
            return None
        before = _before(ground.graph, place.way_id)
        after = ground.graph.route(place.way_id, place.s_m + REACH_M)
        ways = [ground.graph.ways[name] for name in (*before, *after)]
        lengths = (ground.graph.ways[name].centerline.length_m for name in before)
        points = [point for way in ways for point in way.centerline.points_m.tolist()]
        return cls(line=Polyline(points), zero_m=sum(lengths) + place.s_m, ground=ground)

    def place(self, x_m: float, y_m: float) -> OnWay:
        """Where a point is."""
        found = self.line.project(x_m, y_m)
        return OnWay(
            ahead_m=found.s_m - self.zero_m,
            left_m=found.d_m,
            tangent_rad=self.line.heading_at(found.s_m),
        )

    def of_agent(self, agent: TrafficAgent) -> OnWay:
        """Where an agent's centre is."""
        return self.place(agent.x_m, agent.y_m)

    def position(self, ahead_m: float, left_m: float) -> tuple[float, float]:
        """The point at a place."""
        return self.line.position(self.zero_m + ahead_m, left_m)

    def band(self, choice: LaneChoice, ahead_m: float) -> Band | None:
        """The lane of that choice, None where there is none there."""
        station_m = self.zero_m + ahead_m
        tangent_rad = self.line.heading_at(station_m)
        near = self.ground.ways.beside(*self.line.position(station_m))
        if choice is LaneChoice.OWN:
            own = best_aligned(near, tangent_rad)
            if own is None:
                return None
            return Band(left_m=0.0, width_m=own.width_m, tangent_rad=tangent_rad)
        return min(
            (band for one in near if (band := _band(one, tangent_rad, choice))),
            key=lambda band: abs(band.left_m),
            default=None,
        )


# Private


def _before(graph: LaneGraph, way_id: str) -> Sequence[str]:
    """What leads to a way, straightest, in the direction of travel, up to the reach."""
    names, total_m = [way_id], 0.0
    while total_m < REACH_M:
        leading = [name for name in graph.predecessors(names[0]) if name not in names]
        if not leading:
            break
        names.insert(0, leading[0])
        total_m += graph.ways[leading[0]].centerline.length_m
    return names[:-1]


def _band(one: Beside, tangent_rad: float, choice: LaneChoice) -> Band | None:
    """A way beside the own one as a lane of the choice, None where it is not."""
    turn_deg = math.degrees(abs(difference(one.tangent_rad, tangent_rad)))
    is_along, is_against = turn_deg < _ALONG_DEG, turn_deg > _AGAINST_DEG
    left_m = one.d_m if is_against else -one.d_m
    if one.beyond_m > _JOINT_M or abs(left_m) < _BESIDE_M:
        return None
    fits = {
        LaneChoice.LEFT: is_along and left_m > 0.0,
        LaneChoice.RIGHT: is_along and left_m < 0.0,
        LaneChoice.ONCOMING: is_against,
        LaneChoice.OWN: False,
    }
    if not fits[choice]:
        return None
    return Band(left_m=left_m, width_m=one.width_m, tangent_rad=one.tangent_rad)
