"""Lanes and connectors as one graph: what lies under a point, and what comes next.

`AnyLane` is a lane or a lane connector; both are read by the four verbs of `Polyline`.
Frame: ego frame of the scene.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from augment.errors import UnknownName
from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline, Projection
from augment.scene.entities import Lane, LaneConnector, Scene, TrafficSide, TurnType

AnyLane = Lane | LaneConnector

_TURN_ORDER = {TurnType.STRAIGHT: 0, TurnType.LEFT: 1, TurnType.RIGHT: 1, TurnType.U_TURN: 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePosition:
    """A position on a lane or connector: `s_m` along its centreline, `d_m` to the left of it."""

    lane_id: str
    s_m: float
    d_m: float
    pose: Pose
    remaining_m: float


class LaneGraph:
    """The lanes of one scene, by id, with their successors and predecessors."""

    def __init__(self, scene: Scene) -> None:
        lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
        self.lanes: dict[str, AnyLane] = {lane.id: lane for lane in lanes}
        self._next: dict[str, list[str]] = {lane_id: [] for lane_id in self.lanes}
        self._previous: dict[str, list[str]] = {lane_id: [] for lane_id in self.lanes}
        for lane in scene.lanes:
            for following in lane.successors:
                self._join(lane.id, following)
        for connector in scene.connectors:
            self._join(connector.from_lane, connector.id)
            self._join(connector.id, connector.to_lane)

    def lane(self, lane_id: str) -> AnyLane:
        """The lane or connector of that id.

        Raises:
            UnknownName: There is none.
        """
        try:
            return self.lanes[lane_id]
        except KeyError:
            raise UnknownName("lane", lane_id, sorted(self.lanes)) from None

    def successors(self, lane_id: str) -> tuple[str, ...]:
        """Ids of what follows, straightest first."""
        return tuple(sorted(self._next[lane_id], key=lambda name: self._bend(lane_id, name)))

    def predecessors(self, lane_id: str) -> tuple[str, ...]:
        """Ids of what leads here, straightest first."""
        return tuple(
            sorted(self._previous[lane_id], key=lambda name: self._bend_back(name, lane_id))
        )

    def abreast(self, lane_id: str) -> tuple[str, ...]:
        """Return a lane and its neighbours of the same direction; a connector alone."""
        names, waiting = [lane_id], [self.lane(lane_id)]
        while waiting:
            here = waiting.pop()
            if not isinstance(here, Lane):
                continue
            for name in (here.left_neighbor, here.right_neighbor):
                beside = self.lanes.get(name or "")
                if isinstance(beside, Lane) and beside.id not in names:
                    names.append(beside.id)
                    waiting.append(beside)
        return tuple(names)

    def under(self, x_m: float, y_m: float, heading_rad: float | None = None) -> str | None:
        """The lane whose width covers the point; of several the best aligned, else the nearest."""
        covering = [
            (self._misfit(lane, place, heading_rad), lane.id)
            for lane in self._boxed(x_m, y_m)
            for place in [lane.centerline.project(x_m, y_m)]
            if self._covers(lane, place)
        ]
        return min(covering)[1] if covering else None

    def nearest(
        self, x_m: float, y_m: float, *, among: Iterable[str] | None = None
    ) -> tuple[str, Projection] | None:
        """The lane whose centreline comes nearest to the point, None on a map without lanes."""
        projections = [
            (lane_id, self.lanes[lane_id].centerline.project(x_m, y_m))
            for lane_id in (self.lanes if among is None else among)
        ]
        return min(projections, key=lambda item: item[1].distance_m) if projections else None

    def place(self, lane_id: str, s_m: float, d_m: float = 0.0) -> LanePosition:
        """The place s along one lane and d to its left."""
        line = self.lane(lane_id).centerline
        return LanePosition(
            lane_id=lane_id,
            s_m=s_m,
            d_m=d_m,
            pose=line.pose_at(s_m, d_m),
            remaining_m=line.length_m - s_m,
        )

    def along(
        self,
        lane_id: str,
        start_m: float,
        distance_m: float,
        d_m: float = 0.0,
        *,
        turn: TurnType = TurnType.STRAIGHT,
    ) -> LanePosition | None:
        """The place `distance_m` further (negative: back) along the lanes, None past the map.

        Where the lanes part, the lane of that `turn` is taken, else the straightest.
        """
        here, s_m = lane_id, start_m + distance_m
        seen = {here}
        while s_m > self.lanes[here].centerline.length_m:
            following = self._choose(here, turn)
            if following is None or following in seen:
                return None
            s_m -= self.lanes[here].centerline.length_m
            here = following
            seen.add(here)
        while s_m < 0.0:
            before = [name for name in self.predecessors(here) if name not in seen]
            if not before:
                return None
            here = before[0]
            seen.add(here)
            s_m += self.lanes[here].centerline.length_m
        return self.place(here, s_m, d_m)

    def route(
        self, lane_id: str, length_m: float, *, turn: TurnType = TurnType.STRAIGHT
    ) -> list[str]:
        """Ids of the lanes from this one on, until `length_m` of them are collected."""
        route, total = [lane_id], self.lane(lane_id).centerline.length_m
        while total < length_m:
            following = self._choose(route[-1], turn)
            if following is None or following in route:
                break
            route.append(following)
            total += self.lanes[following].centerline.length_m
        return route

    def _boxed(self, x_m: float, y_m: float) -> list[AnyLane]:
        """The lanes in whose box the point lies; all others are more than half a width away."""
        low_x, low_y, high_x, high_y = self._boxes
        inside = (low_x <= x_m) & (x_m <= high_x) & (low_y <= y_m) & (y_m <= high_y)
        lanes = list(self.lanes.values())
        return [lanes[index] for index in np.flatnonzero(inside)]

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        """The box around each lane, half a width out: least x, least y, most x, most y (4, W)."""
        boxes = [
            [
                *(lane.centerline.points_m.min(axis=0) - lane.width_m / 2.0 - 0.1),
                *(lane.centerline.points_m.max(axis=0) + lane.width_m / 2.0 + 0.1),
            ]
            for lane in self.lanes.values()
        ]
        return np.array(boxes, dtype=np.float64).reshape(-1, 4).T

    def _join(self, before: str | None, after: str | None) -> None:
        if before in self._next and after in self._previous:
            self._next[before].append(after)
            self._previous[after].append(before)

    def _choose(self, lane_id: str, turn: TurnType) -> str | None:
        options = self.successors(lane_id)
        wanted = [
            name
            for name in options
            if isinstance(lane := self.lanes[name], LaneConnector) and lane.turn_type is turn
        ]
        return next(iter(wanted or options), None)

    def _bend(self, before: str, after: str) -> tuple[int, float]:
        """How far one turns from the end of a lane to the end of the next."""
        line, earlier = self.lanes[after].centerline, self.lanes[before].centerline
        turn = difference(line.heading_at(line.length_m), earlier.heading_at(earlier.length_m))
        return self._turn_order(after), abs(turn)

    def _bend_back(self, before: str, after: str) -> tuple[int, float]:
        """The same for who comes from behind, start to start.

        Lanes that merge end alike: what tells them apart is how they got there.
        """
        line, earlier = self.lanes[after].centerline, self.lanes[before].centerline
        turn = difference(line.heading_at(0.0), earlier.heading_at(0.0))
        return self._turn_order(before), abs(turn)

    def _turn_order(self, lane_id: str) -> int:
        lane = self.lanes[lane_id]
        return _TURN_ORDER[lane.turn_type] if isinstance(lane, LaneConnector) else 0

    @staticmethod
    def _covers(lane: AnyLane, place: Projection) -> bool:
        """Whether the point is within the lane's width and not beyond one of its ends."""
        inside = 1e-9 < place.s_m < lane.centerline.length_m - 1e-9
        return place.distance_m <= lane.width_m / 2.0 and (inside or place.distance_m < 0.05)

    @staticmethod
    def _misfit(
        lane: AnyLane, place: Projection, heading_rad: float | None
    ) -> tuple[float, float]:
        if heading_rad is None:
            return 0.0, place.distance_m
        turn = abs(difference(lane.centerline.heading_at(place.s_m), heading_rad))
        return round(turn / math.radians(15.0)), place.distance_m


STRAIGHT_BELOW_RAD = math.radians(30.0)
U_TURN_ABOVE_RAD = math.radians(150.0)
ONCOMING_ABOVE_RAD = math.radians(150.0)
ONCOMING_WITHIN_M = 8.0
"""Between centrelines: two lanes side by side, or with a narrow median between."""

MOST_BESIDE = 200
"""Lanes that are looked at beside one; no road has as many."""


def turn_type_of(line: Polyline) -> TurnType:
    """How a line turns from its first point to its last, all bends summed up."""
    headings = np.arctan2(*np.diff(line.points_m, axis=0).T[::-1]).tolist()
    turn = sum(difference(after, before) for before, after in pairwise(headings))
    if abs(turn) < STRAIGHT_BELOW_RAD:
        return TurnType.STRAIGHT
    if abs(turn) > U_TURN_ABOVE_RAD:
        return TurnType.U_TURN
    return TurnType.LEFT if turn > 0.0 else TurnType.RIGHT


def traffic_side_of(lanes: Sequence[Lane]) -> TrafficSide | None:
    """The side that most lanes keep to: oncoming traffic to the left means right-hand traffic.

    Returns:
        None where no two lanes of opposite directions lie side by side, or as many speak for
        either side.
    """
    if not lanes:
        return None
    low = np.array([lane.centerline.points_m.min(axis=0) for lane in lanes]) - ONCOMING_WITHIN_M
    high = np.array([lane.centerline.points_m.max(axis=0) for lane in lanes]) + ONCOMING_WITHIN_M

    def near(middle: Pose) -> Iterator[Lane]:
        """The lanes whose surrounding rectangle comes near; of very many, the first."""
        here = np.array([middle.x_m, middle.y_m])
        found = np.flatnonzero(((low <= here) & (here <= high)).all(axis=1))
        return (lanes[place] for place in found[:MOST_BESIDE].tolist())

    balance = sum(_oncoming_side(lane, near) for lane in lanes)
    if balance == 0:
        return None
    return TrafficSide.RIGHT if balance > 0 else TrafficSide.LEFT


# Private


def _oncoming_side(lane: Lane, near: Callable[[Pose], Iterator[Lane]]) -> int:
    """1 if the nearest oncoming lane is to the left of the lane's middle, -1 right, 0 none."""
    middle = lane.centerline.pose_at(lane.centerline.length_m / 2.0)
    nearest_m, side = ONCOMING_WITHIN_M, 0
    for other in near(middle):
        place = other.centerline.project(middle.x_m, middle.y_m)
        if other is lane or place.distance_m > nearest_m:
            continue
        heading_rad = other.centerline.heading_at(place.s_m)
        if abs(difference(heading_rad, middle.heading_rad)) > ONCOMING_ABOVE_RAD:
            # The other lane runs against this one, so each sees the other on the same side.
            nearest_m, side = place.distance_m, 1 if place.d_m > 0.0 else -1
    return side
