"""The marks of road users and objects: shape and outline tell them apart, not colour alone.

Vehicles keep their true boxes; people, cones and signs have a least size in pixels, so that they
can be seen in every window.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from augment.geometry.frames import corners
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import Canvas
from augment.render.palette import Colour, MarkStyle
from augment.render.shapes import stripes
from augment.scene.entities import UPRIGHT, AgentType, TrafficAgent
from augment.scene.motion import Trail

# The body of a person: on the smallest screen without scrolling, half as many.
PERSON_PX = 28.0
# A speed below which nothing is drawn as moving.
_STANDING_MPS = 0.3
_LEAST_WALK_M = 0.1
# More than the half size of any mark that is drawn larger than it is.
_LEAST_MARK_PX = 24.0
# Walks nearer to each other than this, and nearly as they go, are drawn side by side.
_WALK_GAP_PX = 9.0
_WALK_TURN_COS = 0.95
# The tick at the nose of what moves is the way of this time.
_TICK_S = 1.0

SMALL = (AgentType.PEDESTRIAN, AgentType.BICYCLE, AgentType.BARRIER, *UPRIGHT)
"""Their marks lie above walks and vehicles, which would hide them."""
_Points = Sequence[tuple[float, float]]


def draw_motion(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw the way of one second from the nose; nothing for what stands or walks."""
    if stands(agent):
        return
    way_m = agent.speed_mps * _TICK_S
    start_m = math.copysign(agent.length_m / 2.0, way_m)
    line = agent.pose.to_parent(np.array([[start_m, 0.0], [start_m + way_m, 0.0]]))
    if ground.camera.shows(line):
        ground.stroke(ground.px(line), style.fill, 2.5)
        _arrow_head(ground, ground.px(line), style.fill, 5.0)


def draw_walks(ground: Canvas, walkers: list[tuple[TrafficAgent, MarkStyle]]) -> None:
    """Draw dashed arrows to where walks end; those that lie on each other are moved apart.

    They cross what is parked in their way, so they have a rim that tells them from it.
    """
    drawn: list[FloatArray] = []
    for agent, style in walkers:
        if not is_walking(agent):
            continue
        line = ground.px(np.array([[agent.x_m, agent.y_m], agent.walk_to_m]))
        line = _move_apart(line, drawn)
        drawn.append(line)
        ground.draw_dashes(line, palette.PAPER, 5.5, 9.5, 3.5)
        ground.draw_dashes(line, style.fill, 2.5, 8.0, 5.0)
        _arrow_head(ground, line, palette.PAPER, 10.0)
        _arrow_head(ground, line, style.fill, 7.0)


def draw_trails(ground: Canvas, trails: Sequence[Trail]) -> None:
    """Draw ways, dashed where nobody sets out soon, and outlines every second that fade."""
    for trail in trails:
        line = ground.px(trail.way_m)
        if len(line) > 1 and trail.sets_out:
            ground.stroke(line, palette.TRAIL[2], 1.5)
        elif len(line) > 1:
            ground.draw_dashes(line, palette.TRAIL[0], 2.5, 9.0, 9.0)
    spots = [(number, spot) for trail in trails for number, spot in enumerate(trail.spots)]
    for number, spot in sorted(spots, key=lambda entry: -entry[0]):
        colour = palette.TRAIL[min(number, len(palette.TRAIL) - 1)]
        if spot.type is AgentType.PEDESTRIAN:
            radius_px = PERSON_PX / 2.0 - 3.0
            turns = np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False)
            ring = np.stack([np.cos(turns), np.sin(turns)], axis=1) * radius_px
            ground.stroke(ring + ground.at(spot.x_m, spot.y_m), colour, 2.0, closed=True)
            continue
        ground.stroke(ground.px(spot.box.corners_m), colour, 2.0, closed=True)
        half_m, side_m = spot.length_m / 2.0, 0.3 * spot.width_m
        tip = np.array([[half_m - side_m, side_m], [half_m, 0.0], [half_m - side_m, -side_m]])
        ground.stroke(ground.px(spot.pose.to_parent(tip)), colour, 2.0)


def draw_mark(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw one agent where it is; nothing for one that is out of the picture."""
    box = agent.box.corners_m
    if ground.camera.shows(box, margin_m=_LEAST_MARK_PX / ground.camera.px_per_m):
        _PAINTERS[agent.type](ground, agent, style)


def is_walking(agent: TrafficAgent) -> bool:
    """Return whether an arrow shows where its walk ends; one of no length is not drawn."""
    end = agent.walk_to_m
    return end is not None and math.dist((agent.x_m, agent.y_m), end) >= _LEAST_WALK_M


def stands(agent: TrafficAgent) -> bool:
    """Return whether no arrow shows a motion."""
    return agent.walk_to_m is not None or abs(agent.speed_mps) < _STANDING_MPS


# Private


def _move_apart(line: FloatArray, drawn: list[FloatArray]) -> FloatArray:
    """Return the line (2, 2), or beside its place where another one lies there already."""
    step = line[1] - line[0]
    along = step / max(float(np.hypot(*step)), 1e-9)
    across = np.array([-along[1], along[0]])
    for place in range(2 * len(drawn) + 1):
        # 0, then one to each side, then two.
        aside = (place + 1) // 2 * (1.0 if place % 2 else -1.0) * _WALK_GAP_PX
        moved = line + aside * across
        if not any(_covers(moved, other) for other in drawn):
            return moved
    return line


def _covers(one: FloatArray, other: FloatArray) -> bool:
    """Return whether two lines (2, 2) go the same or the opposite way, side by side, too near."""
    steps = [line[1] - line[0] for line in (one, other)]
    lengths = [max(float(np.hypot(*step)), 1e-9) for step in steps]
    along = steps[1] / lengths[1]
    if abs(float(steps[0] @ along)) < _WALK_TURN_COS * lengths[0]:
        return False
    # (2, 2): both ends along the other line and across it.
    away = (one - other[0]) @ np.array([along, [-along[1], along[0]]]).T
    (low, high), aside = np.sort(away[:, 0]), np.abs(away[:, 1])
    return bool(low < lengths[1] and high > 0.0 and aside.min() < 0.8 * _WALK_GAP_PX)


def _shape(ground: Canvas, agent: TrafficAgent, points_m: _Points, colour: Colour) -> None:
    """Fill a polygon in the agent's own frame: x ahead, y left."""
    ground.fill(ground.px(agent.pose.to_parent(np.array(points_m))), colour)


def _box(
    ground: Canvas,
    agent: TrafficAgent,
    style: MarkStyle,
    *,
    least_px: float = 4.0,
    outline_px: float | None = None,
    hatch: tuple[Colour | None, float, float, float] | None = None,
) -> float:
    """Draw the box with its outline inside and its hatching; return the outline's width in metres.

    Args:
        ground: What is drawn on.
        agent: Who.
        style: How.
        least_px: No side is shorter.
        outline_px: The width of the outline where it is not a part of the box's.
        hatch: Colour, slant, period and width of stripes, by default the style's.
    """
    scale = ground.camera.px_per_m
    length, width = (max(side, least_px / scale) for side in (agent.length_m, agent.width_m))
    edge = min(style.outline_px / scale, 0.2 * min(length, width))
    if outline_px is not None:
        edge = outline_px / scale
    inner = corners(agent.pose, length - 2.0 * edge, width - 2.0 * edge)
    ground.fill(ground.px(corners(agent.pose, length, width)), style.outline)
    ground.fill(ground.px(inner), style.fill)
    colour, slant, period_px, stripe_px = hatch or (style.hatch, math.pi / 4.0, 8.0, 1.6)
    if colour is not None:
        turn = agent.heading_rad + slant
        for stripe in stripes(inner, turn, period_px / scale, stripe_px / scale):
            ground.fill(ground.px(stripe), colour)
    return edge


def _vehicle(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    _box(ground, agent, style)
    _nose(ground, agent, style)


def _nose(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw the arrow head at the front: which way it faces.

    Longer than wide and notched behind, so that none of its corners passes for the tip.
    """
    half_m, width_m = agent.length_m / 2.0, agent.width_m
    depth_m = min(0.85 * width_m, 0.45 * agent.length_m)
    edge_m = 2.0 / ground.camera.px_per_m
    for rim_m, colour in ((edge_m, style.outline), (0.0, style.detail)):
        tip_m = min(half_m - 0.1 * width_m + 1.5 * rim_m, half_m)
        base_m = half_m - 0.1 * width_m - depth_m - 0.8 * rim_m
        side_m, notch_m = 0.34 * width_m + rim_m, base_m + 0.34 * depth_m - 0.4 * rim_m
        head = [(tip_m, 0.0), (base_m, side_m), (notch_m, 0.0), (base_m, -side_m)]
        _shape(ground, agent, head, colour)


def _bus(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw a vehicle with a band of windows along either side."""
    edge_m = _box(ground, agent, style)
    half_m, inner_m = agent.length_m / 2.0 - edge_m, agent.width_m / 2.0 - edge_m
    nose_m = min(0.85 * agent.width_m, 0.45 * agent.length_m)
    band_m, gap_m = 0.26 * inner_m, 0.12 * agent.width_m
    number = max(3, round((2.0 * half_m - nose_m) / (0.55 * agent.width_m)))
    ends_m = np.linspace(-half_m + gap_m, half_m - nose_m, number + 1)
    for side in (1.0, -1.0):
        outer, inner = side * (inner_m - 0.4 * gap_m), side * (inner_m - 0.4 * gap_m - band_m)
        for rear_m, front_m in zip(ends_m[:-1], ends_m[1:] - gap_m, strict=True):
            pane = [(rear_m, outer), (front_m, outer), (front_m, inner), (rear_m, inner)]
            _shape(ground, agent, pane, style.detail)
    _nose(ground, agent, style)


def _bicycle(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw a slim box with a pointed front."""
    scale = ground.camera.px_per_m
    half_m = max(agent.width_m, 8.0 / scale) / 2.0
    front_m = agent.length_m / 2.0
    for edge, colour in ((0.0, style.outline), (min(style.outline_px, 2.5) / scale, style.fill)):
        side, nose, rear = half_m - edge, front_m - 1.6 * edge, edge - front_m
        shape = [(rear, side), (front_m * 0.3, side), (nose, 0.0), (front_m * 0.3, -side)]
        _shape(ground, agent, [*shape, (rear, -side)], colour)
    rider = ground.at(agent.x_m, agent.y_m)
    ground.disc(rider, max(2.0, 0.22 * scale * half_m * 2.0), style.detail)


def _pedestrian(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw a drop: a circle with a beak where the person faces, and a light wedge in it."""
    scale = ground.camera.px_per_m
    radius_m = max(PERSON_PX / 2.0, max(agent.length_m, agent.width_m) / 2.0 * scale) / scale
    edge_m = min(style.outline_px, 2.5) / scale
    centre = ground.at(agent.x_m, agent.y_m)
    for inset_m, colour in ((0.0, style.outline), (edge_m, style.fill)):
        round_m = radius_m - inset_m
        tip_m = 1.62 * radius_m - 1.9 * inset_m
        # Where the tangents from the beak's tip touch the circle.
        touch_m, half_m = round_m**2 / tip_m, round_m * math.sqrt(1.0 - (round_m / tip_m) ** 2)
        beak = [(tip_m, 0.0), (touch_m, half_m), (touch_m, -half_m)]
        _shape(ground, agent, beak, colour)
        ground.disc(centre, round_m * scale, colour)
    wedge = np.array([[1.12, 0.0], [0.3, 0.52], [0.3, -0.52]]) * radius_m
    ground.fill(ground.px(agent.pose.to_parent(wedge)), style.detail)


def _upright(
    ground: Canvas, agent: TrafficAgent, style: MarkStyle, *, shape: _Points, least_px: float
) -> None:
    """Draw a shape about its middle (x right, y down), whatever the heading."""
    radius_px = max(least_px, max(agent.length_m, agent.width_m) / 2.0 * ground.camera.px_per_m)
    centre, points = np.array(ground.at(agent.x_m, agent.y_m)), np.array(shape)
    outline_px = min(style.outline_px, 2.0)
    ground.fill(centre + points * radius_px, style.outline)
    ground.fill(centre + points * (radius_px - 1.7 * outline_px), style.fill)


def _barrier(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw a bar with slanting stripes."""
    hatch = (palette.PAPER, math.pi / 3.0, 12.0, 5.0)
    edge_px = min(style.outline_px, 2.0)
    _box(ground, agent, style, least_px=7.0, outline_px=edge_px, hatch=hatch)


def _generic(ground: Canvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Draw a box with a cross."""
    _box(ground, agent, style, least_px=12.0)
    half = np.array([agent.length_m / 2.0, agent.width_m / 2.0])
    for points in ([(0.6, 0.6), (-0.6, -0.6)], [(0.6, -0.6), (-0.6, 0.6)]):
        line = ground.px(agent.pose.to_parent(np.array(points) * half))
        ground.stroke(line, style.detail, 2.0)


def _arrow_head(ground: Canvas, line: FloatArray, colour: Colour, size_px: float) -> None:
    """Draw a triangle at the end of a line (2, 2) in pixels."""
    start, end = line
    step = end - start
    along = step / max(float(np.hypot(*step)), 1e-9) * size_px
    across = np.array([-along[1], along[0]]) * 0.7
    ground.fill(np.array([end + along, end - along + across, end - along - across]), colour)


_TRIANGLE = ((0.0, -1.0), (0.95, 0.75), (-0.95, 0.75))
_DIAMOND = ((0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0))
_PAINTERS: dict[AgentType, Callable[[Canvas, TrafficAgent, MarkStyle], None]] = {
    AgentType.EGO_VEHICLE: _vehicle,
    AgentType.VEHICLE: _vehicle,
    AgentType.BUS: _bus,
    AgentType.BICYCLE: _bicycle,
    AgentType.PEDESTRIAN: _pedestrian,
    AgentType.TRAFFIC_CONE: partial(_upright, shape=_TRIANGLE, least_px=13.0),
    AgentType.BARRIER: _barrier,
    AgentType.CONSTRUCTION_SIGN: partial(_upright, shape=_DIAMOND, least_px=14.0),
    AgentType.GENERIC_OBJECT: _generic,
}
