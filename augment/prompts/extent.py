"""Region of a scene that prompts contain: everything that can concern the ego's drive.

The rule, for whoever asks: within the radius of the ego, behind it within half of that, and
within `BESIDE_M` of where the ego can get on its lanes and those beside them by driving
`DRIVEN_M` (or the radius where that is more), turning off wherever it can, or comes from within
`BEHIND_M`. A connector that it enters on the way is followed to its end, and what comes after it
for `PAST_M`. A lane is shown from where it first comes into that region to where it last leaves
it, unless that is less than `LEAST_M` of a longer one. Connectors are shown that come within
`CROSSED_M` of where the ego can drive, and of those that run from the same lane to the same lane
in the same place the first. Where the map has no lane for the ego only the radius counts.

Frame: ego frame. N points.
"""

import heapq
import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Area, Lane, LaneConnector, Scene

BoolArray = NDArray[np.bool_]

BESIDE_M = 15.0
BEHIND_M = 20.0
DRIVEN_M = 80.0
PAST_M = 25.0
"""So far the ways out of an intersection are followed that the ego enters near the end."""
CROSSED_M = 5.0
"""What leads through an intersection further from all ways of the ego does not meet it there."""
LEAST_M = 5.0
SAME_WITHIN_M = 0.5
"""Connectors between the same lanes that part nowhere further than this are one to a reader."""

_LOOK_EVERY_M = 0.5
_ROUTE_EVERY_M = 2.5


@dataclass(frozen=True, eq=False, kw_only=True)
class Extent:
    """The region that a prompt shows.

    Attributes:
        routes_m: Points (R, 2) along where the ego can get; None where its lane is unknown.
    """

    radius_m: float
    routes_m: FloatArray | None

    def holds(self, points_m: FloatArray) -> BoolArray:
        """Return for points (N, 2) whether they lie in the region, (N,)."""
        points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
        inside: BoolArray = np.hypot(*points.T) <= self.radius_m
        if self.routes_m is not None:
            inside &= points[:, 0] >= -behind_m(self.radius_m)
        if self.routes_m is not None and inside.any():
            gaps = points[inside][:, None, :] - self.routes_m[None, :, :]
            nearest = np.sqrt((gaps * gaps).sum(axis=2).min(axis=1))
            inside[inside] = nearest <= BESIDE_M
        return inside

    def comes_near(self, line: Polyline) -> bool:
        """Return whether a line comes within `CROSSED_M` of the ego's possible ways."""
        if self.routes_m is None:
            return True
        points = line.resample(_ROUTE_EVERY_M).points_m
        gaps = points[:, None, :] - self.routes_m[None, :, :]
        return bool((gaps * gaps).sum(axis=2).min() <= CROSSED_M**2)

    def span(self, line: Polyline) -> tuple[float, float] | None:
        """From where a line first comes into the region to where it last leaves it.

        Two arc lengths; None where it never does, or for less than `LEAST_M` of a longer line.
        """
        stations_m = np.append(np.arange(0.0, line.length_m, _LOOK_EVERY_M), line.length_m)
        inside = stations_m[self.holds(line.points_at(stations_m))]
        if len(inside) < 2:
            return None
        start_m, end_m = float(inside[0]), float(inside[-1])
        is_whole = end_m - start_m > line.length_m - _LOOK_EVERY_M
        return (start_m, end_m) if is_whole or end_m - start_m >= LEAST_M else None

    @property
    def box_m(self) -> tuple[float, float, float, float]:
        """Least x, least y, most x, most y of the region."""
        radius = self.radius_m
        if self.routes_m is None:
            return -radius, -radius, radius, radius
        low, high = self.routes_m.min(axis=0) - BESIDE_M, self.routes_m.max(axis=0) + BESIDE_M
        low, high = np.maximum(low, (-behind_m(radius), -radius)), np.minimum(high, radius)
        return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def behind_m(radius_m: float) -> float:
    """Return how far behind the ego a region along the lanes goes, in m."""
    return radius_m / 2.0


@lru_cache(maxsize=32)
def find_extent(scene: Scene, radius_m: float) -> Extent:
    """The region of a scene that prompts and the tool show."""
    route = None if math.isinf(radius_m) else EgoRoute.of(scene)
    if route is None:
        return Extent(radius_m=radius_m, routes_m=None)
    driven_m = max(DRIVEN_M, radius_m)
    lines = [
        line.between(start_m, end_m)
        for lane_id, (start_m, end_m) in _find_reached(route, driven_m).items()
        for line in [route.graph.lane(lane_id).centerline]
        if min(line.length_m, end_m) - start_m > _ROUTE_EVERY_M
    ]
    behind = max(0.0, route.ego_s_m - BEHIND_M)
    lines.append(route.line.between(behind, route.ego_s_m + _ROUTE_EVERY_M))
    points = np.vstack([line.resample(_ROUTE_EVERY_M).points_m for line in lines])
    near = np.hypot(*points.T) <= radius_m + BESIDE_M
    return Extent(radius_m=radius_m, routes_m=points[near])


@lru_cache(maxsize=32)
def find_spans(scene: Scene, radius_m: float) -> dict[str, tuple[float, float]]:
    """From where to where each lane and connector is shown, by its id, in the scene's order."""
    if math.isinf(radius_m):
        return {lane.id: (0.0, lane.centerline.length_m) for lane in scene.ways}
    extent = find_extent(scene, radius_m)
    shown: dict[str, tuple[float, float]] = {}
    connectors: list[LaneConnector] = []
    for lane in scene.ways:
        span = extent.span(lane.centerline)
        if span is None:
            continue
        if isinstance(lane, LaneConnector):
            is_known = any(_is_the_same(lane, other) for other in connectors)
            if is_known or not extent.comes_near(lane.centerline):
                continue
            connectors.append(lane)
        shown[lane.id] = span
    return shown


def boundary_near(area: Area, extent: Extent, tolerance_m: float) -> FloatArray:
    """Return an area's boundary (P, 2) as it is shown; empty for one that is not shown."""
    boundary = boundary_within(np.array(area.boundary_m, dtype=np.float64), extent.box_m)
    if len(boundary) and extent.routes_m is not None:
        polygon = shapely.make_valid(shapely.Polygon(boundary))
        if shapely.distance(polygon, shapely.MultiPoint(extent.routes_m)) > BESIDE_M:
            return np.empty((0, 2))
    return simplify_boundary(boundary, tolerance_m) if len(boundary) else boundary


def boundary_within(
    boundary_m: FloatArray, box_m: tuple[float, float, float, float]
) -> FloatArray:
    """Cut a boundary (P, 2) to a box: least x, least y, most x, most y; empty where they part."""
    points = np.asarray(boundary_m, dtype=np.float64)
    for side, limit_m in enumerate(box_m):
        axis, sign = side % 2, -1.0 if side < 2 else 1.0
        points = _cut(points, sign * (points[:, axis] - limit_m))
        if len(points) < 3:
            return np.empty((0, 2))
    return points


def simplify_boundary(boundary_m: FloatArray, tolerance_m: float) -> FloatArray:
    """Return the boundary (P, 2) with fewer points, nowhere further off than the tolerance.

    A boundary that would be less than a triangle stays as it is.
    """
    closed = shapely.LineString([*boundary_m, boundary_m[0]])
    simple = shapely.simplify(closed, tolerance_m, preserve_topology=False)
    corners = shapely.get_coordinates(simple)[:-1]
    return corners if len(corners) >= 3 else boundary_m


# Private


def _find_reached(route: EgoRoute, within_m: float) -> dict[str, tuple[float, float]]:
    """From where to where the ego can drive on each lane that it can get to, by id.

    Dijkstra's search; a connector that is entered is left, too.
    """
    graph = route.graph
    spans: dict[str, tuple[float, float]] = {}
    queue = [(0.0, within_m, route.lane_id, route.lane_s_m)]
    while queue:
        driven_m, ends_m, here, start_m = heapq.heappop(queue)
        if here in spans or driven_m > ends_m:
            continue
        lane = graph.lane(here)
        leaves_m = driven_m + lane.centerline.length_m - start_m
        if isinstance(lane, LaneConnector) and driven_m <= within_m:
            ends_m = max(ends_m, leaves_m + PAST_M)
        spans[here] = (start_m, start_m + ends_m - driven_m)
        beside = (lane.left_neighbor, lane.right_neighbor) if isinstance(lane, Lane) else ()
        x_m, y_m = lane.centerline.position(start_m)
        for other in beside:
            if other in graph.lanes:
                place = graph.lane(other).centerline.project(x_m, y_m)
                heapq.heappush(queue, (driven_m, ends_m, other, place.s_m))
        for following in graph.successors(here):
            heapq.heappush(queue, (leaves_m, ends_m, following, 0.0))
    return spans


def _is_the_same(connector: LaneConnector, other: LaneConnector) -> bool:
    """Return whether two connectors lead the same way, with the same lights, limits and turns."""
    facts = ("from_lane", "to_lane", "turn_type", "traffic_light", "speed_limit_mps")
    if any(getattr(connector, name) != getattr(other, name) for name in facts):
        return False
    shares = np.linspace(0.0, 1.0, 9)
    places = (
        line.points_at(shares * line.length_m) for line in (connector.centerline, other.centerline)
    )
    return bool(np.hypot(*np.subtract(*places).T).max() <= SAME_WITHIN_M)


def _cut(points: FloatArray, outside_m: FloatArray) -> FloatArray:
    """Return the part of a closed boundary where `outside_m`, given at each point, is <= 0."""
    points_left: list[FloatArray] = []
    for index in range(len(points)):
        before, here = outside_m[index - 1], outside_m[index]
        if (before > 0.0) != (here > 0.0):
            share = before / (before - here)
            points_left.append(points[index - 1] + share * (points[index] - points[index - 1]))
        if here <= 0.0:
            points_left.append(points[index])
    return np.array(points_left).reshape(-1, 2)
