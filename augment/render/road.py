"""The ground of a picture: road, lines, crosswalks, lights, the 5 m grid and the scale bar."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, Canvas, overlap
from augment.render.palette import Colour
from augment.render.shapes import lane_ring, long_axis, offset, resample_line, runs, sides, stripes
from augment.scene import entities
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AnyLane, AreaKind, Lane, LaneConnector, Scene, TurnType
from augment.scene.lane_graph import LaneGraph

GRID_M = 5.0
Corner = tuple[bool, bool]
"""Of a picture: whether it is right, whether it is at the top."""
Strip = tuple[AnyLane, FloatArray, FloatArray]
"""A lane in the picture with its two sides (P, 2), worked out once."""

_ROAD_COLOURS = (palette.ROAD, palette.CARPARK, palette.INTERSECTION)
_CHEVRON_EVERY_M = 12.0
# (3, 2) ahead and left: its tip lies ahead.
_CHEVRON_M = np.array([[-0.5, 0.5], [0.25, 0.0], [-0.5, -0.5]])
# Up to this ratio of length to width a crosswalk's shape does not say which lane it leads.
_STUB_RATIO = 1.5
# The paint of a lane line, and its dashes and gaps.
_LINE_M, _DASH_M = 0.15, 2.0
_INSET_M = 0.1
# So far ahead the lanes that the ego can take are shown as its own.
_OWN_M = 60.0
_OWN_ASIDE_M, _OWN_TURN_RAD = 1.0, math.radians(20.0)
_LIGHTS = {
    entities.TrafficLight.RED: palette.LIGHT_RED,
    entities.TrafficLight.YELLOW: palette.LIGHT_YELLOW,
    entities.TrafficLight.GREEN: palette.LIGHT_GREEN,
}
_LEFT_TO_RIGHT = (TurnType.U_TURN, TurnType.LEFT, TurnType.STRAIGHT, TurnType.RIGHT)
_LAMP_PX = 5.5
# Ahead of the ego's centre.
_GOAL_FROM_M, _GOAL_TO_M = 4.0, 80.0
_SCALE_TEXT_PX = 21
_INSET_PX, _PADDING_PX, _HEIGHT_PX = 12.0, 28.0, 52.0
_TICK_HALF_M = 1.5
# About half a car at the usual scale.
_NEAR_PX = 50.0


def draw_ground(ground: Canvas, scene: Scene) -> None:
    """Draw all that lies flat: areas first, then lines, centrelines with directions, the grid."""
    shows = ground.camera.shows
    lanes = [lane for lane in scene.ways if shows(lane.centerline.points_m, margin_m=lane.width_m)]
    strips: list[Strip] = [(lane, *sides(lane)) for lane in lanes]
    areas = [(area.kind, np.array(area.boundary_m, dtype=np.float64)) for area in scene.areas]
    areas = [(kind, ring) for kind, ring in areas if shows(ring, margin_m=1.0)]
    _surface(ground, strips, areas)
    _lane_lines(ground, scene, strips)
    for kind, ring in areas:
        if kind is AreaKind.CROSSWALK:
            ground.fill(ground.px(ring), palette.ZEBRA_GROUND)
            for stripe in stripes(ring, _traffic_direction(ring, lanes), 1.0, 0.5):
                ground.fill(ground.px(stripe), palette.ZEBRA)
    _centrelines(ground, scene, lanes)
    _grid(ground)


def beyond_road(scene: Scene) -> Colour:
    """Return a picture's first filling: paper, or a ground of its own.

    A map without walkways has nothing between road and paper: only a colour tells them apart.
    """
    has_walkways = any(area.kind is AreaKind.WALKWAY for area in scene.areas)
    return palette.PAPER if has_walkways else palette.BEYOND


def own_lanes(scene: Scene) -> frozenset[str]:
    """Return the lanes that the ego can take from where it is, up to 60 m and past one fork.

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


def draw_signals(ground: Canvas, scene: Scene) -> None:
    """Draw a bar where ruled connectors begin, cut where their states differ, with lamps.

    A light of unknown state is not drawn: maps without lights say "unknown" everywhere.
    """
    starts: dict[str, list[LaneConnector]] = {}
    for connector in scene.connectors:
        if connector.traffic_light in _LIGHTS:
            starts.setdefault(connector.from_lane or connector.id, []).append(connector)
    for connectors in starts.values():
        if not ground.camera.shows(connectors[0].centerline.points_m[:1]):
            continue
        ordered = sorted(
            connectors, key=lambda connector: _LEFT_TO_RIGHT.index(connector.turn_type)
        )
        # The straightest way leaves its lane most squarely, so the bar is laid across that one.
        first = min(ordered, key=lambda connector: connector.turn_type is not TurnType.STRAIGHT)
        start, width_m = first.centerline.pose_at(0.0), 0.84 * first.width_m
        states = list(dict.fromkeys(connector.traffic_light for connector in ordered))
        part_m = width_m / len(states)
        for index, state in enumerate(states):
            left_m = width_m / 2.0 - index * part_m
            # (3, 2) from the connector's beginning: the two ends of a part, and its lamp between.
            ends = [[0.0, left_m], [0.0, left_m - part_m], [0.0, left_m - part_m / 2.0]]
            points = ground.px(start.to_parent(np.array(ends)))
            bar_px = max(2.0, 0.2 * ground.camera.px_per_m)
            ground.stroke(points[:2], _LIGHTS[state], bar_px)
            _lamp(ground, points[2], state)


def draw_goal(ground: Canvas, scene: Scene) -> None:
    """Draw the ego's way to the scenario's goal, dashed; nothing for a scenario without one."""
    route = EgoRoute.of(scene) if scene.options.goal is not None else None
    if route is None or route.line.length_m - route.ego_s_m < _GOAL_FROM_M:
        return
    end_m = min(route.line.length_m, route.ego_s_m + _GOAL_TO_M)
    way = route.line.between(route.ego_s_m + _GOAL_FROM_M, end_m)
    dash_px = 1.5 * ground.camera.px_per_m
    ground.draw_dashes(ground.px(way.points_m), palette.EGO_MARK.fill, 2.0, dash_px, dash_px)


def draw_ticks(ground: Canvas, scene: Scene) -> None:
    """Draw a bar across the ego's lane at each distance that the camera marks, with its metres."""
    for ahead_m, bar in tick_bars(scene, ground.camera.ticks_m):
        ground.stroke(ground.px(bar), palette.INK, 2.0)
        x, y = ground.px(bar[1:])[0].tolist()
        ground.text((x, y + 12.0), f"{ahead_m:g} m", palette.INK, 14, halo=palette.HALO)


def tick_bars(scene: Scene, ticks_m: Sequence[float]) -> Iterator[tuple[float, FloatArray]]:
    """Yield distances ahead, as far as the ego's lane goes, each with its bar (2, 2) across it."""
    route = EgoRoute.of(scene) if ticks_m else None
    for ahead_m in ticks_m:
        if route is not None and route.ego_s_m + ahead_m <= route.line.length_m:
            pose = route.line.pose_at(route.ego_s_m + ahead_m)
            yield ahead_m, pose.to_parent(np.array([[0.0, _TICK_HALF_M], [0.0, -_TICK_HALF_M]]))


def raster(low_m: float, high_m: float) -> list[float]:
    """Return the multiples of 5 m strictly between two values."""
    first, last = math.floor(low_m / GRID_M) + 1, math.ceil(high_m / GRID_M) - 1
    return [index * GRID_M for index in range(first, last + 1)]


def scale_corner(scene: Scene, camera: Camera) -> Corner:
    """Return the quiet corner that the scale bar lies in: (whether right, whether at the top).

    It depends on the scene before the change alone, so that all pictures of a scenario have their
    scale in the same place: bottom left, unless another one hides fewer agents.
    """
    corners: list[Corner] = [(right, top) for top in (False, True) for right in (False, True)]
    places = camera.to_pixels(np.array([[agent.x_m, agent.y_m] for agent in scene.everyone]))
    spots = [(x, y, x, y) for x, y in places.tolist() if min(x, y) > 0.0]
    inset = [camera.inset.box_px] if camera.inset else []

    def count_hidden(corner: Corner) -> tuple[int, int]:
        box = scale_box(camera, corner)
        hidden = [overlap(box, at, _NEAR_PX) for at in spots]
        return sum(overlap(box, at, _INSET_PX) for at in inset), sum(hidden)

    return min(corners, key=count_hidden)


def scale_box(camera: Camera, corner: Corner) -> Box:
    """Return the plate of the scale bar in a corner: left, top, right, bottom in pixels."""
    is_right, is_top = corner
    width = 2.0 * _unit_m(camera) * camera.px_per_m + 2.0 * _PADDING_PX
    left = camera.width_px - _INSET_PX - width if is_right else _INSET_PX
    top = _INSET_PX if is_top else camera.height_px - _INSET_PX - _HEIGHT_PX
    return left, top, left + width, top + _HEIGHT_PX


def draw_scale(ground: Canvas, box_px: Box) -> None:
    """Draw a bar of two units, one filled, one empty, with their lengths beneath."""
    ground.plate(box_px, palette.PAPER, None, 6.0)
    unit_m = _unit_m(ground.camera)
    unit_px = unit_m * ground.camera.px_per_m
    start, top, bottom = box_px[0] + _PADDING_PX, box_px[1] + 9.0, box_px[1] + 16.0
    middle, end = start + unit_px, start + 2.0 * unit_px
    for left, inset, colour in ((start, 0.0, palette.INK), (middle, 1.5, palette.PAPER)):
        low, high = top + inset, bottom - inset
        bar = [[left, low], [end - inset, low], [end - inset, high], [left, high]]
        ground.fill(np.array(bar), colour)
    for index in range(3):
        text = f"{index * unit_m:.0f}" + (" m" if index == 2 else "")
        at = (start + index * unit_px, bottom + 15.0)
        ground.text(at, text, palette.INK, _SCALE_TEXT_PX)


# Private


def _surface(
    ground: Canvas, strips: list[Strip], areas: list[tuple[AreaKind, FloatArray]]
) -> None:
    """Fill walkways, then one grey surface: all outlines first, so the union's outline is left."""
    walkways = [ground.px(ring) for kind, ring in areas if kind is AreaKind.WALKWAY]
    for polygon in walkways:
        ground.stroke(polygon, palette.WALKWAY_EDGE, 1.5, closed=True)
    for polygon in walkways:
        ground.fill(polygon, palette.WALKWAY)
    roads = [ground.px(ring) for kind, ring in areas if kind in entities.DRIVEN_ON]
    roads += [ground.px(lane_ring(left, right)) for _, left, right in strips]
    for polygon in roads:
        ground.stroke(polygon, palette.ROAD_EDGE, 4.0, closed=True)
    for polygon in roads:
        ground.fill(polygon, palette.ROAD)
        # Neighbours that meet exactly would show a hairline of the outline between them.
        ground.stroke(polygon, palette.ROAD, 1.0, closed=True)
    special = {AreaKind.CARPARK: palette.CARPARK, AreaKind.INTERSECTION: palette.INTERSECTION}
    for kind, ring in areas:
        if kind in special:
            ground.fill(ground.px(ring), special[kind])


def _traffic_direction(polygon: FloatArray, lanes: list[AnyLane]) -> float:
    """Return along which axis of a crosswalk the cars drive: its stripes point there.

    The shorter axis, since people walk along the longer one; on a stub that is about as wide as
    long, the axis nearest to the heading of the lanes there.
    """
    along_rad, length_m, width_m = long_axis(polygon)
    if length_m > _STUB_RATIO * width_m:
        return along_rad + math.pi / 2.0
    x_m, y_m = polygon.mean(axis=0).tolist()
    votes = 0.0
    for lane in lanes:
        place = lane.centerline.project(x_m, y_m)
        if place.distance_m < lane.width_m:
            turn = difference(lane.centerline.heading_at(place.s_m), along_rad)
            # 1 for a lane along the axis, -1 for one across it.
            votes += abs(math.cos(turn)) - abs(math.sin(turn))
    return along_rad if votes > 0.0 else along_rad + math.pi / 2.0


def _lane_lines(ground: Canvas, scene: Scene, strips: list[Strip]) -> None:
    """Draw dashes between lanes of one direction, solid towards the other and the margin.

    Where the road itself ends its outline is the line; inside intersections there is none.
    """
    graph, scale = LaneGraph(scene), ground.camera.px_per_m
    width_px, dash_px = max(1.5, _LINE_M * scale), _DASH_M * scale
    margins: list[tuple[FloatArray, float]] = []
    for way, left, right in strips:
        lane = way if isinstance(way, Lane) else _lane_before(graph, way)
        if lane is None:
            continue
        dashed: list[FloatArray] = []
        if lane.left_neighbor is not None:
            dashed.append(left)
        else:
            margins.append((left, 1.0))
        neighbor = graph.lanes.get(lane.right_neighbor or "")
        if lane.right_neighbor is None:
            margins.append((right, -1.0))
        elif not isinstance(neighbor, Lane) or neighbor.left_neighbor != lane.id:
            # The neighbour on the right draws the common line, but this one does not know of it.
            dashed.append(right)
        for line in dashed:
            ground.draw_dashes(ground.px(line), palette.LANE_LINE, width_px, dash_px, dash_px)
    # All solid lines come last. They lie a little inside their own lane, where there is road
    # beyond them: two lanes that meet head on get a double line.
    is_road = [_has_road_beyond(ground, line, side) for line, side in margins]
    for (line, side), is_margin_road in zip(margins, is_road, strict=True):
        inner = ground.px(offset(resample_line(line, 2.0), -_INSET_M * side))
        for first, last in runs(is_margin_road):
            # Pieces first to last lie between the points first and last + 1.
            ground.stroke(inner[first : last + 2], palette.LANE_SOLID, 1.5)


def _has_road_beyond(ground: Canvas, line: FloatArray, side: float) -> np.ndarray:
    """Return for each piece of a line whether road lies on its left (side 1) or right (-1)."""
    # Half a metre outside, looked at in the middle of each piece, (P - 1, 2).
    beyond = offset(resample_line(line, 2.0), 0.5 * side)
    return ground.holds(ground.px((beyond[:-1] + beyond[1:]) / 2.0), _ROAD_COLOURS)


def _lane_before(graph: LaneGraph, connector: LaneConnector) -> Lane | None:
    """Return the lane before a connector that only joins two pieces of it, else None."""
    before = graph.lanes.get(connector.from_lane or "")
    after = connector.to_lane
    if not isinstance(before, Lane) or after not in graph.lanes:
        return None
    alone = len(graph.successors(before.id)) == 1 and len(graph.predecessors(after)) == 1
    return before if alone else None


def _centrelines(ground: Canvas, scene: Scene, lanes: list[AnyLane]) -> None:
    """Draw dashes, and chevrons where the traffic goes; of what the ego can take stronger.

    Connectors of others are thin lines without chevrons: in a junction of many they would tangle.
    """
    own, scale = own_lanes(scene), ground.camera.px_per_m
    shown: list[Pose] = []
    for lane in sorted(lanes, key=lambda lane: (lane.id in own, isinstance(lane, Lane))):
        line = lane.centerline
        if isinstance(lane, LaneConnector) and lane.id not in own:
            ground.stroke(ground.px(line.points_m), palette.CONNECTOR, 1.0)
            continue
        colour, width = (palette.OWN_LANE, 1.8) if lane.id in own else (palette.OTHER_LANE, 1.4)
        ground.draw_dashes(ground.px(line.points_m), colour, width, 1.2 * scale, 1.3 * scale)
        count = max(1, round(line.length_m / _CHEVRON_EVERY_M))
        for index in range(count):
            pose = line.pose_at((index + 0.5) * line.length_m / count)
            points = pose.to_parent(_CHEVRON_M)
            is_seen = ground.camera.shows(points, margin_m=1.0)
            if is_seen and not any(_alike(pose, other) for other in shown):
                ground.stroke(ground.px(points), colour, width + 0.4)
                shown.append(pose)


def _is_on(lane: AnyLane, ego: entities.TrafficAgent) -> bool:
    if lane.id == ego.lane_id:
        return True
    if not isinstance(lane, LaneConnector):
        return False
    place = lane.centerline.project(ego.x_m, ego.y_m)
    turn = difference(lane.centerline.heading_at(place.s_m), ego.heading_rad)
    return place.distance_m < _OWN_ASIDE_M and abs(turn) < _OWN_TURN_RAD


def _alike(pose: Pose, other: Pose) -> bool:
    """Return whether two chevrons say the same: connectors that part late run side by side."""
    near = math.hypot(pose.x_m - other.x_m, pose.y_m - other.y_m) < 2.0
    return near and abs(difference(pose.heading_rad, other.heading_rad)) < math.radians(40.0)


def _lamp(ground: Canvas, centre: FloatArray, state: entities.TrafficLight) -> None:
    """Draw a lamp whose shape says the state as well: a square, a diamond, a circle."""
    if state is entities.TrafficLight.GREEN:
        x, y = centre.tolist()
        ground.disc((x, y), _LAMP_PX + 1.5, palette.PAPER)
        ground.disc((x, y), _LAMP_PX, _LIGHTS[state])
        return
    # A diamond is a square on its corner; the red square stands upright in the picture.
    first_rad = math.pi / 4.0 if state is entities.TrafficLight.RED else 0.0
    corners_rad = first_rad + np.arange(4) * math.pi / 2.0
    square = np.column_stack([np.cos(corners_rad), np.sin(corners_rad)])
    ground.fill(centre + square * (1.25 * _LAMP_PX + 2.0), palette.PAPER)
    ground.fill(centre + square * 1.25 * _LAMP_PX, _LIGHTS[state])


def _grid(ground: Canvas) -> None:
    """Draw lines every 5 m; those through the ego's centre are stronger."""
    camera = ground.camera
    low, high = (camera.x_min_m, camera.y_min_m), (camera.x_max_m, camera.y_max_m)
    for axis in (0, 1):
        for value in raster(low[axis], high[axis]):
            line = np.array([low, high])
            line[:, axis] = value
            colour = palette.GRID if value else palette.GRID_AXIS
            ground.stroke(ground.px(line), colour, 1.0)


def _unit_m(camera: Camera) -> float:
    return 5.0 if camera.px_per_m >= 9.0 else 10.0
