"""Lanes and connectors as one graph: what lies under a point, what comes next, what turns where.

`AnyLane` is a lane or a lane connector; both are read by the four verbs of `Polyline`.
Frame: ego frame of the scene; any one frame for turns and sides.
"""

import math
from collections.abc import Iterable, Sequence
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

STRAIGHT_BELOW_RAD = math.radians(30.0)
U_TURN_ABOVE_RAD = math.radians(150.0)
ONCOMING_ABOVE_RAD = math.radians(150.0)
ONCOMING_WITHIN_M = 8.0
"""Between centrelines: two lanes side by side, or with a narrow median between."""
MOST_BESIDE = 200
"""Lanes that are looked at beside one; no road has as many."""
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
        joints: list[tuple[str | None, str | None]] = [
            (lane.id, following) for lane in scene.lanes for following in lane.successors
        ]
        for connector in scene.connectors:
            joints += [(connector.from_lane, connector.id), (connector.id, connector.to_lane)]
        for before, after in joints:
            if before in self._next and after in self._previous:
                self._next[before].append(after)
                self._previous[after].append(before)

    def lane(self, lane_id: str) -> AnyLane:
        """Return the lane or connector of that id.

        Raises:
            UnknownName: There is none.
        """
        if lane_id not in self.lanes:
            raise UnknownName("lane", lane_id, sorted(self.lanes))
        return self.lanes[lane_id]

    def successors(self, lane_id: str) -> tuple[str, ...]:
        """Return ids of what follows, straightest first by the turn from end to end."""

        def bend(name: str) -> tuple[int, float]:
            here, after = self.lanes[lane_id].centerline, self.lanes[name].centerline
            turn = difference(after.heading_at(after.length_m), here.heading_at(here.length_m))
            return self._turn_order(name), abs(turn)

        return tuple(sorted(self._next[lane_id], key=bend))

    def predecessors(self, lane_id: str) -> tuple[str, ...]:
        """Return ids of what leads here, straightest first by the turn from start to start.

        Lanes that merge end alike: what tells them apart is how they got there.
        """

        def bend(name: str) -> tuple[int, float]:
            here, before = self.lanes[lane_id].centerline, self.lanes[name].centerline
            turn = difference(here.heading_at(0.0), before.heading_at(0.0))
            return self._turn_order(name), abs(turn)

        return tuple(sorted(self._previous[lane_id], key=bend))

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
        """Return the lane whose width covers a point and none of whose ends the point is beyond.

        Of several it is the best aligned one, else the nearest.
        """
        covering = []
        for lane in self._boxed(x_m, y_m):
            line = lane.centerline
            place = line.project(x_m, y_m)
            inside = 1e-9 < place.s_m < line.length_m - 1e-9
            covers = place.distance_m <= lane.width_m / 2.0 and (inside or place.distance_m < 0.05)
            turned = 0.0
            if heading_rad is not None:
                turn = abs(difference(line.heading_at(place.s_m), heading_rad))
                turned = round(turn / math.radians(15.0))
            covering += [(turned, place.distance_m, lane.id)] if covers else []
        return min(covering)[2] if covering else None

    def nearest(
        self, x_m: float, y_m: float, *, among: Iterable[str] | None = None
    ) -> tuple[str, Projection] | None:
        """Return the lane whose centreline comes nearest to the point, None without lanes."""
        projections = [
            (lane_id, self.lanes[lane_id].centerline.project(x_m, y_m))
            for lane_id in (self.lanes if among is None else among)
        ]
        return min(projections, key=lambda item: item[1].distance_m, default=None)

    def place(self, lane_id: str, s_m: float, d_m: float = 0.0) -> LanePosition:
        """Return the place s along one lane and d to its left."""
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
        """Return the place further (negative: back) along the lanes, None past the map.

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
        """Return ids of the lanes from this one on, until `length_m` of them are collected."""
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
        lanes, (low, high) = list(self.lanes.values()), self._boxes
        inside = ((low <= (x_m, y_m)) & ((x_m, y_m) <= high)).all(axis=1)
        return [lanes[index] for index in np.flatnonzero(inside)]

    @cached_property
    def _boxes(self) -> NDArray[np.float64]:
        """The lowest and the highest corner of the box around each lane (2, W, 2)."""
        reach = np.array([lane.width_m / 2.0 + 0.1 for lane in self.lanes.values()])[:, None]
        points = [lane.centerline.points_m for lane in self.lanes.values()]
        low = np.array([line.min(axis=0) for line in points]).reshape(-1, 2)
        high = np.array([line.max(axis=0) for line in points]).reshape(-1, 2)
        return np.stack([low - reach, high + reach])

    def _choose(self, lane_id: str, turn: TurnType) -> str | None:
        options = self.successors(lane_id)
        wanted = [
            name
            for name in options
            if isinstance(lane := self.lanes[name], LaneConnector) and lane.turn_type is turn
        ]
        return next(iter(wanted or options), None)

    def _turn_order(self, lane_id: str) -> int:
        lane = self.lanes[lane_id]
        return _TURN_ORDER[lane.turn_type] if isinstance(lane, LaneConnector) else 0


def turn_type_of(line: Polyline) -> TurnType:
    """Return how a line turns from its first point to its last, all bends summed up."""
    headings = np.arctan2(*np.diff(line.points_m, axis=0).T[::-1]).tolist()
    turn = sum(difference(after, before) for before, after in pairwise(headings))
    if abs(turn) < STRAIGHT_BELOW_RAD:
        return TurnType.STRAIGHT
    if abs(turn) > U_TURN_ABOVE_RAD:
        return TurnType.U_TURN
    return TurnType.LEFT if turn > 0.0 else TurnType.RIGHT


def traffic_side_of(lanes: Sequence[Lane]) -> TrafficSide | None:
    """Return the side that most lanes keep to.

    Oncoming traffic to the left means right-hand traffic.

    Returns:
        None where no two lanes of opposite directions lie side by side, or as many speak for
        either side.
    """
    if not lanes:
        return None
    low = np.array([lane.centerline.points_m.min(axis=0) for lane in lanes]) - ONCOMING_WITHIN_M
    high = np.array([lane.centerline.points_m.max(axis=0) for lane in lanes]) + ONCOMING_WITHIN_M
    balance = 0
    for lane in lanes:
        middle = lane.centerline.pose_at(lane.centerline.length_m / 2.0)
        here = np.array([middle.x_m, middle.y_m])
        # Those whose surrounding rectangle comes near; of very many, the first.
        near = np.flatnonzero(((low <= here) & (here <= high)).all(axis=1))[:MOST_BESIDE]
        others = [lanes[index] for index in near if lanes[index] is not lane]
        balance += _oncoming_side(middle, others)
    if balance == 0:
        return None
    return TrafficSide.RIGHT if balance > 0 else TrafficSide.LEFT


def _oncoming_side(middle: Pose, others: Iterable[Lane]) -> int:
    """1 if the nearest oncoming lane is to the left of a lane's middle, -1 right, 0 none."""
    nearest_m, side = ONCOMING_WITHIN_M, 0
    for other in others:
        place = other.centerline.project(middle.x_m, middle.y_m)
        turn = difference(other.centerline.heading_at(place.s_m), middle.heading_rad)
        if place.distance_m <= nearest_m and abs(turn) > ONCOMING_ABOVE_RAD:
            # The other lane runs against this one, so each sees the other on the same side.
            nearest_m, side = place.distance_m, 1 if place.d_m > 0.0 else -1
    return side
