"""The marks of road users and objects: shape and outline tell them apart, not colour alone.

Vehicles keep their true boxes; people, cones and signs have a least size in pixels, so that they
can be seen in every window.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from augment.geometry.frames import corners
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import MetricCanvas
from augment.render.palette import Colour, MarkStyle
from augment.render.shapes import stripes
from augment.scene.entities import AgentType, TrafficAgent

# A speed below which nothing is drawn as moving.
_STANDING_MPS = 0.3
_LEAST_WALK_M = 0.1
# More than the half size of any mark that is drawn larger than it is.
_LEAST_MARK_PX = 24.0
# The body of a person: on the smallest screen without scrolling, half as many.
PERSON_PX = 28.0
# Walks nearer to each other than this, and nearly as they go, are drawn side by side.
_WALK_GAP_PX = 9.0
_WALK_TURN_COS = 0.95
# The tick at the nose of what moves is the way of this time.
_TICK_S = 1.0

_Painter = Callable[[MetricCanvas, TrafficAgent, MarkStyle], None]


def draw_motion(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """From the nose as far as the agent gets in a second; nothing for what stands or walks."""
    if stands(agent):
        return
    way_m = agent.speed_mps * _TICK_S
    start_m = math.copysign(agent.length_m / 2.0, way_m)
    line = agent.pose.to_parent(np.array([[start_m, 0.0], [start_m + way_m, 0.0]]))
    if not ground.camera.shows(line):
        return
    ground.stroke(line, style.fill, 2.5)
    _arrow_head(ground, line, style.fill, 5.0)


def draw_walks(ground: MetricCanvas, walkers: list[tuple[TrafficAgent, MarkStyle]]) -> None:
    """Dashed arrows to where walks end; those that lie on each other are moved apart.

    They cross what is parked in their way, so they have a rim that tells them from it.
    """
    drawn: list[FloatArray] = []
    for agent, style in walkers:
        if not is_walking(agent):
            continue
        line = ground.camera.to_pixels(np.array([[agent.x_m, agent.y_m], agent.walk_to_m]))
        line = _moved_apart(line, drawn)
        drawn.append(line)
        ground.canvas.dashed(line, palette.PAPER, 5.5, 9.5, 3.5)
        ground.canvas.dashed(line, style.fill, 2.5, 8.0, 5.0)
        _arrow_head_px(ground, line, palette.PAPER, 10.0)
        _arrow_head_px(ground, line, style.fill, 7.0)


def _moved_apart(line_px: FloatArray, drawn: list[FloatArray]) -> FloatArray:
    """The line (2, 2), or beside its place where another one lies there already."""
    step = line_px[1] - line_px[0]
    along = step / max(float(np.hypot(*step)), 1e-9)
    across = np.array([-along[1], along[0]])
    for place in range(2 * len(drawn) + 1):
        # 0, then one to each side, then two.
        aside = (place + 1) // 2 * (1.0 if place % 2 else -1.0) * _WALK_GAP_PX
        moved = line_px + aside * across
        if not any(_covers(moved, other) for other in drawn):
            return moved
    return line_px


def _covers(one: FloatArray, other: FloatArray) -> bool:
    """Whether two lines (2, 2) go the same or the opposite way, side by side and too near."""
    steps = [line[1] - line[0] for line in (one, other)]
    lengths = [max(float(np.hypot(*step)), 1e-9) for step in steps]
    along = steps[1] / lengths[1]
    if abs(float(steps[0] @ along)) < _WALK_TURN_COS * lengths[0]:
        return False
    away = (one - other[0]) @ np.array([along, [-along[1], along[0]]]).T
    (low, high), aside = np.sort(away[:, 0]), np.abs(away[:, 1])
    return bool(low < lengths[1] and high > 0.0 and aside.min() < 0.8 * _WALK_GAP_PX)


def is_walking(agent: TrafficAgent) -> bool:
    """Whether an arrow shows where its walk ends; one of no length is not drawn."""
    end = agent.walk_to_m
    return end is not None and math.dist((agent.x_m, agent.y_m), end) >= _LEAST_WALK_M


def stands(agent: TrafficAgent) -> bool:
    """Whether no arrow shows a motion."""
    return agent.walk_to_m is not None or abs(agent.speed_mps) < _STANDING_MPS


def is_small(agent: TrafficAgent) -> bool:
    """Whether the mark lies above walks and vehicles, which would hide it."""
    return agent.type in _SMALL


def draw_mark(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """One agent where it is; nothing for one that is out of the picture."""
    box = agent.box.corners_m
    if not ground.camera.shows(box, margin_m=_LEAST_MARK_PX / ground.camera.px_per_m):
        return
    _PAINTERS[agent.type](ground, agent, style)


def _body(
    ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle, least_px: float = 4.0
) -> float:
    """The box with its outline inside and its hatching; returns the outline's width in metres."""
    scale = ground.camera.px_per_m
    length, width = (max(side, least_px / scale) for side in (agent.length_m, agent.width_m))
    edge = min(style.outline_px / scale, 0.2 * min(length, width))
    ground.fill(corners(agent.pose, length, width), style.outline)
    inner = corners(agent.pose, length - 2.0 * edge, width - 2.0 * edge)
    ground.fill(inner, style.fill)
    if style.hatch is not None:
        for stripe in stripes(inner, agent.heading_rad + math.pi / 4.0, 8.0 / scale, 1.6 / scale):
            ground.fill(stripe, style.hatch)
    return edge


def _part(
    ground: MetricCanvas, agent: TrafficAgent, points: list[tuple[float, float]]
) -> FloatArray:
    """Points in shares of half the box (front = 1, left = 1) as points of the ego frame."""
    half = np.array([agent.length_m / 2.0, agent.width_m / 2.0])
    return agent.pose.to_parent(np.array(points) * half)


def _vehicle(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    _body(ground, agent, style)
    _nose(ground, agent, style)


def _nose(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """The arrow head at the front: which way it faces.

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
        ground.fill(agent.pose.to_parent(np.array(head)), colour)


def _bus(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A vehicle with a band of windows along either side and a windscreen across its front."""
    edge_m = _body(ground, agent, style)
    half_m, inner_m = agent.length_m / 2.0 - edge_m, agent.width_m / 2.0 - edge_m
    nose_m = min(0.85 * agent.width_m, 0.45 * agent.length_m)
    band_m, gap_m = 0.26 * inner_m, 0.12 * agent.width_m
    number = max(3, round((2.0 * half_m - nose_m) / (0.55 * agent.width_m)))
    ends_m = np.linspace(-half_m + gap_m, half_m - nose_m, number + 1)
    for side in (1.0, -1.0):
        outer, inner = side * (inner_m - 0.4 * gap_m), side * (inner_m - 0.4 * gap_m - band_m)
        for rear_m, front_m in zip(ends_m[:-1], ends_m[1:] - gap_m, strict=True):
            pane = [(rear_m, outer), (front_m, outer), (front_m, inner), (rear_m, inner)]
            ground.fill(agent.pose.to_parent(np.array(pane)), style.detail)
    _nose(ground, agent, style)


def _bicycle(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A slim box with a pointed front."""
    scale = ground.camera.px_per_m
    half_m = max(agent.width_m, 8.0 / scale) / 2.0
    front_m = agent.length_m / 2.0
    for edge, colour in ((0.0, style.outline), (min(style.outline_px, 2.5) / scale, style.fill)):
        side, nose, rear = half_m - edge, front_m - 1.6 * edge, edge - front_m
        shape = [(rear, side), (front_m * 0.3, side), (nose, 0.0), (front_m * 0.3, -side)]
        ground.fill(agent.pose.to_parent(np.array([*shape, (rear, -side)])), colour)
    rider = ground.at(agent.x_m, agent.y_m)
    ground.canvas.disc(rider, max(2.0, 0.22 * scale * half_m * 2.0), style.detail)


def _pedestrian(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A drop: a circle with a beak where the person faces, and a light wedge in it."""
    scale = ground.camera.px_per_m
    radius_m = max(PERSON_PX / 2.0, max(agent.length_m, agent.width_m) / 2.0 * scale) / scale
    edge_m = min(style.outline_px, 2.5) / scale
    centre = ground.at(agent.x_m, agent.y_m)
    for inset_m, colour in ((0.0, style.outline), (edge_m, style.fill)):
        round_m = radius_m - inset_m
        tip_m = 1.62 * radius_m - 1.9 * inset_m
        # Where the tangents from the beak's tip touch the circle.
        touch_m, half_m = round_m**2 / tip_m, round_m * math.sqrt(1.0 - (round_m / tip_m) ** 2)
        beak = np.array([[tip_m, 0.0], [touch_m, half_m], [touch_m, -half_m]])
        ground.fill(agent.pose.to_parent(beak), colour)
        ground.canvas.disc(centre, round_m * scale, colour)
    wedge = np.array([[1.12, 0.0], [0.3, 0.52], [0.3, -0.52]]) * radius_m
    ground.fill(agent.pose.to_parent(wedge), style.detail)


def _cone(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """An upright triangle, whatever its heading."""
    _sign_shape(ground, agent, style, [(0.0, -1.0), (0.95, 0.75), (-0.95, 0.75)], least_px=13.0)


def _construction_sign(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A diamond."""
    diamond = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]
    _sign_shape(ground, agent, style, diamond, least_px=14.0)


def _sign_shape(
    ground: MetricCanvas,
    agent: TrafficAgent,
    style: MarkStyle,
    shape: list[tuple[float, float]],
    *,
    least_px: float,
) -> None:
    """A shape that stands upright in the picture, given about its middle (x right, y down)."""
    radius_px = max(least_px, max(agent.length_m, agent.width_m) / 2.0 * ground.camera.px_per_m)
    centre = np.array(ground.at(agent.x_m, agent.y_m))
    outline_px = min(style.outline_px, 2.0)
    points = np.array(shape)
    ground.canvas.fill(centre + points * radius_px, style.outline)
    ground.canvas.fill(centre + points * (radius_px - 1.7 * outline_px), style.fill)


def _barrier(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A bar with slanting stripes."""
    scale = ground.camera.px_per_m
    length, width = (max(side, 7.0 / scale) for side in (agent.length_m, agent.width_m))
    edge = min(style.outline_px, 2.0) / scale
    ground.fill(corners(agent.pose, length, width), style.outline)
    inner = corners(agent.pose, length - 2.0 * edge, width - 2.0 * edge)
    ground.fill(inner, style.fill)
    slant = agent.heading_rad + math.pi / 3.0
    for stripe in stripes(inner, slant, 12.0 / scale, 5.0 / scale):
        ground.fill(stripe, palette.PAPER)


def _generic(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A box with a cross."""
    _body(ground, agent, style, least_px=12.0)
    for points in ([(0.6, 0.6), (-0.6, -0.6)], [(0.6, -0.6), (-0.6, 0.6)]):
        ground.stroke(_part(ground, agent, points), style.detail, 2.0)


def _arrow_head(ground: MetricCanvas, line_m: FloatArray, colour: Colour, size_px: float) -> None:
    _arrow_head_px(ground, ground.camera.to_pixels(line_m), colour, size_px)


def _arrow_head_px(
    ground: MetricCanvas, line_px: FloatArray, colour: Colour, size_px: float
) -> None:
    """A triangle at the end of a line (2, 2) in pixels."""
    start, end = line_px
    step = end - start
    along = step / max(float(np.hypot(*step)), 1e-9) * size_px
    across = np.array([-along[1], along[0]]) * 0.7
    ground.canvas.fill(np.array([end + along, end - along + across, end - along - across]), colour)


_PAINTERS: dict[AgentType, _Painter] = {
    AgentType.EGO_VEHICLE: _vehicle,
    AgentType.VEHICLE: _vehicle,
    AgentType.BUS: _bus,
    AgentType.BICYCLE: _bicycle,
    AgentType.PEDESTRIAN: _pedestrian,
    AgentType.TRAFFIC_CONE: _cone,
    AgentType.BARRIER: _barrier,
    AgentType.CONSTRUCTION_SIGN: _construction_sign,
    AgentType.GENERIC_OBJECT: _generic,
}

_SMALL = frozenset(
    {
        *(AgentType.PEDESTRIAN, AgentType.BICYCLE, AgentType.TRAFFIC_CONE),
        *(AgentType.CONSTRUCTION_SIGN, AgentType.BARRIER),
    }
)
