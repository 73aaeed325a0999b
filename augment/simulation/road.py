"""The map as ground to drive on, and the ways that the ego is to take on it.

The route is the recorded one where there is a recording, else the straightest.
"""

from __future__ import annotations

import math
from collections import Counter
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from augment.checks.ground import rings, strips
from augment.errors import CannotDrive
from augment.geometry.frames import difference
from augment.scene.ego_route import find_ego_lane
from augment.scene.entities import AreaKind, Lane, LaneConnector, Scene, TrafficLight, TurnType
from augment.scene.lane_graph import AnyLane, LaneGraph
from augment.scene.recording import Recording
from augment.simulation.path import Path, Region, dense
from augment.simulation.states import BoolArray, FloatArray, IntArray

ROUTE_M = 600.0
"""Collected ahead of the ego, as far as the map goes: 15 s at 20 m/s, and what a planner sees."""
_NEAR_M = 3.0
_ALIGNED_RAD = math.radians(60.0)


def find_route(scene: Scene, graph: LaneGraph, recording: Recording | None) -> tuple[str, ...]:
    """Ids of the ways from the one under the ego on; one way before it where the map has one.

    A scenario's goal comes before what was recorded: the way to the lane nearest to its place,
    or its turn where the lanes first part that way. Where neither can be reached without a lane
    change, the way is as without a goal.

    Raises:
        CannotDrive: There is no way under the ego or within 3 m of it.
    """
    start = _start(scene, graph)
    goal = _ways_to_goal(scene, graph)
    seen = Counter[str]() if recording is None else _driven(graph, recording)
    route = [start]
    length_m = graph.lane(start).centerline.length_m
    while length_m < ROUTE_M:
        options = [name for name in graph.successors(route[-1]) if name not in route]
        if not options:
            break
        # Of equally driven ones the first: successors come straightest first.
        route.append(max(options, key=lambda name: (name in goal, _support(graph, seen, name))))
        length_m += graph.lane(route[-1]).centerline.length_m
    before = [name for name in graph.predecessors(start) if name not in route]
    return (*before[:1], *route)


def beside_route(scene: Scene, graph: LaneGraph, route: tuple[str, ...]) -> frozenset[str]:
    """Ids of the route's ways, their neighbours of the same direction, and what joins these."""
    lanes = {lane.id: lane for lane in scene.lanes}
    names = set(route)
    waiting = [lanes[name] for name in route if name in lanes]
    while waiting:
        for name in _neighbours(waiting.pop()):
            if name in lanes and name not in names:
                names.add(name)
                waiting.append(lanes[name])
    joining = {
        connector.id
        for connector in scene.connectors
        if connector.from_lane in names and connector.to_lane in names
    }
    return frozenset(names | joining)


def _ways_to_goal(scene: Scene, graph: LaneGraph) -> frozenset[str]:
    """Ids of all ways from which the goal's lane or turn can be reached."""
    options = scene.options
    if options.goal_m is not None:
        nearest = graph.nearest(*options.goal_m)
        ends = [] if nearest is None else [nearest[0]]
    elif options.goal is not None:
        ends = _first_turns(scene, graph, options.goal)
    else:
        return frozenset()
    reaching = set(ends)
    while ends:
        ends = [name for end in ends for name in graph.predecessors(end) if name not in reaching]
        reaching.update(ends)
    return frozenset(reaching)


def _first_turns(scene: Scene, graph: LaneGraph, turn: TurnType) -> list[str]:
    """The first connector of that turn on the ways from the ego on, the fewest ways ahead."""
    connectors = {connector.id: connector for connector in scene.connectors}
    ahead, seen = [_start(scene, graph)], set[str]()
    while ahead:
        fitting = [
            name for name in ahead if name in connectors and connectors[name].turn_type is turn
        ]
        if fitting:
            return fitting[:1]
        seen.update(ahead)
        ahead = [name for way in ahead for name in graph.successors(way) if name not in seen]
    return []


def _start(scene: Scene, graph: LaneGraph) -> str:
    ego = scene.ego
    own = find_ego_lane(scene, graph)
    if own is not None:
        beside = graph.lane(own).centerline.project(ego.x_m, ego.y_m)
        # A lane that the ego names but does not stand on leads it nowhere.
        if beside.distance_m <= max(_NEAR_M, graph.lane(own).width_m / 2.0):
            return own
    aligned = [
        name
        for name, way in graph.lanes.items()
        for place in [way.centerline.project(ego.x_m, ego.y_m)]
        if place.distance_m <= _NEAR_M
        and abs(difference(way.centerline.heading_at(place.s_m), ego.heading_rad)) < _ALIGNED_RAD
    ]
    nearest = graph.nearest(ego.x_m, ego.y_m, among=aligned)
    if nearest is None:
        raise CannotDrive(
            f"Scene {scene.name} can't be driven: no lane leads the ego's way within "
            f"{_NEAR_M:g} m of it."
        )
    return nearest[0]


def _driven(graph: LaneGraph, recording: Recording) -> Counter[str]:
    """How many moments of the recorded ego lie on each way, in its direction."""
    counts = Counter[str]()
    states = recording.ego[~np.isnan(recording.ego).any(axis=1)]
    for lane_id, way in graph.lanes.items():
        for x_m, y_m, heading_rad, _ in states:
            place = way.centerline.project(float(x_m), float(y_m))
            turn = difference(way.centerline.heading_at(place.s_m), float(heading_rad))
            if place.distance_m <= way.width_m / 2.0 and abs(turn) < _ALIGNED_RAD:
                counts[lane_id] += 1
    return counts


def _support(graph: LaneGraph, seen: Counter[str], lane_id: str) -> int:
    """How much of the recorded drive lies on a way and, at best, on one that follows it."""
    after = graph.successors(lane_id)
    return seen[lane_id] + max((seen[name] for name in after), default=0)


def _neighbours(lane: Lane) -> list[str]:
    return [name for name in (lane.left_neighbor, lane.right_neighbor) if name is not None]


if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

RUN_OUT_M = 300.0
_DRIVABLE = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
_JOINT_M = 3.0
"""Ends of following ways that are further apart than this are not joined by ground."""


class Road:
    """One scene's map, laid out for driving.

    Attributes:
        graph: The lanes and connectors.
        names: Ids of the ways (W,), in the order of every array over ways.
        route: Ids of the ways that the ego is to take.
        centreline: Their centrelines in one, with the run-out.
        end_m: Where on it the map ends; beyond reach where it goes on.
        red: Ids of the connectors whose light is red; nobody knows when it will change.
        limits_mps: The speed limit of each way (W,), NaN where the map does not say.
    """

    def __init__(self, scene: Scene, recording: Recording | None = None) -> None:
        self.scene = scene
        self.graph = LaneGraph(scene)
        self.names = tuple(self.graph.lanes)
        self.ways: list[AnyLane] = [self.graph.lanes[name] for name in self.names]
        self.index = {name: number for number, name in enumerate(self.names)}
        self.route = find_route(scene, self.graph, recording)
        self.beside = beside_route(scene, self.graph, self.route)
        self.red = frozenset(
            connector.id
            for connector in scene.connectors
            if connector.traffic_light is TrafficLight.RED
        )
        self.limits_mps = self._limits()
        line = np.vstack([self.graph.lanes[name].centerline.points_m for name in self.route])
        ends = not self.graph.successors(self.route[-1])
        map_end_m = Path(dense(line)).length_m
        if ends:
            line = np.vstack([line, _straight_on(line, RUN_OUT_M)])  # repeats are dropped below
        self.centreline = Path(dense(line))
        self.end_m = map_end_m if ends else self.centreline.length_m
        self._route_ends = self._stations()
        self._paths: dict[int, Path] = {}

    @cached_property
    def strips(self) -> NDArray[np.object_]:
        """The polygon of each way (W,)."""
        return strips(self.ways)

    @cached_property
    def drivable(self) -> Region:
        """Lanes, connectors, and areas that cars may use; no tolerance."""
        areas = [area for area in self.scene.areas if area.kind in _DRIVABLE]
        pieces = [self.strips, self._joints(self.names), rings(areas), self._aprons()]
        return Region(_union(np.concatenate(pieces)))

    @cached_property
    def on_route(self) -> Region:
        """The route's ways and their neighbours of the same direction."""
        chosen = [self.index[name] for name in self.names if name in self.beside]
        joints = self._joints(tuple(self.names[number] for number in chosen))
        return Region(_union(np.concatenate([self.strips[chosen], joints, self._aprons()])))

    @cached_property
    def intersections(self) -> Region:
        """The areas of intersections; connectors where the map draws none."""
        areas = [area for area in self.scene.areas if area.kind is AreaKind.INTERSECTION]
        turning = [n for n, way in enumerate(self.ways) if isinstance(way, LaneConnector)]
        return Region(_union(rings(areas) if areas else self.strips[turning]))

    @cached_property
    def red_stations_m(self) -> FloatArray:
        """Where on the centreline the route enters connectors whose light is red (R,)."""
        starts = np.concatenate([[0.0], self._route_ends[:-1]])
        return starts[np.array([name in self.red for name in self.route], dtype=np.bool_)]

    def limit_at(self, s_m: float) -> float:
        """The speed limit of the route's way there, NaN where the map does not say."""
        last = len(self.route) - 1
        number = min(int(np.searchsorted(self._route_ends, s_m, side="right")), last)
        return float(self.limits_mps[self.index[self.route[number]]])

    def covering(self, points_m: FloatArray) -> BoolArray:
        """Which ways (W,) lie under which points (N, 2): (N, W); an edge counts as outside."""
        import shapely

        covers = np.zeros((len(points_m), len(self.names)), dtype=np.bool_)
        points, ways = self._tree.query(shapely.points(points_m), predicate="within")
        covers[points, ways] = True
        return covers

    def on_one_way(self, corners_m: FloatArray) -> BoolArray:
        """Which boxes (N, 4, 2) lie on one way, or on one and what follows it, (N,)."""
        if not len(corners_m):
            return np.zeros(0, dtype=np.bool_)
        inside = self.covering(corners_m.reshape(-1, 2)).reshape(len(corners_m), 4, -1)
        first, second = self._follows
        both = inside[:, :, first] | inside[:, :, second]

        def somewhere(inside_of: BoolArray) -> BoolArray:
            return np.asarray(
                np.logical_and.reduce(inside_of, axis=1).any(axis=-1), dtype=np.bool_
            )

        return np.asarray(somewhere(inside) | somewhere(both), dtype=np.bool_)

    def way_path(self, number: int) -> Path:
        """The centreline of one way, dense."""
        if number not in self._paths:
            self._paths[number] = Path(dense(self.ways[number].centerline.points_m))
        return self._paths[number]

    @cached_property
    def _tree(self):  # type: ignore[no-untyped-def]  # shapely is loaded by who needs it
        import shapely

        return shapely.STRtree(self.strips)

    @cached_property
    def _follows(self) -> tuple[IntArray, IntArray]:
        """The pairs of following ways, as two rows of indices (E,)."""
        pairs = [
            (self.index[before], self.index[after])
            for before in self.names
            for after in self.graph.successors(before)
        ]
        rows = np.array(pairs, dtype=np.int64).reshape(-1, 2)
        return rows[:, 0], rows[:, 1]

    def _limits(self) -> FloatArray:
        """A connector without a limit has the highest of the lanes that it joins."""
        limits = []
        for way in self.ways:
            limit = way.speed_limit_mps
            if limit is None and isinstance(way, LaneConnector):
                joined = [
                    self.graph.lanes.get(name or "") for name in (way.from_lane, way.to_lane)
                ]
                known = [lane.speed_limit_mps for lane in joined if lane is not None]
                limit = max((value for value in known if value is not None), default=None)
            limits.append(np.nan if limit is None else limit)
        return np.array(limits, dtype=np.float64)

    def _stations(self) -> FloatArray:
        """Where on the centreline each way of the route ends (K,)."""
        ends = [self.graph.lanes[name].centerline.points_m[-1] for name in self.route]
        stations, _ = self.centreline.beside(np.array(ends))
        return np.maximum.accumulate(stations)

    def _joints(self, names: tuple[str, ...]) -> NDArray[np.object_]:
        """The wedges between ways that follow each other in a bend."""
        import shapely

        wedges = []
        for before in names:
            for after in self.graph.successors(before):
                if after in names:
                    rim = np.vstack(
                        [_rim(self.graph.lanes[before], -1), _rim(self.graph.lanes[after], 0)]
                    )
                    if np.ptp(rim, axis=0).max() < _JOINT_M + self.graph.lanes[before].width_m:
                        wedges.append(shapely.MultiPoint(rim).convex_hull.buffer(1e-3))
        return np.array(wedges, dtype=object)

    def _aprons(self) -> NDArray[np.object_]:
        """The run-out of the route's last way and of its neighbours."""
        import shapely

        if self.graph.successors(self.route[-1]):
            return np.empty(0, dtype=object)
        last = {self.route[-1], *_of_same_direction(self.graph.lanes[self.route[-1]], self)}
        aprons = []
        for name in sorted(last):
            way = self.graph.lanes[name]
            line = way.centerline.points_m
            onward = np.vstack([line[-1:], _straight_on(line, RUN_OUT_M)])
            half_m = way.width_m / 2.0
            aprons.append(shapely.LineString(onward).buffer(half_m, cap_style="square"))
        return np.array(aprons, dtype=object)


# Private


def _straight_on(line: FloatArray, length_m: float) -> FloatArray:
    """The point (1, 2) so far beyond the end of a line (P, 2)."""
    step = line[-1] - line[-2]
    return np.asarray(line[-1:] + length_m * step / np.hypot(step[0], step[1]), dtype=np.float64)


def _rim(way: AnyLane, end: int) -> FloatArray:
    """The left and the right corner (2, 2) of a way's first (0) or last (-1) edge."""
    if way.left_boundary is not None and way.right_boundary is not None:
        return np.array([way.left_boundary.points_m[end], way.right_boundary.points_m[end]])
    line = way.centerline
    s_m = line.length_m if end else 0.0
    half_m = way.width_m / 2.0
    return np.array([line.position(s_m, half_m), line.position(s_m, -half_m)])


def _of_same_direction(way: AnyLane, road: Road) -> set[str]:
    """Neighbours of a lane that end where it ends and lead nowhere either."""
    names: set[str] = set()
    waiting = [way]
    while waiting:
        lane = waiting.pop()
        for name in (getattr(lane, "left_neighbor", None), getattr(lane, "right_neighbor", None)):
            if name in road.graph.lanes and name not in names and not road.graph.successors(name):
                names.add(name)
                waiting.append(road.graph.lanes[name])
    return names


def _union(pieces: NDArray[np.object_]) -> BaseGeometry:
    import shapely

    union: BaseGeometry = shapely.union_all(pieces[~shapely.is_empty(pieces)])
    return union
