"""The ground of a picture: walkways, road surface, crosswalks, lane lines and centrelines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import MetricCanvas
from augment.render.palette import Colour
from augment.render.shapes import long_axis, offset, resample_line, ring_of, runs, sides, stripes
from augment.scene.entities import Area, AreaKind, Lane, LaneConnector, Scene, TrafficAgent
from augment.scene.lane_graph import AnyLane, LaneGraph

_ROAD_AREAS = (AreaKind.DRIVABLE, AreaKind.CARPARK, AreaKind.INTERSECTION)
_ROAD_COLOURS = (palette.ROAD, palette.CARPARK, palette.INTERSECTION)
_CHEVRON_EVERY_M = 12.0
_CHEVRON_M = np.array([[-0.5, 0.5], [0.25, 0.0], [-0.5, -0.5]])
# Up to this ratio of length to width a crosswalk's shape does not say which lane it leads.
_STUB_RATIO = 1.5
# The paint of a lane line, and its dashes and gaps.
_LINE_M = 0.15
_DASH_M = (2.0, 2.0)
_INSET_M = 0.1
# So far ahead the lanes that the ego can take are shown as its own.
_OWN_M = 60.0
_OWN_ASIDE_M, _OWN_TURN_RAD = 1.0, math.radians(20.0)


@dataclass(frozen=True, slots=True)
class _Strip:
    """A lane in the picture with its two sides (P, 2), worked out once."""

    lane: AnyLane
    left: FloatArray
    right: FloatArray

    @property
    def ring(self) -> FloatArray:
        return ring_of(self.left, self.right)


def draw_ground(ground: MetricCanvas, scene: Scene) -> None:
    """Everything that lies flat: areas first, then lines, then centrelines with directions."""
    strips = [_Strip(lane, *sides(lane)) for lane in _lanes(ground, scene)]
    areas = [area for area in scene.areas if _seen(ground, _boundary(area))]
    _walkways(ground, areas)
    _surface(ground, strips, areas)
    _lane_lines(ground, scene, strips)
    _crosswalks(ground, areas, [strip.lane for strip in strips])
    _centrelines(ground, scene, [strip.lane for strip in strips])


def beyond_road(scene: Scene) -> Colour:
    """What a picture is filled with first: paper, or a ground of its own.

    A map without walkways has nothing between road and paper: only a colour tells them apart.
    """
    has_walkways = any(area.kind is AreaKind.WALKWAY for area in scene.areas)
    return palette.PAPER if has_walkways else palette.BEYOND


def _lanes(ground: MetricCanvas, scene: Scene) -> list[AnyLane]:
    every: list[AnyLane] = [*scene.lanes, *scene.connectors]
    return [
        lane
        for lane in every
        if ground.camera.shows(lane.centerline.points_m, margin_m=lane.width_m)
    ]


def _seen(ground: MetricCanvas, points_m: FloatArray) -> bool:
    return ground.camera.shows(points_m, margin_m=1.0)


def _boundary(area: Area) -> FloatArray:
    return np.array(area.boundary_m, dtype=np.float64)


def _walkways(ground: MetricCanvas, areas: list[Area]) -> None:
    walkways = [_boundary(area) for area in areas if area.kind is AreaKind.WALKWAY]
    for polygon in walkways:
        ground.stroke(polygon, palette.WALKWAY_EDGE, 1.5, closed=True)
    for polygon in walkways:
        ground.fill(polygon, palette.WALKWAY)


def _surface(ground: MetricCanvas, strips: list[_Strip], areas: list[Area]) -> None:
    """One grey surface: all outlines first and all fills over them leave the union's outline."""
    roads = [_boundary(area) for area in areas if area.kind in _ROAD_AREAS]
    roads += [strip.ring for strip in strips]
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


def _lane_lines(ground: MetricCanvas, scene: Scene, strips: list[_Strip]) -> None:
    """Dashed between lanes of one direction, solid towards the other direction and the margin.

    Where the road itself ends its outline is the line; inside intersections there is none.
    """
    graph = LaneGraph(scene)
    width_px = max(1.5, _LINE_M * ground.camera.px_per_m)
    margins: list[tuple[FloatArray, float]] = []
    for strip in strips:
        lane = strip.lane if isinstance(strip.lane, Lane) else _joined(graph, strip.lane)
        if lane is None:
            continue
        if lane.left_neighbor is not None:
            ground.dashed(strip.left, palette.LANE_LINE, width_px, *_DASH_M)
        else:
            margins.append((strip.left, 1.0))
        neighbor = graph.lanes.get(lane.right_neighbor or "")
        if lane.right_neighbor is None:
            margins.append((strip.right, -1.0))
        elif not isinstance(neighbor, Lane) or neighbor.left_neighbor != lane.id:
            # The neighbour on the right draws the common line, but this one does not know of it.
            ground.dashed(strip.right, palette.LANE_LINE, width_px, *_DASH_M)
    _solid(ground, margins)


def _solid(ground: MetricCanvas, margins: list[tuple[FloatArray, float]]) -> None:
    """Thin solid lines where there is road beyond them (on their left for 1, their right for -1).

    They lie a little inside their own lane: two lanes that meet head on get a double line.
    """
    if not margins:
        return
    fine = [resample_line(line_m, 2.0) for line_m, _ in margins]
    beyond = [offset(line_m, 0.5 * side) for line_m, (_, side) in zip(fine, margins, strict=True)]
    middles = [(line_m[:-1] + line_m[1:]) / 2.0 for line_m in beyond]
    is_road = ground.holds(np.concatenate(middles), _ROAD_COLOURS)
    ends = np.cumsum([len(line_m) for line_m in middles])[:-1]
    for line_m, (_, side), found in zip(fine, margins, np.split(is_road, ends), strict=True):
        if found.any():
            inner = offset(line_m, -_INSET_M * side)
            for first, last in runs(found):
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
    """Dashes, and chevrons that point where the traffic goes; of what the ego can take stronger.

    Connectors of others are thin lines without chevrons: in a junction of many they would tangle.
    """
    own = own_lanes(scene)
    shown: list[Pose] = []
    for lane in sorted(lanes, key=lambda lane: (lane.id in own, isinstance(lane, Lane))):
        line = lane.centerline
        if isinstance(lane, LaneConnector) and lane.id not in own:
            ground.stroke(line.points_m, palette.CONNECTOR, 1.0)
            continue
        colour = palette.OWN_LANE if lane.id in own else palette.OTHER_LANE
        width_px = 1.8 if lane.id in own else 1.4
        ground.dashed(line.points_m, colour, width_px, 1.2, 1.3)
        count = max(1, round(line.length_m / _CHEVRON_EVERY_M))
        for index in range(count):
            pose = line.pose_at((index + 0.5) * line.length_m / count)
            points = pose.to_parent(_CHEVRON_M)
            if _seen(ground, points) and not any(_alike(pose, other) for other in shown):
                ground.stroke(points, colour, width_px + 0.4)
                shown.append(pose)


def own_lanes(scene: Scene) -> frozenset[str]:
    """The lanes that the ego can take from where it is, up to 60 m and past one fork.

    At the mouth of a junction it stands on several at once.
    """
    graph = LaneGraph(scene)
    starts = [lane.id for lane in graph.lanes.values() if _is_on(lane, scene.ego)]
    own: set[str] = set()
    ahead = [(name, 0.0, len(starts) > 1) for name in starts]
    while ahead:
        lane_id, at_m, has_forked = ahead.pop()
        own.add(lane_id)
        at_m += graph.lanes[lane_id].centerline.length_m
        following = [name for name in graph.successors(lane_id) if name not in own]
        if at_m < _OWN_M and not (has_forked and len(following) > 1):
            ahead += [(name, at_m, has_forked or len(following) > 1) for name in following]
    return frozenset(own)


def _is_on(lane: AnyLane, ego: TrafficAgent) -> bool:
    if lane.id == ego.lane_id:
        return True
    if not isinstance(lane, LaneConnector):
        return False
    place = lane.centerline.project(ego.x_m, ego.y_m)
    turn = difference(lane.centerline.heading_at(place.s_m), ego.heading_rad)
    return place.distance_m < _OWN_ASIDE_M and abs(turn) < _OWN_TURN_RAD


def _alike(one: Pose, other: Pose) -> bool:
    """Whether two chevrons say the same: connectors that part late run side by side."""
    near = math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) < 2.0
    return near and abs(difference(one.heading_rad, other.heading_rad)) < math.radians(40.0)
