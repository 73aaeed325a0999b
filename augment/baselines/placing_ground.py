"""The ground that the rule placer stands on: distances along the ego's lane, sides, road edges.

Frame: ego frame of the scene. d is to the left of a lane's own direction, in metres.
"""

import math
from collections.abc import Callable
from copy import copy
from functools import partial

import shapely

from augment.checks import Ground
from augment.checks.ground import rings
from augment.checks.lanes_across import LanesAcross
from augment.errors import CannotPlace
from augment.geometry.frames import Pose, difference
from augment.scene import entities
from augment.scene.intent import LaneChoice, Side
from augment.scene.lane_graph import LanePosition

_STEP_M = 0.25
_GAP_M = 1.5
"""A strip of this width that nobody drives on is the end of the road."""
_WIDEST_M = 30.0
_BESIDE_LANES_M = 4.0
_ALONG_RAD = math.radians(30.0)
_ABREAST_M, _ABREAST_TRIES = 0.01, 8


class PlacingGround:
    """A scene read from the ego's place on its lane, along the route that is asked for.

    Raises:
        CannotPlace: The ego stands on no lane, so nothing lies along it.
    """

    def __init__(
        self, ground: Ground, turn: entities.TurnType = entities.TurnType.STRAIGHT
    ) -> None:
        self.scene = scene = ground.scene
        lanes = LanesAcross.of(ground, turn)
        if lanes is None:
            raise CannotPlace("The ego stands on no lane of the map.")
        self.lanes, self.route, self.graph = lanes, lanes.route, ground.graph
        self.side_sign = lanes.side_sign
        self.kerb = Side(scene.traffic_side.value)
        self._drivable, self._walkways = (
            shapely.union_all(rings([area for area in scene.areas if area.kind is kind]))
            for kind in (entities.AreaKind.DRIVABLE, entities.AreaKind.WALKWAY)
        )

    def over(self, via: str | None) -> "PlacingGround":
        """Return the same along the way to a lane."""
        there, lanes = copy(self), self.lanes.over(via)
        assert lanes is not None, "what a scene does not have is refused before"
        there.lanes, there.route = lanes, lanes.route
        return there

    def along(self, distance_m: float) -> LanePosition:
        """Return the place that far along the ego's lane (negative: back).

        Raises:
            CannotPlace: The lanes end before.
        """
        place = self.route.lane_position(distance_m)
        if place is not None:
            return place
        end_m = self.route.ends_m[-1] if distance_m > 0.0 else self.route.ego_s_m
        where = "ahead of" if distance_m > 0.0 else "behind"
        raise CannotPlace(f"The lanes end {end_m:.0f} m {where} the ego.")

    def beside(self, distance_m: float, lane: LaneChoice | None) -> LanePosition:
        """Return the place on a lane next to one on the ego's own; there the centre of that lane.

        Where no lane is said it is the ego's own.

        Raises:
            CannotPlace: The map has no such lane there.
        """
        own = self.along(distance_m)
        if lane in (None, LaneChoice.OWN):
            return own
        place = self.lanes.place(lane, distance_m)
        if place is None:
            words = "oncoming lane" if lane is LaneChoice.ONCOMING else f"lane on the {lane}"
            raise CannotPlace(f"The map has no {words} beside the ego's lane there.")
        sign = -1.0 if lane is LaneChoice.ONCOMING else 1.0
        for _ in range(_ABREAST_TRIES):
            # Where the lane runs at an angle to the way, its nearest point is not abreast.
            off_m = distance_m - self.route.locate(*place.pose.beside(0.0)).ahead_m
            if abs(off_m) < _ABREAST_M:
                break
            place = self.graph.along(place.lane_id, place.s_m, sign * off_m) or place
        return place

    def neighbour(self, place: LanePosition, side: Side) -> str | None:
        """Return the lane of the same direction on that side of the place's lane."""
        lane = self.lane(place)
        if not isinstance(lane, entities.Lane):
            return None
        return lane.left_neighbor if side is Side.LEFT else lane.right_neighbor

    def lane(self, place: LanePosition) -> entities.AnyLane:
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

        def is_on_lane(point: entities.Point) -> bool:
            return any(
                lane.centerline.project(*point).distance_m <= lane.width_m / 2.0 for lane in near
            )

        lanes_m = self._scan(pose, side, 0.0, is_on_lane)
        end_m = self._scan(pose, side, lanes_m, partial(_covers, self._drivable))
        return end_m if end_m - lanes_m <= _BESIDE_LANES_M else lanes_m

    # Private

    def _runs_along(self, lane: entities.AnyLane, pose: Pose) -> bool:
        place = lane.centerline.project(pose.x_m, pose.y_m)
        turn_rad = abs(difference(lane.centerline.heading_at(place.s_m), pose.heading_rad))
        return place.distance_m <= _WIDEST_M + lane.width_m / 2.0 and (
            min(turn_rad, math.pi - turn_rad) <= _ALONG_RAD
        )

    def _scan(
        self, pose: Pose, side: Side, start_m: float, is_road: Callable[[entities.Point], bool]
    ) -> float:
        """The last road straight across from `start_m` on, before a walkway or a gap."""
        end_m = across_m = start_m
        while across_m - end_m < _GAP_M and across_m < _WIDEST_M:
            across_m += _STEP_M
            point = pose.beside(side.sign * across_m)
            if _covers(self._walkways, point):
                break
            if is_road(point):
                end_m = across_m
        return end_m


def _covers(area: shapely.Geometry, point: entities.Point) -> bool:
    """Return whether a point lies in an area; its lower and left edges belong to it."""
    return bool(shapely.contains_xy(area, point[0] + 1e-9, point[1] + 1e-9))
