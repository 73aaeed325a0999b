"""Which kinds of marks a voting picture holds, by the names of its legend's entries."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render.marks import is_walking, stands
from augment.render.road import own_lanes
from augment.render.shapes import resample_line
from augment.scene.entities import (
    AgentType,
    AreaKind,
    Modification,
    Scene,
    TrafficAgent,
    TrafficLight,
)

_KINDS = {
    AgentType.BUS: "bus",
    AgentType.BICYCLE: "bicycle",
    AgentType.PEDESTRIAN: "person",
    AgentType.TRAFFIC_CONE: "cone",
    AgentType.BARRIER: "barrier",
    AgentType.CONSTRUCTION_SIGN: "sign",
    AgentType.GENERIC_OBJECT: "object",
}
_AREAS = {AreaKind.CROSSWALK: "crosswalk", AreaKind.WALKWAY: "walkway"}
_STEP_M = 4.0
_DARK = (TrafficLight.NONE, TrafficLight.UNKNOWN)


def scene_keys(scene: Scene, view: Mapping[str, Any]) -> set[str]:
    """Return the entries for what a picture shows before any change.

    Args:
        scene: With the traffic that contestants see.
        view: Where metres lie in the picture: px_per_m, ego_px, width, height.
    """
    keys = {"ego", "grid"}
    shown = [agent for agent in scene.agents if _is_inside([(agent.x_m, agent.y_m)], view)]
    if shown:
        keys.add("recorded")
    for agent in (scene.ego, *shown):
        keys |= set(_agent_keys(agent))
    if scene.options.goal is not None:
        keys.add("goal")
    return keys | _map_keys(scene, view)


def change_keys(change: Modification, view: Mapping[str, Any]) -> set[str]:
    """Return the entries for what a change adds to a picture."""
    keys: set[str] = set()
    for agent in change.changed:
        if _is_inside([(agent.x_m, agent.y_m)], view):
            keys |= {"changed", *_agent_keys(agent)}
        else:
            keys.add("outside")
    return keys


# Private


def _map_keys(scene: Scene, view: Mapping[str, Any]) -> set[str]:
    keys: set[str] = set()
    own = own_lanes(scene)
    for lane in scene.lanes:
        if _is_inside(lane.centerline.points_m, view):
            keys.add("own" if lane.id in own else "other")
    for connector in scene.connectors:
        if _is_inside(connector.centerline.points_m, view):
            keys.add("junction")
            if connector.traffic_light not in _DARK:
                keys.add("lights")
    for area in scene.areas:
        if area.kind in _AREAS and _is_inside(area.boundary_m, view):
            keys.add(_AREAS[area.kind])
    return keys


def _agent_keys(agent: TrafficAgent) -> Iterator[str]:
    if agent.type in _KINDS:
        yield _KINDS[agent.type]
    if is_walking(agent):
        yield "walk"
    elif not stands(agent):
        yield "motion"


def _is_inside(
    points_m: FloatArray | Iterable[tuple[float, float]], view: Mapping[str, Any]
) -> bool:
    """Whether any of some points lies in the picture."""
    points = np.asarray(points_m, dtype=np.float64)
    if len(points) > 1:
        points = resample_line(points, _STEP_M)
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    x, y = ego_x + points[:, 0] * scale, ego_y - points[:, 1] * scale
    inside = (x >= 0.0) & (x <= view["width"]) & (y >= 0.0) & (y <= view["height"])
    return bool(inside.any())
