"""What the checks know about a scene before anybody changes it; made once, asked often.

Frame: the scene's. Places relative to the ego go by its pose, wherever that is. W lanes, M
segments of all their centrelines.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.geometry.frames import difference
from augment.geometry.polyline import FloatArray
from augment.scene.ego_route import REACH_M, EgoRoute
from augment.scene.entities import Area, AreaKind, Scene
from augment.scene.lane_graph import AnyLane, LaneGraph

SEAM_M = 0.3
"""A gap between two pieces of ground up to this long is a seam of the map, not an edge."""
NEAR_M = 20.0
"""How far beside a lane a point still has anything to do with it."""
_JOINT_M = 0.5
"""Where two lanes meet in a bend, a wedge beside the joint belongs to neither; it is as long."""
_ROAD = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
_WALKS = (AreaKind.WALKWAY, AreaKind.CROSSWALK)


class Surface:
    """The union of polygons, which are joined only where somebody asks.

    Lanes go by their boundaries where the map has both, else by their width. An area that
    crosses itself is taken as the ground that it encloses.
    """

    def __init__(self, lanes: Iterable[AnyLane] = (), areas: Iterable[Area] = ()) -> None:
        pieces = np.concatenate([strips(list(lanes)), rings(list(areas))])
        self._pieces = pieces[~shapely.is_empty(pieces)]
        self._tree = shapely.STRtree(self._pieces)
        self.is_empty = len(self._pieces) == 0

    def share_outside(self, corners_m: FloatArray) -> float:
        """Return the part, 0 to 1, of a box with the corners (4, 2) that lies off the surface."""
        box = shapely.Polygon(corners_m)
        near = self._pieces[self._tree.query(box, predicate="intersects")]
        if any(piece.covers(box) for piece in near):
            return 0.0
        left = float(shapely.difference(box, shapely.union_all(near)).area) / float(box.area)
        return min(1.0, max(0.0, left))

    def distance_m(self, x_m: float, y_m: float) -> float:
        """Return the way from a point to the surface, 0 on it; infinite where there is none."""
        if self.is_empty:
            return math.inf
        point = shapely.Point(x_m, y_m)
        _, distances = self._tree.query_nearest(point, return_distance=True, all_matches=False)
        return float(distances[0])

    def reach_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """Return how far the surface goes on from a point in a direction, up to `most_m`.

        Neighbouring pieces seldom meet exactly: gaps up to `SEAM_M` are passed over. None where
        the point is not on the surface, or the surface ends nowhere within `most_m`.
        """
        reached_m = 0.0
        is_on = False
        for low_m, high_m in self._spans_m(x_m, y_m, heading_rad, most_m):
            if low_m > reached_m + SEAM_M:
                break
            is_on = is_on or high_m >= 0.0
            reached_m = max(reached_m, high_m)
        return reached_m if is_on and reached_m < most_m - SEAM_M else None

    def begins_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """Return how far off a point the surface begins in a direction, 0 on it.

        None where it begins nowhere within `most_m`.
        """
        spans = self._spans_m(x_m, y_m, heading_rad, most_m)
        return next((max(0.0, low_m) for low_m, high_m in spans if high_m > 0.0), None)

    def _spans_m(
        self, x_m: float, y_m: float, heading_rad: float, most_m: float
    ) -> list[tuple[float, float]]:
        """From where to where each piece lies under a ray; it begins a seam behind its point."""
        step = np.array([math.cos(heading_rad), math.sin(heading_rad)])
        start = np.array([x_m, y_m])
        ray = shapely.LineString([start - SEAM_M * step, start + most_m * step])
        near = self._pieces[self._tree.query(ray, predicate="intersects")]
        parts = shapely.get_parts(shapely.intersection(near, ray))
        parts = parts[shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING]
        spans = (((shapely.get_coordinates(part) - start) @ step).tolist() for part in parts)
        return sorted((min(span), max(span)) for span in spans)

    def distance_to_hull_m(self, x_m: float, y_m: float) -> float:
        """Return the way from a point to the convex region around the surface, 0 inside."""
        hull = shapely.MultiPoint(shapely.get_coordinates(self._pieces)).convex_hull
        return math.inf if self.is_empty else float(hull.distance(shapely.Point(x_m, y_m)))


def gaps_m(boxes_m: FloatArray) -> FloatArray:
    """Return the gap (N, N) between every two boxes with corners (N, 4, 2); 0 where they meet."""
    boxes = np.asarray(shapely.polygons(boxes_m), dtype=object)
    return np.asarray(shapely.distance(boxes[:, None], boxes[None, :]), dtype=np.float64)


def strips(lanes: Sequence[AnyLane]) -> NDArray[np.object_]:
    """Return one polygon a lane."""
    made = np.full(len(lanes), None, dtype=object)
    for index, lane in enumerate(lanes):
        left, right = lane.left_boundary, lane.right_boundary
        if left is not None and right is not None:
            made[index] = shapely.Polygon(np.concatenate([left.points_m, right.points_m[::-1]]))
    # Those without an outline, and those whose outline crosses itself.
    for index in np.flatnonzero(~shapely.is_valid(made)).tolist():
        line = shapely.LineString(lanes[index].centerline.points_m)
        half_m = lanes[index].width_m / 2.0
        made[index] = line.buffer(half_m, cap_style="flat", quad_segs=4)
    return made


def rings(areas: Sequence[Area]) -> NDArray[np.object_]:
    """Return one geometry an area."""
    made = np.empty(len(areas), dtype=object)
    made[:] = [shapely.Polygon(area.boundary_m) for area in areas]
    crossing = ~shapely.is_valid(made)
    # A buffer of nothing keeps the polygons and drops the lines that mending may leave.
    made[crossing] = shapely.buffer(shapely.make_valid(made[crossing]), 0.0)
    return made


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """How a point lies beside one lane.

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
        """Whether the lane lies under the point."""
        return abs(self.d_m) <= self.width_m / 2.0 and self.beyond_m <= _JOINT_M

    @property
    def off_m(self) -> float:
        """From the edge of the lane to the point, 0 where the lane covers it."""
        return 0.0 if self.covers else max(0.0, self.distance_m - self.width_m / 2.0)


class LaneIndex:
    """The lanes of one scene, laid out for a search by place."""

    def __init__(self, lanes: Iterable[AnyLane]) -> None:
        self._lanes = tuple(lanes)
        lines = [lane.centerline for lane in self._lanes]
        self._bounds = np.cumsum([0, *(len(line.points_m) - 1 for line in lines)])
        self._halves_m = np.array([lane.width_m / 2.0 for lane in self._lanes])
        if lines:
            self._starts = np.concatenate([line.points_m[:-1] for line in lines])
            steps = np.concatenate([np.diff(line.points_m, axis=0) for line in lines])
            self._lengths = np.hypot(steps[:, 0], steps[:, 1])
            self._directions = steps / self._lengths[:, None]
            self._stations = np.concatenate([line.stations_m[:-1] for line in lines])

    def beside(self, x_m: float, y_m: float) -> tuple[Beside, ...]:
        """Return the point beside the lanes near it, in the order of the lanes.

        Those are all whose edge is within `NEAR_M` of the point, else the nearest one.
        """
        if not self._lanes:
            return ()
        offset = np.array([x_m, y_m]) - self._starts
        along = (offset * self._directions).sum(axis=1)
        past = along - np.clip(along, 0.0, self._lengths)
        left = self._directions[:, 0] * offset[:, 1] - self._directions[:, 1] * offset[:, 0]
        distances = np.hypot(left, past)
        edges_m = np.minimum.reduceat(distances, self._bounds[:-1]) - self._halves_m
        places = []
        for number in np.flatnonzero(edges_m <= max(NEAR_M, float(edges_m.min()))).tolist():
            start, end = self._bounds[number : number + 2].tolist()
            index = start + int(distances[start:end].argmin())
            past_m, left_m = float(past[index]), float(left[index])
            is_past_end = (past_m < 0.0 and index == start) or (past_m > 0.0 and index == end - 1)
            distance_m = float(distances[index])
            dx, dy = self._directions[index].tolist()
            place = Beside(
                lane_id=self._lanes[number].id,
                s_m=float(self._stations[index] + along[index]) - past_m,
                # On the outside of a bend the nearest place is a corner, which is past no end.
                d_m=left_m if is_past_end else math.copysign(distance_m, left_m),
                beyond_m=abs(past_m) if is_past_end else 0.0,
                distance_m=distance_m,
                tangent_rad=math.atan2(dy, dx),
                width_m=self._lanes[number].width_m,
            )
            places.append(place)
        return tuple(places)


def best_aligned(beside: Iterable[Beside], heading_rad: float) -> Beside | None:
    """Return of the lanes under a point the one that fits the heading, else the nearest."""

    def misfit(place: Beside) -> tuple[int, float]:
        turn_deg = math.degrees(abs(difference(place.tangent_rad, heading_rad)))
        return round(turn_deg / 15.0), round(place.distance_m, 4)

    return min((place for place in beside if place.covers), key=misfit, default=None)


@dataclass(frozen=True, kw_only=True, eq=False)
class Ground:
    """The lanes and surfaces of one scene, and the ego on them.

    Attributes:
        scene: The scene before the change.
        graph: What follows what.
        lanes: Where every lane and connector lies.
    """

    scene: Scene
    graph: LaneGraph
    lanes: LaneIndex

    @classmethod
    def of(cls, scene: Scene) -> Ground:
        """Return the ground of a scene; surfaces are laid out when they are first asked for."""
        graph = LaneGraph(scene)
        return cls(scene=scene, graph=graph, lanes=LaneIndex(graph.lanes.values()))

    def _areas(self, *kinds: AreaKind) -> list[Area]:
        return [area for area in self.scene.areas if area.kind in kinds]

    @cached_property
    def road(self) -> Surface:
        """What vehicles may stand on."""
        return Surface(self.graph.lanes.values(), self._areas(*_ROAD))

    @cached_property
    def everything(self) -> Surface:
        """Everything that the map shows: the road, walkways and crosswalks."""
        return Surface(self.graph.lanes.values(), self._areas(*_ROAD, *_WALKS))

    @cached_property
    def carparks(self) -> Surface:
        """Where vehicles stand in any direction."""
        return Surface(areas=self._areas(AreaKind.CARPARK))

    @cached_property
    def walkways(self) -> Surface:
        """Where people walk beside the road; empty where the map does not say."""
        return Surface(areas=self._areas(AreaKind.WALKWAY))

    @cached_property
    def route(self) -> EgoRoute | None:
        """The ego's path over lanes, None where the map has no lane for it."""
        return EgoRoute.of(self.scene, self.graph)

    @cached_property
    def starts_m(self) -> tuple[tuple[str, float], ...]:
        """How far ahead of the ego lanes begin, measured along the lanes: id and metres.

        Successors of the ego's lane are followed forwards, predecessors backwards, both up to
        `REACH_M`. On a loop a lane comes twice: once ahead, once behind.
        """
        if self.route is None:
            return ()
        ahead, behind = (self._reached(self.route, forwards=way) for way in (True, False))
        return (*ahead.items(), *behind.items())

    def _reached(self, route: EgoRoute, *, forwards: bool) -> dict[str, float]:
        """Dijkstra over whole lanes: the signed distance from the ego to each lane's start."""
        lengths = {name: lane.centerline.length_m for name, lane in self.graph.lanes.items()}
        starts_m: dict[str, float] = {}
        queue = [(route.lane_s_m, route.lane_id, -route.lane_s_m)]
        while queue:
            _, here, begins_m = heapq.heappop(queue)
            if here in starts_m:
                continue
            starts_m[here] = begins_m
            following = self.graph.successors(here) if forwards else self.graph.predecessors(here)
            for name in following:
                next_m = begins_m + lengths[here] if forwards else begins_m - lengths[name]
                if name not in starts_m and -REACH_M - lengths[name] < next_m < REACH_M:
                    heapq.heappush(queue, (abs(next_m), name, next_m))
        return starts_m
