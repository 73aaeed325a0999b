"""The ground that the rule placer stands on: distances along the ego's lane, sides, road edges.

Frame: ego frame of the scene. d is to the left of a lane's own direction, in metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from augment.errors import CannotPlace
from augment.geometry.frames import Pose, difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    AgentType,
    AreaKind,
    Lane,
    LaneConnector,
    Point,
    Scene,
    TrafficAgent,
    TurnType,
)
from augment.scene.intent import LaneChoice, Setting, Side
from augment.scene.lane_graph import AnyLane, LanePosition

_STEP_M = 0.25
_GAP_M = 1.5
"""A strip of this width that nobody drives on is the end of the road."""

_WIDEST_M = 30.0
_BESIDE_LANES_M = 4.0
_ALONG_RAD = math.radians(30.0)
_ONCOMING_WITHIN_M = 15.0
_NEAR_M = 10.0
_BEND_WITHIN_M, _BEND_RAD = 25.0, math.radians(1.5)
"""Over 50 m of a straight road the direction changes by less."""

_PARKED_WITHIN_M, _STANDS_BELOW_MPS = 12.0, 0.5
_PARKED_TYPES = frozenset({AgentType.VEHICLE, AgentType.BUS})


class PlacingGround:
    """A scene read from the ego's place on its lane, along the route that is asked for.

    Raises:
        CannotPlace: The ego stands on no lane, so nothing lies along it.
    """

    def __init__(self, scene: Scene, turn: TurnType = TurnType.STRAIGHT) -> None:
        self.scene = scene
        route = EgoRoute.of(scene, turn=turn)
        if route is None:
            raise CannotPlace("The ego stands on no lane of the map.")
        self.route, self.graph = route, route.graph
        self.kerb = Side(scene.traffic_side.value)

    def along(self, distance_m: float, d_m: float = 0.0) -> LanePosition:
        """The place that far along the ego's lane (negative: back) and d to its left.

        Raises:
            CannotPlace: The lanes end before.
        """
        place = self.route.lane_position(distance_m, d_m)
        if place is None:
            end, where = self._reach(distance_m)
            raise CannotPlace(f"The lanes end {end:.0f} m {where} the ego.")
        return place

    def beside(self, place: LanePosition, lane: LaneChoice | None) -> LanePosition:
        """The place on a lane next to a place on the ego's own; there the centre of that lane.

        Where no lane is said it is the ego's own.

        Raises:
            CannotPlace: The map has no such lane there.
        """
        if lane in (None, LaneChoice.OWN):
            return place
        lane_id = self._oncoming(place) if lane is LaneChoice.ONCOMING else None
        here = self.graph.lane(place.lane_id)
        if lane is LaneChoice.LEFT and isinstance(here, Lane):
            lane_id = here.left_neighbor
        if lane is LaneChoice.RIGHT and isinstance(here, Lane):
            lane_id = here.right_neighbor
        if lane_id is None or lane_id not in self.graph.lanes:
            words = "oncoming lane" if lane is LaneChoice.ONCOMING else f"lane on the {lane}"
            raise CannotPlace(f"The map has no {words} beside the ego's lane there.")
        s_m = self.graph.lane(lane_id).centerline.project(place.pose.x_m, place.pose.y_m).s_m
        return self.graph.place(lane_id, s_m)

    def lane(self, place: LanePosition) -> AnyLane:
        """The lane or connector of a place."""
        return self.graph.lane(place.lane_id)

    def has_neighbour(self, place: LanePosition, side: Side) -> bool:
        """Whether another lane of the same direction lies on that side of the place's lane."""
        lane = self.lane(place)
        if not isinstance(lane, Lane):
            return False
        return (lane.left_neighbor if side is Side.LEFT else lane.right_neighbor) is not None

    def lane_at(self, pose: Pose) -> str | None:
        """The id of the lane under a pose, None off every lane."""
        return self.graph.under(pose.x_m, pose.y_m, pose.heading_rad)

    def left_of_lane_m(self, agent: TrafficAgent) -> float:
        """How far an agent stands left of the centre of its lane, 0 off every lane."""
        if agent.lane_id is None:
            return 0.0
        return self.graph.lane(agent.lane_id).centerline.project(agent.x_m, agent.y_m).d_m

    def road_edge_m(self, pose: Pose, side: Side) -> float:
        """How far from a pose on a lane its road ends on that side, straight across.

        The road is the lanes that run along with it, in either direction, and what else can be
        driven on up to 4 m beyond them: a parking lane belongs to it, a side road does not.
        """
        near = [lane for lane in self.graph.lanes.values() if self._runs_along(lane, pose)]
        lanes_m = self._scan(pose, side, 0.0, lambda point: _on_any(near, point))
        end_m = self._scan(
            pose, side, lanes_m, lambda point: self.within(point, AreaKind.DRIVABLE)
        )
        return end_m if end_m - lanes_m <= _BESIDE_LANES_M else lanes_m

    def within(self, point_m: Point, kind: AreaKind) -> bool:
        """Whether a point lies in an area of that kind."""
        return any(
            area.kind is kind and _inside(point_m, np.array(area.boundary_m))
            for area in self.scene.areas
        )

    def fits(self, distance_m: float, path_m: NDArray[np.float64], setting: Setting) -> bool:
        """Whether a place along the lane, and the points (P, 2) walked there, are in a setting."""
        match setting:
            case Setting.OFF_CROSSWALK:
                return not self._meets_crosswalk(path_m)
            case Setting.ON_CROSSWALK:
                return self._meets_crosswalk(path_m)
            case Setting.IN_BEND:
                return self._bends(distance_m)
            case Setting.IN_INTERSECTION:
                return self._in_junction(distance_m)
            case Setting.AT_INTERSECTION:
                near = (distance_m - _NEAR_M, distance_m, distance_m + _NEAR_M)
                return any(self._in_junction(one) for one in near)
            case Setting.BEFORE_INTERSECTION:
                return not self._crosses_junction(distance_m)
            case Setting.AFTER_INTERSECTION:
                past = self._crosses_junction(distance_m)
                return past and not self._in_junction(distance_m)
        return self._is_by_parked(distance_m, setting)

    # Private

    def _meets_crosswalk(self, path_m: NDArray[np.float64]) -> bool:
        return any(self.within((x, y), AreaKind.CROSSWALK) for x, y in path_m)

    def _in_junction(self, distance_m: float) -> bool:
        place = self.route.lane_position(distance_m)
        if place is None:
            return False
        if any(area.kind is AreaKind.INTERSECTION for area in self.scene.areas):
            return self.within((place.pose.x_m, place.pose.y_m), AreaKind.INTERSECTION)
        return isinstance(self.lane(place), LaneConnector)

    def _crosses_junction(self, distance_m: float) -> bool:
        """Whether an intersection lies between the ego and a place, or at the place."""
        steps = max(2, int(abs(distance_m)))
        return any(self._in_junction(float(s)) for s in np.linspace(0.0, distance_m, steps))

    def _bends(self, distance_m: float) -> bool:
        around = [
            self.route.lane_position(distance_m + step)
            for step in (-_BEND_WITHIN_M, 0.0, _BEND_WITHIN_M)
        ]
        headings = [place.pose.heading_rad for place in around if place is not None]
        turns = [abs(difference(after, before)) for before, after in pairwise(headings)]
        return sum(turns) >= _BEND_RAD

    def _is_by_parked(self, distance_m: float, setting: Setting) -> bool:
        """Whether vehicles stand beside a place on the lane, on the side that is asked for."""
        pose = self.along(distance_m).pose
        sides = {Setting.BY_PARKED_LEFT: (1.0,), Setting.BY_PARKED_RIGHT: (-1.0,)}
        for agent in self.scene.agents:
            if agent.type not in _PARKED_TYPES or abs(agent.speed_mps) > _STANDS_BELOW_MPS:
                continue
            local = pose.pose_to_local(agent.pose)
            near = math.hypot(local.x_m, local.y_m) <= _PARKED_WITHIN_M
            if near and math.copysign(1.0, local.y_m) in sides.get(setting, (1.0, -1.0)):
                return True
        return False

    def _reach(self, distance_m: float) -> tuple[float, str]:
        """How far the lanes run from the ego in the direction of a distance too great."""
        low, high = 0.0, abs(distance_m)
        sign = math.copysign(1.0, distance_m)
        while high - low > 0.1:
            middle = (low + high) / 2.0
            position = self.route.lane_position(sign * middle)
            low, high = (low, middle) if position is None else (middle, high)
        return low, "ahead of" if sign > 0.0 else "behind"

    def _oncoming(self, place: LanePosition) -> str | None:
        """The nearest way across the road that leads the other way."""
        for step in range(1, int(_ONCOMING_WITHIN_M / _STEP_M)):
            for d_m in (step * _STEP_M, -step * _STEP_M):
                x_m, y_m = place.pose.to_parent(np.array([[0.0, d_m]]))[0]
                lane_id = self.graph.under(x_m, y_m, place.pose.heading_rad + math.pi)
                if lane_id is None:
                    continue
                line = self.graph.lane(lane_id).centerline
                heading_rad = line.heading_at(line.project(x_m, y_m).s_m)
                if abs(difference(heading_rad, place.pose.heading_rad)) > math.radians(135.0):
                    return lane_id
        return None

    def _runs_along(self, lane: AnyLane, pose: Pose) -> bool:
        place = lane.centerline.project(pose.x_m, pose.y_m)
        turn_rad = abs(difference(lane.centerline.heading_at(place.s_m), pose.heading_rad))
        return place.distance_m <= _WIDEST_M + lane.width_m / 2.0 and (
            min(turn_rad, math.pi - turn_rad) <= _ALONG_RAD
        )

    def _scan(
        self, pose: Pose, side: Side, start_m: float, is_road: Callable[[Point], bool]
    ) -> float:
        """The last road straight across from `start_m` on, before a walkway or a gap."""
        sign = 1.0 if side is Side.LEFT else -1.0
        end_m = across_m = start_m
        while across_m - end_m < _GAP_M and across_m < _WIDEST_M:
            across_m += _STEP_M
            x_m, y_m = pose.to_parent(np.array([[0.0, sign * across_m]]))[0]
            if self.within((x_m, y_m), AreaKind.WALKWAY):
                break
            if is_road((x_m, y_m)):
                end_m = across_m
        return end_m


def _on_any(lanes: list[AnyLane], point_m: Point) -> bool:
    return any(
        lane.centerline.project(*point_m).distance_m <= lane.width_m / 2.0 for lane in lanes
    )


def _inside(point_m: Point, boundary_m: NDArray[np.float64]) -> bool:
    """Whether a point lies in a polygon (P, 2): an odd number of its sides is to the right."""
    x, y = point_m
    start, end = boundary_m, np.roll(boundary_m, -1, axis=0)
    spans = (start[:, 1] > y) != (end[:, 1] > y)
    if not spans.any():
        return False
    a, b = start[spans], end[spans]
    crossing_x = a[:, 0] + (y - a[:, 1]) * (b[:, 0] - a[:, 0]) / (b[:, 1] - a[:, 1])
    return bool(np.count_nonzero(crossing_x > x) % 2)
