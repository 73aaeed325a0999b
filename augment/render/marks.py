"""The marks of road users and objects: shape and outline tell them apart, not colour alone.

Vehicles keep their true boxes; people, cones and signs have a least size in pixels, so that they
can be seen in every window.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from augment.geometry.boxes import corners
from augment.geometry.polyline import FloatArray
from augment.render.canvas import MetricCanvas
from augment.render.palette import MarkStyle
from augment.render.shapes import stripes
from augment.scene.entities import AgentType, TrafficAgent

# A speed below which nothing is drawn as moving.
_STANDING_MPS = 0.3
_LEAST_WALK_M = 0.1
# More than the half size of any mark that is drawn larger than it is.
_LEAST_MARK_PX = 16.0
# The tick at the nose of what moves is the way of this time.
_TICK_S = 1.0

_Painter = Callable[[MetricCanvas, TrafficAgent, MarkStyle], None]


def draw_way(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """Where one agent is going: its walk if it has one, else its motion."""
    if agent.walk_to_m is not None:
        _walk(ground, agent, style)
    else:
        _motion(ground, agent, style)


def is_walking(agent: TrafficAgent) -> bool:
    """Whether an arrow shows where its walk ends; one of no length is not drawn."""
    end = agent.walk_to_m
    return end is not None and math.dist((agent.x_m, agent.y_m), end) >= _LEAST_WALK_M


def stands(agent: TrafficAgent) -> bool:
    """Whether no arrow shows a motion."""
    return agent.walk_to_m is not None or abs(agent.speed_mps) < _STANDING_MPS


def draw_mark(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """One agent where it is; nothing for one that is out of the picture."""
    box = corners(agent.pose, agent.length_m, agent.width_m)
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
    if style.hatch is None and style.detail == style.outline:
        ground.fill(
            _part(ground, agent, [(0.5, 0.72), (0.5, -0.72), (0.2, -0.6), (0.2, 0.6)]),
            style.detail,
        )
    else:
        _nose(ground, agent, style)


def _nose(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """The triangle at the front: which way it faces."""
    ground.fill(_part(ground, agent, [(0.34, 0.66), (0.34, -0.66), (0.86, 0.0)]), style.outline)
    ground.fill(_part(ground, agent, [(0.40, 0.46), (0.40, -0.46), (0.76, 0.0)]), style.detail)


def _bus(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A vehicle with two hatches on its roof."""
    _vehicle(ground, agent, style)
    for rear in (-0.8, -0.35):
        front, side = rear + 0.3, 0.5
        roof = _part(ground, agent, [(rear, side), (front, side), (front, -side), (rear, -side)])
        ground.fill(roof, style.fill)
        ground.stroke(roof, style.outline, 1.8, closed=True)


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
    """A circle with a tick where the person faces."""
    scale = ground.camera.px_per_m
    radius_px = max(7.0, max(agent.length_m, agent.width_m) / 2.0 * scale)
    reach_m = 1.75 * radius_px / scale
    tick = agent.pose.to_parent(np.array([[0.0, 0.0], [reach_m, 0.0]]))
    ground.stroke(tick, style.outline, 3.0)
    ground.canvas.disc(
        ground.at(agent.x_m, agent.y_m),
        radius_px,
        style.fill,
        outline=style.outline,
        outline_px=min(style.outline_px, 2.5),
    )


def _cone(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """An upright triangle, whatever its heading."""
    _sign_shape(ground, agent, style, [(0.0, -1.0), (0.95, 0.75), (-0.95, 0.75)], least_px=9.5)


def _construction_sign(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A diamond."""
    diamond = [(0.0, -1.0), (1.0, 0.0), (0.0, 1.0), (-1.0, 0.0)]
    _sign_shape(ground, agent, style, diamond, least_px=10.0)


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
    white = (255, 255, 255)
    slant = agent.heading_rad + math.pi / 3.0
    for stripe in stripes(inner, slant, 12.0 / scale, 5.0 / scale):
        ground.fill(stripe, white)


def _generic(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A box with a cross."""
    _body(ground, agent, style, least_px=12.0)
    for points in ([(0.6, 0.6), (-0.6, -0.6)], [(0.6, -0.6), (-0.6, 0.6)]):
        ground.stroke(_part(ground, agent, points), style.detail, 2.0)


def _motion(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """From the nose as far as the agent gets in a second; nothing for what stands."""
    if stands(agent):
        return
    way_m = agent.speed_mps * _TICK_S
    start_m = math.copysign(agent.length_m / 2.0, way_m)
    line = agent.pose.to_parent(np.array([[start_m, 0.0], [start_m + way_m, 0.0]]))
    ground.stroke(line, style.fill, 2.5)
    _arrow_head(ground, line, style, 5.0)


def _walk(ground: MetricCanvas, agent: TrafficAgent, style: MarkStyle) -> None:
    """A dashed arrow to where a walk ends."""
    if not is_walking(agent):
        return
    line = np.array([[agent.x_m, agent.y_m], agent.walk_to_m], dtype=np.float64)
    ground.canvas.dashed(ground.camera.to_pixels(line), style.fill, 2.5, 8.0, 5.0)
    _arrow_head(ground, line, style, 7.0)


def _arrow_head(
    ground: MetricCanvas, line_m: FloatArray, style: MarkStyle, size_px: float
) -> None:
    start, end = ground.camera.to_pixels(line_m)
    step = end - start
    along = step / max(float(np.hypot(*step)), 1e-9) * size_px
    across = np.array([-along[1], along[0]]) * 0.7
    ground.canvas.fill(
        np.array([end + along, end - along + across, end - along - across]), style.fill
    )


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
