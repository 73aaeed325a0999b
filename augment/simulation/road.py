"""The map as ground to drive on, and the ways that the ego is to take on it.

The route is the recorded one where there is a recording, else the straightest. W ways.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.checks.ground import rings, strips
from augment.errors import CannotDrive
from augment.geometry.frames import difference
from augment.scene.ego_route import find_ego_lane
from augment.scene.entities import DRIVEN_ON, AnyLane, AreaKind, LaneConnector, Scene, TrafficLight
from augment.scene.lane_graph import Beside, LaneGraph
from augment.scene.recording import Recording
from augment.simulation.path import SPACING_M, Path, Region, dense
from augment.simulation.states import BoolArray, FloatArray, IntArray

ROUTE_M = 600.0
"""Collected ahead of the ego, as far as the map goes: 15 s at 20 m/s, and what a planner sees."""
# Straight on past the end of the map: a planner's horizon must not end in nothing.
RUN_OUT_M = 300.0
# From a way's centreline to an ego that stands on none, at most; and their directions.
_NEAR_M = 3.0
_ALIGNED_RAD = math.radians(60.0)
_JOINT_M = 3.0
"""Ends of following ways that are further apart than this are not joined by ground."""


def find_route(scene: Scene, graph: LaneGraph, recording: Recording | None) -> tuple[str, ...]:
    """Return the ways from the one under the ego on; one way before it where the map has one.

    A scenario's goal comes before what was recorded: the way to the lane nearest to its place,
    or its turn where the lanes first part that way. Where neither can be reached without a lane
    change, the way is as without a goal.

    Raises:
        CannotDrive: There is no way under the ego or within 3 m of it.
    """
    start = _start(scene, graph)
    goal = _ways_to_goal(scene, graph, start)
    seen = Counter[str]() if recording is None else _driven(graph, recording)

    def preference(name: str) -> tuple[bool, int]:
        """The goal first, then how much was driven on a way and, at best, on one after it."""
        # A way on which no moment of the recording fell still counts by what follows it.
        after = max((seen[following] for following in graph.successors(name)), default=0)
        return name in goal, seen[name] + after

    route = [start]
    length_m = graph.lane(start).centerline.length_m
    while length_m < ROUTE_M:
        options = [name for name in graph.successors(route[-1]) if name not in route]
        if not options:
            break
        # Of equally driven ones the first: successors come straightest first.
        route.append(max(options, key=preference))
        length_m += graph.lane(route[-1]).centerline.length_m
    before = [name for name in graph.predecessors(start) if name not in route]
    return (*before[:1], *route)


def _spread(names: Sequence[str], following: Callable[[str], Sequence[str]]) -> Iterator[str]:
    """Yield ways and what follows them, the fewest ways ahead first, each once."""
    waiting, seen = list(names), set(names)
    for name in waiting:  # grows on the way
        yield name
        fresh = [after for after in following(name) if after not in seen]
        seen.update(fresh)
        waiting += fresh


def _ways_to_goal(scene: Scene, graph: LaneGraph, start: str) -> set[str]:
    """All ways from which the goal's lane or turn can be reached."""
    options, ends = scene.options, list[str]()
    if options.goal_m is not None:
        nearest = graph.nearest(*options.goal_m)
        ends = [] if nearest is None else [nearest[0]]
    elif options.goal is not None:
        turns = {way.id for way in scene.connectors if way.turn_type is options.goal}
        ends = [name for name in _spread([start], graph.successors) if name in turns][:1]
    return set(_spread(ends, graph.predecessors))


def _start(scene: Scene, graph: LaneGraph) -> str:
    ego, own, aligned = scene.ego, find_ego_lane(scene, graph), list[tuple[float, str]]()
    for place in graph.beside(ego.x_m, ego.y_m):
        # A lane that the ego names but does not stand on leads it nowhere.
        if place.lane_id == own and place.distance_m <= max(_NEAR_M, place.width_m / 2.0):
            return own
        if place.distance_m <= _NEAR_M and _is_aligned(place, ego.heading_rad):
            aligned.append((place.distance_m, place.lane_id))
    if not aligned:
        raise CannotDrive(
            f"Scene {scene.name} can't be driven: no lane leads the ego's way within "
            f"{_NEAR_M:g} m of it."
        )
    return min(aligned)[1]


def _is_aligned(place: Beside, heading_rad: float) -> bool:
    return abs(difference(place.tangent_rad, heading_rad)) < _ALIGNED_RAD


def _driven(graph: LaneGraph, recording: Recording) -> Counter[str]:
    """Return the number of moments of the recorded ego on each way, in its direction."""
    return Counter(
        place.lane_id
        for x_m, y_m, heading_rad, _ in recording.ego[recording.ego_is_seen].tolist()
        for place in graph.beside(x_m, y_m)
        if place.distance_m <= place.width_m / 2.0 and _is_aligned(place, heading_rad)
    )


class Road:
    """One scene's map, laid out for driving.

    Attributes:
        graph: The lanes and connectors.
        names: Ids of the ways (W,), in the order of every array over ways.
        route: Ids of the ways that the ego is to take.
        beside: These, their neighbours of the same direction, and what joins them.
        centreline: Their centrelines in one, with the run-out.
        end_m: Where on it the map ends; beyond reach where it goes on.
        route_ends_m: Where on it each way of the route ends.
        red: Ids of the connectors whose light is red; nobody knows when it will change.
        limits_mps: The speed limit of each way (W,), NaN where the map does not say.
    """

    def __init__(self, scene: Scene, recording: Recording | None = None) -> None:
        self.scene = scene
        self.graph = LaneGraph(scene)
        self.names = tuple(self.graph.lanes)
        self.ways: list[AnyLane] = list(self.graph.lanes.values())
        self.index = {name: number for number, name in enumerate(self.names)}
        self.route = find_route(scene, self.graph, recording)
        abreast = {beside for name in self.route for beside in self.graph.abreast(name)}
        self.beside = abreast | {
            way.id for way in scene.connectors if {way.from_lane, way.to_lane} <= abreast
        }
        self.red = frozenset(
            connector.id
            for connector in scene.connectors
            if connector.traffic_light is TrafficLight.RED
        )
        self.limits_mps = np.array([self._limit(way) for way in self.ways], dtype=np.float64)
        self._ends = not self.graph.successors(self.route[-1])
        on_map = self.path_over(self.route)
        self.end_m, self.centreline = on_map.length_m, on_map
        if self._ends:
            last = self.graph.lanes[self.route[-1]].centerline.points_m
            self.centreline = self.path_over(self.route, run_out=_straight_on(last))
        ends = [self.graph.lanes[name].centerline.points_m[-1] for name in self.route]
        stations, _ = self.centreline.beside(np.array(ends))
        # Increasing, as searches need it, wherever an end falls on a winding line.
        self.route_ends_m = np.maximum.accumulate(stations)
        self._paths: dict[int, Path] = {}

    @cached_property
    def strips(self) -> NDArray[np.object_]:
        """The polygon of each way (W,)."""
        return strips(self.ways)

    @cached_property
    def drivable(self) -> Region:
        """Lanes, connectors, and areas that cars may use; no tolerance."""
        areas = [area for area in self.scene.areas if area.kind in DRIVEN_ON]
        return _region(self.strips, self._joints(self.names), rings(areas), self._aprons())

    @cached_property
    def on_route(self) -> Region:
        """The route's ways and their neighbours of the same direction."""
        names = tuple(name for name in self.names if name in self.beside)
        chosen = self.strips[[self.index[name] for name in names]]
        return _region(chosen, self._joints(names), self._aprons())

    @cached_property
    def intersections(self) -> Region:
        """The areas of intersections; connectors where the map draws none."""
        areas = [area for area in self.scene.areas if area.kind is AreaKind.INTERSECTION]
        turning = [n for n, way in enumerate(self.ways) if isinstance(way, LaneConnector)]
        return _region(rings(areas) if areas else self.strips[turning])

    @cached_property
    def red_stations_m(self) -> FloatArray:
        """Stations on the centreline where the route enters connectors with a red light (R,)."""
        # A way begins where the one before it ends.
        starts = np.concatenate([[0.0], self.route_ends_m[:-1]])
        return starts[np.array([name in self.red for name in self.route], dtype=np.bool_)]

    def limit_at(self, s_m: float) -> float:
        """Return the speed limit of the route's way there, NaN where the map does not say."""
        last = len(self.route) - 1
        number = min(int(np.searchsorted(self.route_ends_m, s_m, side="right")), last)
        return float(self.limits_mps[self.index[self.route[number]]])

    def covering(self, points_m: FloatArray) -> BoolArray:
        """Return which ways (W,) lie under points (N, 2), (N, W); an edge counts as outside."""
        covers = np.zeros((len(points_m), len(self.names)), dtype=np.bool_)
        # Two rows of indices, of pairs (point, way) alone: "within" leaves out the edge.
        points, ways = self._tree.query(shapely.points(points_m), predicate="within")
        covers[points, ways] = True
        return covers

    def on_one_way(self, corners_m: FloatArray) -> BoolArray:
        """Return which boxes (N, 4, 2) lie on one way, or on one and what follows it, (N,)."""
        # (N, 4, W); all four corners on one way, or each on one or the other of a pair (N, 4, E).
        inside = self.covering(corners_m.reshape(-1, 2)).reshape(-1, 4, len(self.names))
        first, second = self._follows
        both = inside[:, :, first] | inside[:, :, second]
        on_one = inside.all(axis=1).any(axis=-1) | both.all(axis=1).any(axis=-1)
        return np.asarray(on_one, dtype=np.bool_)

    def path_over(
        self,
        names: Sequence[str],
        *,
        spacing_m: float = SPACING_M,
        run_out: FloatArray | None = None,
    ) -> Path:
        """Return the centrelines of some ways in one, with a run-out (N, 2) at the end."""
        lines = [self.graph.lanes[name].centerline.points_m for name in names]
        lines += [] if run_out is None else [run_out]
        return Path(dense(np.vstack(lines), spacing_m))

    def way_path(self, number: int) -> Path:
        """Return the centreline of one way, dense."""
        if number not in self._paths:
            self._paths[number] = self.path_over([self.names[number]])
        return self._paths[number]

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.strips)

    @cached_property
    def _follows(self) -> IntArray:
        """The pairs of following ways, as two rows of indices (2, E)."""
        pairs = [
            (self.index[before], self.index[after])
            for before in self.names
            for after in self.graph.successors(before)
        ]
        return np.array(pairs, dtype=np.int64).reshape(-1, 2).T

    def _limit(self, way: AnyLane) -> float:
        """A connector without a limit has the highest of the lanes that it joins."""
        limits = [way.speed_limit_mps]
        if way.speed_limit_mps is None and isinstance(way, LaneConnector):
            joined = [self.graph.lanes.get(name or "") for name in (way.from_lane, way.to_lane)]
            limits = [lane.speed_limit_mps for lane in joined if lane is not None]
        return max((limit for limit in limits if limit is not None), default=math.nan)

    def _joints(self, names: tuple[str, ...]) -> NDArray[np.object_]:
        """The wedges between ways that follow each other in a bend."""
        wedges = []
        for before in names:
            for after in self.graph.successors(before):
                way, following = self.graph.lanes[before], self.graph.lanes[after]
                # (4, 2): the last edge of one and the first of the other.
                rim = np.vstack([_rim(way, -1), _rim(following, 0)])
                if after in names and np.ptp(rim, axis=0).max() < _JOINT_M + way.width_m:
                    # A millimetre more: edges that only touch would leave a slit in the union.
                    wedges.append(shapely.MultiPoint(rim).convex_hull.buffer(1e-3))
        return np.array(wedges, dtype=object)

    def _aprons(self) -> NDArray[np.object_]:
        """The run-out of the route's last way and of its neighbours."""
        aprons = []
        for name in sorted(self.graph.abreast(self.route[-1])) if self._ends else ():
            way = self.graph.lanes[name]
            line = way.centerline.points_m
            if not self.graph.successors(name):
                onward = shapely.LineString(np.vstack([line[-1:], _straight_on(line)]))
                aprons.append(onward.buffer(way.width_m / 2.0, cap_style="square"))
        return np.array(aprons, dtype=object)


# Private


def _straight_on(line: FloatArray) -> FloatArray:
    """The end (1, 2) of a run-out straight on from the end of a line (P, 2)."""
    step = line[-1] - line[-2]
    return np.asarray(line[-1:] + RUN_OUT_M * step / np.hypot(step[0], step[1]), dtype=np.float64)


def _rim(way: AnyLane, end: int) -> FloatArray:
    """The left and the right corner (2, 2) of a way's first (0) or last (-1) edge."""
    if way.left_boundary is not None and way.right_boundary is not None:
        return np.array([way.left_boundary.points_m[end], way.right_boundary.points_m[end]])
    line = way.centerline
    s_m = line.length_m if end else 0.0
    half_m = way.width_m / 2.0
    return np.array([line.position(s_m, half_m), line.position(s_m, -half_m)])


def _region(*pieces: NDArray[np.object_]) -> Region:
    whole = np.concatenate(pieces)
    return Region(shapely.union_all(whole[~shapely.is_empty(whole)]))
