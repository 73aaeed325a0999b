"""Lanes and connectors as one graph: what lies beside a point, what comes next, what turns where.

Frame: ego frame of the scene; any one frame for turns and sides.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
import shapely

from augment.errors import UnknownName
from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline, Projection
from augment.scene.entities import AnyLane, Lane, LaneConnector, Scene, TrafficSide, TurnType

STRAIGHT_BELOW_RAD = math.radians(30.0)
U_TURN_ABOVE_RAD = math.radians(150.0)
ONCOMING_ABOVE_RAD = math.radians(150.0)
ONCOMING_WITHIN_M = 8.0
"""Between centrelines: two lanes side by side, or with a narrow median between."""
MOST_BESIDE = 200
"""Lanes that are looked at beside one; no road has as many."""
NEAR_M = 20.0
"""How far beside a lane a point still has anything to do with it."""
_JOINT_M = 0.5
"""Where two lanes meet in a bend, a wedge beside the joint belongs to neither; it is as long."""
_TURN_ORDER = {TurnType.STRAIGHT: 0, TurnType.LEFT: 1, TurnType.RIGHT: 1, TurnType.U_TURN: 2}


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePosition:
    """A position on a lane or connector: `s_m` along its centreline, `d_m` to the left of it."""

    lane_id: str
    s_m: float
    d_m: float
    pose: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """Position of a point relative to one lane.

    Attributes:
        s_m: Along the centreline, within its ends.
        d_m: To the left of the centreline (right is negative).
        beyond_m: How far past one of the ends the point lies, 0 beside the lane.
        distance_m: To the centreline.
        tangent_rad: The direction of travel there.
    """

    lane_id: str
    s_m: float
    d_m: float
    beyond_m: float
    distance_m: float
    tangent_rad: float
    width_m: float

    @property
    def covers(self) -> bool:
        """True if the lane lies under the point."""
        return abs(self.d_m) <= self.width_m / 2.0 and self.beyond_m <= _JOINT_M

    @property
    def off_m(self) -> float:
        """From the edge of the lane to the point, 0 where the lane covers it."""
        return 0.0 if self.covers else max(0.0, self.distance_m - self.width_m / 2.0)


def best_aligned(beside: Iterable[Beside], heading_rad: float | None) -> Beside | None:
    """Return the lane that fits a heading best, in steps of 15 degrees; of equals the nearest."""

    def misfit(place: Beside) -> tuple[int, float, str]:
        turn_rad = 0.0
        if heading_rad is not None:
            turn_rad = abs(difference(place.tangent_rad, heading_rad))
        # Headings in steps, or a degree would outweigh metres; names last, so that no order of the
        # map decides.
        return round(turn_rad / math.radians(15.0)), round(place.distance_m, 4), place.lane_id

    return min(beside, key=misfit, default=None)


class LaneGraph:
    """The lanes of one scene, by id, with their successors and predecessors, and by place."""

    def __init__(self, scene: Scene) -> None:
        self.lanes: dict[str, AnyLane] = {lane.id: lane for lane in scene.ways}
        self._next: dict[str, list[str]] = {lane_id: [] for lane_id in self.lanes}
        self._previous: dict[str, list[str]] = {lane_id: [] for lane_id in self.lanes}
        self._ahead: dict[str, tuple[str, ...]] = {}
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
        if lane_id not in self._ahead:
            self._ahead[lane_id] = self._straightest(lane_id, self._next[lane_id], at_share=1.0)
        return self._ahead[lane_id]

    def predecessors(self, lane_id: str) -> tuple[str, ...]:
        """Return ids of what leads here, straightest first by the turn from start to start.

        Lanes that merge end alike: what tells them apart is how they got there.
        """
        return self._straightest(lane_id, self._previous[lane_id], at_share=0.0)

    def _straightest(self, lane_id: str, names: list[str], *, at_share: float) -> tuple[str, ...]:
        def heading_rad(name: str) -> float:
            line = self.lanes[name].centerline
            return line.heading_at(at_share * line.length_m)

        def bend(name: str) -> tuple[int, float]:
            lane = self.lanes[name]
            # By the kind of turn that the map says, then by the angle.
            order = _TURN_ORDER[lane.turn_type] if isinstance(lane, LaneConnector) else 0
            return order, abs(difference(heading_rad(name), heading_rad(lane_id)))

        return tuple(sorted(names, key=bend))

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

    def beside(self, x_m: float, y_m: float) -> tuple[Beside, ...]:
        """Return how a point lies beside the lanes near it, else beside the nearest one.

        They are in the order of the lanes.
        """
        point, lanes = shapely.Point(x_m, y_m), list(self.lanes.values())
        reach_m = NEAR_M + max((lane.width_m for lane in lanes), default=0.0) / 2.0
        # A tree first: projecting onto every lane of a large map is what would take the time.
        near = self._lines.query(point, "dwithin", reach_m)
        if not len(near):
            near = self._lines.query_nearest(point, all_matches=False)
        places = []
        for lane in (lanes[number] for number in sorted(near.tolist())):
            place = lane.centerline.project(x_m, y_m)
            beyond_m = place.beyond_m
            # Past an end the way to it has a part along the lane, beyond_m, and one across it.
            d_m = math.copysign(math.sqrt(place.distance_m**2 - beyond_m**2), place.d_m)
            beside = Beside(
                lane_id=lane.id,
                s_m=place.s_m,
                d_m=d_m if beyond_m else place.d_m,
                beyond_m=beyond_m,
                distance_m=place.distance_m,
                tangent_rad=place.heading_rad,
                width_m=lane.width_m,
            )
            places.append(beside)
        return tuple(places)

    @cached_property
    def _lines(self) -> shapely.STRtree:
        lines = [lane.centerline.points_m for lane in self.lanes.values()]
        return shapely.STRtree([shapely.LineString(points) for points in lines])

    def under(self, x_m: float, y_m: float, heading_rad: float | None = None) -> str | None:
        """Return the lane whose width covers a point and none of whose ends the point is beyond.

        Of several it is the best aligned one, else the nearest.
        """
        covering = [
            place
            for place in self.beside(x_m, y_m)
            if place.distance_m <= place.width_m / 2.0
            # Past an end only within 5 cm of the centreline's last point.
            and (place.beyond_m == 0.0 or place.distance_m < 0.05)
        ]
        best = best_aligned(covering, heading_rad)
        return None if best is None else best.lane_id

    def nearest(self, x_m: float, y_m: float) -> tuple[str, Projection] | None:
        """Return the lane whose centreline comes nearest to the point, None without lanes."""
        projections = [
            (lane_id, lane.centerline.project(x_m, y_m)) for lane_id, lane in self.lanes.items()
        ]
        return min(projections, key=lambda item: item[1].distance_m, default=None)

    def place(self, lane_id: str, s_m: float, d_m: float = 0.0) -> LanePosition:
        """Return the place s along one lane and d to its left."""
        pose = self.lane(lane_id).centerline.pose_at(s_m, d_m)
        return LanePosition(lane_id=lane_id, s_m=s_m, d_m=d_m, pose=pose)

    def along(
        self, lane_id: str, start_m: float, distance_m: float, d_m: float = 0.0
    ) -> LanePosition | None:
        """Return the place further (negative: back) along the lanes, None past the map.

        Where the lanes part, the straightest is taken.
        """
        here, s_m = lane_id, start_m + distance_m
        # Lanes that lead in a ring end where they began.
        seen = {here}
        while s_m > self.lanes[here].centerline.length_m:
            following = self._choose(here, TurnType.STRAIGHT)
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
        seen = {lane_id}
        while total < length_m:
            following = self._choose(route[-1], turn)
            if following is None or following in seen:
                break
            route.append(following)
            seen.add(following)
            total += self.lanes[following].centerline.length_m
        return route

    def find_way(
        self, starts: Sequence[str], ends: Sequence[str], reach_m: float
    ) -> list[str] | None:
        """Return ids of the fewest lanes from any of some to any of others, None if none lead.

        No more than `reach_m` of lanes lie between them.
        """
        ways = {name: ([name], 0.0) for name in starts}
        waiting = list(starts)
        # Breadth first: the first way that arrives has the fewest lanes.
        for here in waiting:  # which grows meanwhile
            way, length_m = ways[here]
            if here in ends:
                return way
            length_m += self.lanes[here].centerline.length_m * (here not in starts)
            for following in self.successors(here) if length_m <= reach_m else ():
                if following not in ways:
                    ways[following] = ([*way, following], length_m)
                    waiting.append(following)
        return None

    def _choose(self, lane_id: str, turn: TurnType) -> str | None:
        options = self.successors(lane_id)
        wanted = [
            name
            for name in options
            if isinstance(lane := self.lanes[name], LaneConnector) and lane.turn_type is turn
        ]
        # Successors come straightest first.
        return next(iter(wanted or options), None)


def classify_turn(line: Polyline) -> TurnType:
    """Return how a line turns from its first point to its last, all bends summed up."""
    # (P - 1,); summed up, as a loop of 270 degrees ends like a turn of 90 the other way.
    headings = np.arctan2(*np.diff(line.points_m, axis=0).T[::-1]).tolist()
    turn = sum(difference(after, before) for before, after in pairwise(headings))
    if abs(turn) < STRAIGHT_BELOW_RAD:
        return TurnType.STRAIGHT
    if abs(turn) > U_TURN_ABOVE_RAD:
        return TurnType.U_TURN
    return TurnType.LEFT if turn > 0.0 else TurnType.RIGHT


def find_traffic_side(lanes: Sequence[Lane]) -> TrafficSide | None:
    """Return the side that most lanes keep to.

    Oncoming traffic to the left means right-hand traffic.

    Returns:
        None where no two lanes of opposite directions lie side by side, or as many speak for
        either side.
    """
    lines = [lane.centerline for lane in lanes]
    tree, balance = shapely.STRtree([shapely.LineString(line.points_m) for line in lines]), 0
    for line in lines:
        middle = line.pose_at(line.length_m / 2.0)
        here = shapely.Point(middle.x_m, middle.y_m)
        oncoming = []
        for number in tree.query(here, "dwithin", ONCOMING_WITHIN_M)[:MOST_BESIDE].tolist():
            place = lines[number].project(middle.x_m, middle.y_m)
            turn = difference(place.heading_rad, middle.heading_rad)
            oncoming += [(place.distance_m, place.d_m)] if abs(turn) > ONCOMING_ABOVE_RAD else []
        if oncoming:
            # The other lane runs against this one, so each sees the other on the same side.
            balance += 1 if min(oncoming)[1] > 0.0 else -1
    if balance == 0:
        return None
    return TrafficSide.RIGHT if balance > 0 else TrafficSide.LEFT
