"""The ground that the rule placer stands on: distances along the ego's lane, sides, road edges.

Frame: ego frame of the scene. d is to the left of a lane's own direction, in metres.
"""

import math
from collections.abc import Callable
from functools import partial
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from augment.errors import CannotPlace
from augment.geometry.frames import Pose, difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    LENGTH_WIDTH_M,
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
_PARKED_SIDES = {
    Setting.BY_PARKED: (1.0, -1.0),
    Setting.BY_PARKED_LEFT: (1.0,),
    Setting.BY_PARKED_RIGHT: (-1.0,),
}
SIGNS = {Side.LEFT: 1.0, Side.RIGHT: -1.0}


def build_agent(
    kind: AgentType,
    pose: Pose,
    lane_id: str | None,
    size_m: tuple[float, float] | None = None,
    *,
    speed_mps: float = 0.0,
    walk_to_m: Point | None = None,
) -> TrafficAgent:
    """Return an agent of the kind's size, or of another length and width, its id still empty."""
    length_m, width_m = size_m or LENGTH_WIDTH_M[kind]
    return TrafficAgent(
        id="",
        type=kind,
        x_m=pose.x_m,
        y_m=pose.y_m,
        heading_rad=pose.heading_rad,
        length_m=length_m,
        width_m=width_m,
        speed_mps=speed_mps,
        lane_id=lane_id,
        walk_to_m=walk_to_m,
    )


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
        self._areas = {
            kind: shapely.union_all(
                [
                    shapely.make_valid(shapely.Polygon(area.boundary_m))
                    for area in scene.areas
                    if area.kind is kind
                ]
            )
            for kind in AreaKind
        }

    def along(self, distance_m: float) -> LanePosition:
        """Return the place that far along the ego's lane (negative: back).

        Raises:
            CannotPlace: The lanes end before.
        """
        place = self.route.lane_position(distance_m)
        if place is not None:
            return place
        low, high = 0.0, abs(distance_m)
        while high - low > 0.1:
            middle = (low + high) / 2.0
            position = self.route.lane_position(math.copysign(middle, distance_m))
            low, high = (low, middle) if position is None else (middle, high)
        where = "ahead of" if distance_m > 0.0 else "behind"
        raise CannotPlace(f"The lanes end {low:.0f} m {where} the ego.")

    def beside(self, distance_m: float, lane: LaneChoice | None) -> LanePosition:
        """Return the place on a lane next to one on the ego's own; there the centre of that lane.

        Where no lane is said it is the ego's own.

        Raises:
            CannotPlace: The map has no such lane there.
        """
        place = self.along(distance_m)
        if lane in (None, LaneChoice.OWN):
            return place
        if lane is LaneChoice.ONCOMING:
            lane_id, words = self._oncoming(place.pose), "oncoming lane"
        else:
            lane_id, words = self.neighbour(place, Side(lane)), f"lane on the {lane}"
        if lane_id is None or lane_id not in self.graph.lanes:
            raise CannotPlace(f"The map has no {words} beside the ego's lane there.")
        s_m = self.graph.lane(lane_id).centerline.project(place.pose.x_m, place.pose.y_m).s_m
        return self.graph.place(lane_id, s_m)

    def neighbour(self, place: LanePosition, side: Side) -> str | None:
        """Return the lane of the same direction on that side of the place's lane."""
        lane = self.lane(place)
        if not isinstance(lane, Lane):
            return None
        return lane.left_neighbor if side is Side.LEFT else lane.right_neighbor

    def lane(self, place: LanePosition) -> AnyLane:
        """Return the lane or connector of a place."""
        return self.graph.lane(place.lane_id)

    def lane_at(self, pose: Pose) -> str | None:
        """Return the id of the lane under a pose, None off every lane."""
        return self.graph.under(pose.x_m, pose.y_m, pose.heading_rad)

    def road_edge_m(self, pose: Pose, side: Side) -> float:
        """Return how far from a pose on a lane its road ends on that side, straight across.

        The road is the lanes that run along with it, in either direction, and what else can be
        driven on up to 4 m beyond them: a parking lane belongs to it, a side road does not.
        """
        near = [lane for lane in self.graph.lanes.values() if self._runs_along(lane, pose)]

        def is_on_lane(point: Point) -> bool:
            return any(
                lane.centerline.project(*point).distance_m <= lane.width_m / 2.0 for lane in near
            )

        lanes_m = self._scan(pose, side, 0.0, is_on_lane)
        is_driven = partial(self.within, kind=AreaKind.DRIVABLE)
        end_m = self._scan(pose, side, lanes_m, is_driven)
        return end_m if end_m - lanes_m <= _BESIDE_LANES_M else lanes_m

    def within(self, points_m: ArrayLike, kind: AreaKind) -> bool:
        """Return whether one of the points (..., 2) lies in an area of that kind."""
        # What lies on an edge belongs to the area above it or to its right.
        points = np.reshape(points_m, (-1, 2)) + 1e-9
        return bool(shapely.contains_xy(self._areas[kind], points).any())

    def fits(self, distance_m: float, path_m: NDArray[np.float64], setting: Setting) -> bool:
        """Return whether a place along the lane, and what is walked there, are in a setting."""
        in_junction = self._in_junction(distance_m)
        match setting:
            case Setting.OFF_CROSSWALK:
                return not self.within(path_m, AreaKind.CROSSWALK)
            case Setting.ON_CROSSWALK:
                return self.within(path_m, AreaKind.CROSSWALK)
            case Setting.IN_BEND:
                return self._bends(distance_m)
            case Setting.IN_INTERSECTION:
                return in_junction
            case Setting.AT_INTERSECTION:
                near = (distance_m - _NEAR_M, distance_m + _NEAR_M)
                return in_junction or any(map(self._in_junction, near))
            case Setting.BEFORE_INTERSECTION:
                return not self._crosses_junction(distance_m)
            case Setting.AFTER_INTERSECTION:
                return self._crosses_junction(distance_m) and not in_junction
        return self._is_by_parked(distance_m, _PARKED_SIDES[setting])

    # Private

    def _in_junction(self, distance_m: float) -> bool:
        place = self.route.lane_position(distance_m)
        if place is None:
            return False
        if self._areas[AreaKind.INTERSECTION].is_empty:
            return isinstance(self.lane(place), LaneConnector)
        return self.within((place.pose.x_m, place.pose.y_m), AreaKind.INTERSECTION)

    def _crosses_junction(self, distance_m: float) -> bool:
        """Whether an intersection lies between the ego and a place, or at the place."""
        steps = max(2, int(abs(distance_m)))
        return any(map(self._in_junction, np.linspace(0.0, distance_m, steps).tolist()))

    def _bends(self, distance_m: float) -> bool:
        steps = (-_BEND_WITHIN_M, 0.0, _BEND_WITHIN_M)
        around = [self.route.lane_position(distance_m + step) for step in steps]
        headings = [place.pose.heading_rad for place in around if place is not None]
        turns = [abs(difference(after, before)) for before, after in pairwise(headings)]
        return sum(turns) >= _BEND_RAD

    def _is_by_parked(self, distance_m: float, sides: tuple[float, ...]) -> bool:
        """Whether vehicles stand beside a place on the lane, on one of the sides."""
        pose = self.along(distance_m).pose
        for agent in self.scene.agents:
            local = pose.pose_to_local(agent.pose)
            if (
                agent.type in _PARKED_TYPES
                and abs(agent.speed_mps) <= _STANDS_BELOW_MPS
                and math.hypot(local.x_m, local.y_m) <= _PARKED_WITHIN_M
                and math.copysign(1.0, local.y_m) in sides
            ):
                return True
        return False

    def _oncoming(self, pose: Pose) -> str | None:
        """The nearest way across the road that leads the other way."""
        for step in range(1, int(_ONCOMING_WITHIN_M / _STEP_M)):
            for d_m in (step * _STEP_M, -step * _STEP_M):
                x_m, y_m = pose.beside(d_m)
                lane_id = self.graph.under(x_m, y_m, pose.heading_rad + math.pi)
                if lane_id is None:
                    continue
                line = self.graph.lane(lane_id).centerline
                heading_rad = line.heading_at(line.project(x_m, y_m).s_m)
                if abs(difference(heading_rad, pose.heading_rad)) > math.radians(135.0):
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
        end_m = across_m = start_m
        while across_m - end_m < _GAP_M and across_m < _WIDEST_M:
            across_m += _STEP_M
            point = pose.beside(SIGNS[side] * across_m)
            if self.within(point, AreaKind.WALKWAY):
                break
            if is_road(point):
                end_m = across_m
        return end_m
