"""The ground of a picture: walkways, road surface, crosswalks, lane lines and centrelines."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, MetricCanvas
from augment.render.palette import Colour
from augment.render.shapes import long_axis, offset, resample_line, ring_of, runs, sides, stripes
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    Scene,
    TrafficAgent,
    TrafficLight,
    TurnType,
)
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


_COLOURS = {
    TrafficLight.RED: palette.LIGHT_RED,
    TrafficLight.YELLOW: palette.LIGHT_YELLOW,
    TrafficLight.GREEN: palette.LIGHT_GREEN,
}
_LEFT_TO_RIGHT = (TurnType.U_TURN, TurnType.LEFT, TurnType.STRAIGHT, TurnType.RIGHT)
_LAMP_PX = 5.5
_GOAL_FROM_M, _GOAL_TO_M = 4.0, 80.0


def draw_signals(ground: MetricCanvas, scene: Scene) -> None:
    """One bar for each place where ruled connectors begin, cut where their states differ."""
    starts: dict[str, list[LaneConnector]] = {}
    for connector in scene.connectors:
        if connector.traffic_light in _COLOURS:
            starts.setdefault(connector.from_lane or connector.id, []).append(connector)
    for connectors in starts.values():
        if ground.camera.shows(connectors[0].centerline.points_m[:1]):
            _bar(ground, connectors)


def draw_goal(ground: MetricCanvas, scene: Scene) -> None:
    """The ego's way to the scenario's goal, dashed; nothing for a scenario without one."""
    route = EgoRoute.of(scene) if scene.options.goal is not None else None
    if route is None or route.line.length_m - route.ego_s_m < _GOAL_FROM_M:
        return
    end_m = min(route.line.length_m, route.ego_s_m + _GOAL_TO_M)
    way = route.line.between(route.ego_s_m + _GOAL_FROM_M, end_m)
    ground.dashed(way.points_m, palette.EGO_MARK.fill, 2.0, 1.5, 1.5)


def _bar(ground: MetricCanvas, connectors: list[LaneConnector]) -> None:
    ordered = sorted(connectors, key=lambda one: _LEFT_TO_RIGHT.index(one.turn_type))
    # The straightest way leaves its lane most squarely, so the bar is laid across that one.
    first = min(ordered, key=lambda one: one.turn_type is not TurnType.STRAIGHT)
    start, width_m = first.centerline.pose_at(0.0), 0.84 * first.width_m
    states = list(dict.fromkeys(connector.traffic_light for connector in ordered))
    part_m = width_m / len(states)
    for index, state in enumerate(states):
        left_m = width_m / 2.0 - index * part_m
        ends = start.to_parent(np.array([[0.0, left_m], [0.0, left_m - part_m]]))
        ground.stroke(ends, _COLOURS[state], max(2.0, 0.2 * ground.camera.px_per_m))
        _lamp(ground, start, left_m - part_m / 2.0, state)


def _lamp(ground: MetricCanvas, start: Pose, left_m: float, state: TrafficLight) -> None:
    x_m, y_m = start.to_parent(np.array([[0.0, left_m]]))[0]
    centre = ground.at(float(x_m), float(y_m))
    if state is TrafficLight.GREEN:
        ground.canvas.disc(centre, _LAMP_PX + 1.5, palette.PAPER)
        ground.canvas.disc(centre, _LAMP_PX, _COLOURS[state])
        return
    # A diamond is a square on its corner; the red square stands upright in the picture.
    first_rad = math.pi / 4.0 if state is TrafficLight.RED else 0.0
    corners_rad = first_rad + np.arange(4) * math.pi / 2.0
    square = np.column_stack([np.cos(corners_rad), np.sin(corners_rad)])
    ground.canvas.fill(np.array(centre) + square * (1.25 * _LAMP_PX + 2.0), palette.PAPER)
    ground.canvas.fill(np.array(centre) + square * 1.25 * _LAMP_PX, _COLOURS[state])


GRID_M = 5.0
Corner = tuple[bool, bool]
"""Of a picture: whether it is right, whether it is at the top."""
TEXT_PX = 21
_INSET_PX = 12.0
_PADDING_PX = 28.0
_HEIGHT_PX = 52.0
# About half a car at the usual scale.
_NEAR_PX = 50.0


def draw_grid(ground: MetricCanvas) -> None:
    """Lines every 5 m; those through the ego's centre are stronger."""
    camera = ground.camera
    for x_m in raster(camera.x_min_m, camera.x_max_m):
        line = np.array([[x_m, camera.y_min_m], [x_m, camera.y_max_m]])
        _line(ground, line, axis=x_m == 0.0)
    for y_m in raster(camera.y_min_m, camera.y_max_m):
        line = np.array([[camera.x_min_m, y_m], [camera.x_max_m, y_m]])
        _line(ground, line, axis=y_m == 0.0)


def raster(low_m: float, high_m: float) -> list[float]:
    """The multiples of 5 m strictly between two values."""
    first, last = math.floor(low_m / GRID_M) + 1, math.ceil(high_m / GRID_M) - 1
    return [index * GRID_M for index in range(first, last + 1)]


def scale_corner(scene: Scene, camera: Camera) -> Corner:
    """The quiet corner that the scale bar lies in: (whether right, whether at the top).

    It depends on the scene before the change alone, so that all pictures of a scenario have their
    scale in the same place: bottom left, unless another one hides fewer agents.
    """
    corners: list[Corner] = [(right, top) for top in (False, True) for right in (False, True)]
    places = np.array([[agent.x_m, agent.y_m] for agent in scene.everyone])
    agents_px = camera.to_pixels(places).tolist()
    boxes = {corner: scale_box(camera, corner) for corner in corners}
    return min(corners, key=lambda one: sum(_close(boxes[one], x, y) for x, y in agents_px))


def scale_box(camera: Camera, corner: Corner) -> Box:
    """The plate of the scale bar in a corner: left, top, right, bottom in pixels."""
    is_right, is_top = corner
    width = 2.0 * _unit_m(camera) * camera.px_per_m + 2.0 * _PADDING_PX
    left = camera.width_px - _INSET_PX - width if is_right else _INSET_PX
    top = _INSET_PX if is_top else camera.height_px - _INSET_PX - _HEIGHT_PX
    return left, top, left + width, top + _HEIGHT_PX


def draw_scale(ground: MetricCanvas, box_px: Box) -> None:
    """A bar of two units, one filled, one empty, with their lengths beneath."""
    left, top, _, _ = box_px
    ground.canvas.plate(box_px, palette.PAPER, None, 6.0)
    unit_m = _unit_m(ground.camera)
    unit_px = unit_m * ground.camera.px_per_m
    start, bar_top, bar_bottom = left + _PADDING_PX, top + 9.0, top + 16.0
    middle, end = start + unit_px, start + 2.0 * unit_px
    ground.canvas.fill(_rectangle(start, bar_top, end, bar_bottom), palette.INK)
    ground.canvas.fill(
        _rectangle(middle, bar_top + 1.5, end - 1.5, bar_bottom - 1.5), palette.PAPER
    )
    for index in range(3):
        text = f"{index * unit_m:.0f}" + (" m" if index == 2 else "")
        at = (start + index * unit_px, bar_bottom + 15.0)
        ground.canvas.text(at, text, palette.INK, TEXT_PX)


def _close(box: Box, x_px: float, y_px: float) -> bool:
    """Whether a mark in the picture may touch the box."""
    left, top, right, bottom = box
    return (
        max(0.0, left - _NEAR_PX) < x_px < right + _NEAR_PX
        and max(0.0, top - _NEAR_PX) < y_px < bottom + _NEAR_PX
    )


def _unit_m(camera: Camera) -> float:
    return 5.0 if camera.px_per_m >= 9.0 else 10.0


def _rectangle(left: float, top: float, right: float, bottom: float) -> FloatArray:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def _line(ground: MetricCanvas, line_m: FloatArray, *, axis: bool) -> None:
    ground.stroke(line_m, palette.GRID_AXIS if axis else palette.GRID, 1.0)
