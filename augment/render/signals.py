"""Traffic lights: a bar across the start of the connectors that a light rules, and a small lamp.

The lamp's shape says the state as its colour does: red a square, yellow a diamond, green a
circle. A light of unknown state is not drawn: maps without lights say "unknown" everywhere.
"""

from __future__ import annotations

import math

import numpy as np

from augment.geometry.frames import Pose
from augment.render import palette
from augment.render.canvas import MetricCanvas
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import LaneConnector, Scene, TrafficLight, TurnType

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
