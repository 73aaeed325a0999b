"""The ground of a picture: walkways, road surface, crosswalks, lane lines and centrelines."""

from __future__ import annotations

import math

import numpy as np

from augment.geometry.angles import difference
from augment.geometry.frames import Pose
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import MetricCanvas
from augment.render.shapes import (
    contains,
    long_axis,
    offset,
    resample_line,
    ribbon,
    runs,
    sides,
    stripes,
)
from augment.scene.entities import Area, AreaKind, Lane, LaneConnector, Scene
from augment.scene.lane_graph import AnyLane, LaneGraph

_ROAD_AREAS = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
_CHEVRON_EVERY_M = 12.0
_CHEVRON_M = np.array([[-0.5, 0.5], [0.25, 0.0], [-0.5, -0.5]])
# Up to this ratio of length to width a crosswalk's shape does not say which way it leads.
_STUB_RATIO = 1.5
# The paint of a lane line, and its dashes and gaps.
_LINE_M = 0.15
_DASH_M = (2.0, 2.0)
_INSET_M = 0.1


def draw_ground(ground: MetricCanvas, scene: Scene) -> None:
    """Everything that lies flat: areas first, then lines, then centrelines with directions."""
    all_lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    lanes = [lane for lane in all_lanes if _seen(ground, ribbon(lane))]
    areas = [area for area in scene.areas if _seen(ground, _boundary(area))]
    _walkways(ground, areas)
    roads = _surface(ground, lanes, areas)
    _crosswalks(ground, areas, lanes)
    _lane_lines(ground, scene, lanes, roads)
    _centrelines(ground, scene, lanes)


def _seen(ground: MetricCanvas, points_m: FloatArray) -> bool:
    return ground.camera.shows(points_m, margin_m=1.0)


def _boundary(area: Area) -> FloatArray:
    return np.array(area.boundary_m, dtype=np.float64)


def _walkways(ground: MetricCanvas, areas: list[Area]) -> None:
    found = [_boundary(area) for area in areas if area.kind is AreaKind.WALKWAY]
    for polygon in found:
        ground.stroke(polygon, palette.WALKWAY_EDGE, 1.5, closed=True)
    for polygon in found:
        ground.fill(polygon, palette.WALKWAY)


def _surface(ground: MetricCanvas, lanes: list[AnyLane], areas: list[Area]) -> list[FloatArray]:
    """One grey surface: all outlines first and all fills over them leave the union's outline."""
    roads = [_boundary(area) for area in areas if area.kind in _ROAD_AREAS]
    roads += [ribbon(lane) for lane in lanes]
    for polygon in roads:
        ground.stroke(polygon, palette.ROAD_EDGE, 4.0, closed=True)
    for polygon in roads:
        ground.fill(polygon, palette.ROAD)
        # Neighbours that meet exactly would show a hairline of the outline between them.
        ground.stroke(polygon, palette.ROAD, 1.0, closed=True)
    for area in areas:
        if area.kind is AreaKind.CARPARK:
            ground.fill(_boundary(area), palette.CARPARK)
        elif area.kind is AreaKind.INTERSECTION:
            ground.fill(_boundary(area), palette.INTERSECTION)
    return roads


def _crosswalks(ground: MetricCanvas, areas: list[Area], lanes: list[AnyLane]) -> None:
    for area in areas:
        if area.kind is AreaKind.CROSSWALK:
            polygon = _boundary(area)
            ground.fill(polygon, palette.ZEBRA_GROUND)
            for stripe in stripes(polygon, _traffic_direction(polygon, lanes), 1.0, 0.5):
                ground.fill(stripe, palette.ZEBRA)


def _traffic_direction(polygon: FloatArray, lanes: list[AnyLane]) -> float:
    """Along which axis of a crosswalk the cars drive: its stripes point there.

    The shorter axis, since people walk along the longer one; on a stub that is about as wide as
    long, the axis nearest to the heading of the lanes there.
    """
    along_rad, length_m, width_m = long_axis(polygon)
    if length_m > _STUB_RATIO * width_m:
        return along_rad + math.pi / 2.0
    x_m, y_m = polygon.mean(axis=0)
    votes = 0.0
    for lane in lanes:
        place = lane.centerline.project(float(x_m), float(y_m))
        if place.distance_m < lane.width_m:
            turn = difference(lane.centerline.heading_at(place.s_m), along_rad)
            votes += abs(math.cos(turn)) - abs(math.sin(turn))
    return along_rad if votes > 0.0 else along_rad + math.pi / 2.0


def _lane_lines(
    ground: MetricCanvas, scene: Scene, lanes: list[AnyLane], roads: list[FloatArray]
) -> None:
    """Dashed between lanes of one direction, solid towards the other direction and the margin.

    Where the road itself ends its outline is the line; inside intersections there is none.
    """
    graph = LaneGraph(scene)
    width_px = max(1.5, _LINE_M * ground.camera.px_per_m)
    for drawn in lanes:
        lane = drawn if isinstance(drawn, Lane) else _joined(graph, drawn)
        if lane is None:
            continue
        left, right = sides(drawn)
        if lane.left_neighbor is not None:
            ground.dashed(left, palette.LANE_LINE, width_px, *_DASH_M)
        else:
            _solid(ground, left, 1.0, roads)
        neighbor = graph.lanes.get(lane.right_neighbor or "")
        if lane.right_neighbor is None:
            _solid(ground, right, -1.0, roads)
        elif not isinstance(neighbor, Lane) or neighbor.left_neighbor != lane.id:
            # The neighbour on the right draws the common line, but this one does not know of it.
            ground.dashed(right, palette.LANE_LINE, width_px, *_DASH_M)


def _solid(
    ground: MetricCanvas, line_m: FloatArray, outwards: float, roads: list[FloatArray]
) -> None:
    """A thin solid line where there is road beyond it (on its left for 1, its right for -1).

    It lies a little inside its own lane: two lanes that meet head on get a double line.
    """
    fine = resample_line(line_m, 2.0)
    beyond = offset(fine, 0.5 * outwards)
    beyond = (beyond[:-1] + beyond[1:]) / 2.0
    inside = np.zeros(len(beyond), dtype=bool)
    for road in roads:
        inside |= contains(road, beyond)
    inner = offset(fine, -_INSET_M * outwards)
    for first, last in runs(inside):
        ground.stroke(inner[first : last + 2], palette.LANE_SOLID, 1.5)


def _joined(graph: LaneGraph, connector: LaneConnector) -> Lane | None:
    """The lane before a connector that only joins two pieces of it: nothing parts or merges."""
    before = graph.lanes.get(connector.from_lane or "")
    after = connector.to_lane
    if not isinstance(before, Lane) or after not in graph.lanes:
        return None
    alone = len(graph.successors(before.id)) == 1 and len(graph.predecessors(after)) == 1
    return before if alone else None


def _centrelines(ground: MetricCanvas, scene: Scene, lanes: list[AnyLane]) -> None:
    """Thin dashes, and chevrons that point where the traffic goes."""
    shown: list[Pose] = []
    for lane in lanes:
        colour = _line_colour(scene, lane)
        line = lane.centerline
        ground.dashed(line.points_m, colour, 1.4, 0.7, 0.8)
        count = max(1, round(line.length_m / _CHEVRON_EVERY_M))
        for index in range(count):
            pose = line.pose_at((index + 0.5) * line.length_m / count)
            points = pose.to_parent(_CHEVRON_M)
            if _seen(ground, points) and not any(_alike(pose, other) for other in shown):
                ground.stroke(points, colour, 1.8)
                shown.append(pose)


def _line_colour(scene: Scene, lane: AnyLane) -> palette.Colour:
    if isinstance(lane, LaneConnector):
        return palette.CONNECTOR
    return palette.EGO_LANE if lane.id == scene.ego.lane_id else palette.OTHER_LANE


def _alike(one: Pose, other: Pose) -> bool:
    """Whether two chevrons say the same: connectors that part late run side by side."""
    near = math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) < 2.0
    return near and abs(difference(one.heading_rad, other.heading_rad)) < math.radians(40.0)
