"""The legend of a picture: drawn for reviewers, and the names of its entries for the web."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from augment.geometry.frames import Pose
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Canvas, Spot, box_around, text_width_px
from augment.render.marks import draw_mark, draw_motion, draw_walks, is_walking, stands
from augment.render.palette import Colour, MarkStyle
from augment.render.road import own_lanes
from augment.render.shapes import resample_line
from augment.scene import entities
from augment.scene.entities import AgentType, AreaKind, Modification, Scene, TrafficAgent

_TEXT_PX = 14
_ROW_PX, _SAMPLE_PX, _GAP_PX, _MARGIN_PX = 36.0, 56.0, 18.0, 10.0
_PX_PER_M = 9.0
_STEP_M = 4.0

_NAMES = {
    AgentType.VEHICLE: "vehicle, true size",
    AgentType.BUS: "bus, true size",
    AgentType.BICYCLE: "bicycle, true size",
    AgentType.PEDESTRIAN: "pedestrian, beak where he faces, not to scale",
    AgentType.TRAFFIC_CONE: "cone, not to scale, no front",
    AgentType.BARRIER: "barrier",
    AgentType.CONSTRUCTION_SIGN: "sign, not to scale, front not shown",
    AgentType.GENERIC_OBJECT: "other object",
}
_AREAS = {
    AreaKind.WALKWAY: (palette.WALKWAY, "walkway"),
    AreaKind.CROSSWALK: (palette.ZEBRA_GROUND, "crosswalk (striped)"),
    AreaKind.CARPARK: (palette.CARPARK, "car park"),
    AreaKind.INTERSECTION: (palette.INTERSECTION, "intersection"),
}
_AGENT_KEYS = {
    AgentType.BUS: "bus",
    AgentType.BICYCLE: "bicycle",
    AgentType.PEDESTRIAN: "person",
    AgentType.TRAFFIC_CONE: "cone",
    AgentType.BARRIER: "barrier",
    AgentType.CONSTRUCTION_SIGN: "sign",
    AgentType.GENERIC_OBJECT: "object",
}
_AREA_KEYS = {AreaKind.CROSSWALK: "crosswalk", AreaKind.WALKWAY: "walkway"}
_DARK = (entities.TrafficLight.NONE, entities.TrafficLight.UNKNOWN)

_Sample = Callable[[Canvas, Spot], None]
"""Draws a sample about a point in pixels."""


def draw_legend(scene: Scene, modification: Modification, width_px: int) -> Canvas:
    """Draw samples of all that is drawn of the changed scene, in rows as wide as the picture."""
    places: list[tuple[_Sample, str, Spot]] = []
    x_px, y_px = _MARGIN_PX, _MARGIN_PX + _ROW_PX / 2.0
    for sample, words in _entries(scene, modification):
        wide = _SAMPLE_PX + 6.0 + text_width_px(words, _TEXT_PX) + _GAP_PX
        if x_px + wide > width_px and x_px > _MARGIN_PX:
            x_px, y_px = _MARGIN_PX, y_px + _ROW_PX
        places.append((sample, words, (x_px, y_px)))
        x_px += wide
    height_m = (y_px + _ROW_PX / 2.0 + _MARGIN_PX) / _PX_PER_M
    camera = Camera.over((0.0, 0.0), (width_px / _PX_PER_M, height_m), _PX_PER_M)
    canvas = Canvas(camera, palette.PAPER)
    for sample, words, (left, middle) in places:
        x_m, y_m = (left + _SAMPLE_PX / 2.0) / _PX_PER_M, camera.y_max_m - middle / _PX_PER_M
        sample(canvas, (x_m, y_m))
        at = (left + _SAMPLE_PX + 6.0, middle)
        canvas.text(at, words, palette.INK, _TEXT_PX, anchor="lm")
    return canvas


def scene_keys(scene: Scene, view: Mapping[str, Any]) -> set[str]:
    """Return the entries of the web's legend for what a picture shows before any change.

    Args:
        scene: With the traffic that contestants see.
        view: Where metres lie in the picture: px_per_m, ego_px, width, height.
    """
    keys = {"ego", "grid"}
    shown = [agent for agent in scene.agents if _is_inside([(agent.x_m, agent.y_m)], view)]
    if shown:
        keys.add("recorded")
    for agent in (scene.ego, *shown):
        keys |= _agent_keys(agent)
    if scene.options.goal is not None:
        keys.add("goal")
    own = own_lanes(scene)
    for lane in scene.lanes:
        if _is_inside(lane.centerline.points_m, view):
            keys.add("own" if lane.id in own else "other")
    for connector in scene.connectors:
        if _is_inside(connector.centerline.points_m, view):
            keys |= {"junction"} if connector.traffic_light in _DARK else {"junction", "lights"}
    for area in scene.areas:
        if area.kind in _AREA_KEYS and _is_inside(area.boundary_m, view):
            keys.add(_AREA_KEYS[area.kind])
    return keys


def change_keys(change: Modification, view: Mapping[str, Any]) -> set[str]:
    """Return the entries for what a change adds to a picture."""
    keys: set[str] = set()
    for agent in change.changed:
        inside = _is_inside([(agent.x_m, agent.y_m)], view)
        keys |= {"changed"} | _agent_keys(agent) if inside else {"outside"}
    return keys


# --- The legend's entries ----------------------------------------------------------------------


def _entries(scene: Scene, modification: Modification) -> Iterator[tuple[_Sample, str]]:
    changed = {agent.id for agent in modification.changed}
    others = [agent for agent in scene.agents if agent.id not in changed]
    yield _agent(AgentType.EGO_VEHICLE, palette.EGO_MARK), "ego; arrow: front"
    groups = (
        ("changed: ", palette.CHANGED_MARK, modification.changed),
        ("other ", palette.OTHER_MARK, others),
    )
    for prefix, style, agents in groups:
        kinds = {agent.type for agent in agents}
        for kind in _NAMES:
            if kind in kinds:
                yield _agent(kind, style), prefix + _NAMES[kind]
    everyone = (scene.ego, *scene.agents, *modification.changed)
    if any(agent.walk_to_m is not None for agent in everyone):
        yield _walk, "to where a walk ends"
    if any(abs(agent.speed_mps) > 0.0 and agent.walk_to_m is None for agent in everyone):
        yield _motion, "way in one second"
    if modification.has_motion:
        yield _solid(palette.TRAIL[0]), "motion, an outline each second; dashed: not within 6 s"
    if modification.moved or modification.removed:
        yield _dashes(palette.GHOST, 5.0, 4.0), "where something was before"
    yield from _map_entries(scene)


def _map_entries(scene: Scene) -> Iterator[tuple[_Sample, str]]:
    yield _dashes(palette.OWN_LANE, 7.0, 8.0), "centre of the ego's lane"
    yield _dashes(palette.OTHER_LANE, 7.0, 8.0), "centre of another lane"
    if scene.connectors:
        yield _dashes(palette.CONNECTOR, 7.0, 8.0), "centre of a connector"
        yield _dashes(palette.INK, 2.0, 4.0), "edge of a connector at the edit"
    yield _solid(palette.LANE_SOLID), "edge of a lane or of the road"
    if any(lane.left_neighbor or lane.right_neighbor for lane in scene.lanes):
        yield _between, "between lanes of one direction"
    if any(connector.traffic_light not in _DARK for connector in scene.connectors):
        yield _solid(palette.LIGHT_RED), "bar in red, yellow or green: light"
    yield _patch(palette.ROAD), "road"
    area_kinds = {area.kind for area in scene.areas}
    for area_kind, (colour, words) in _AREAS.items():
        if area_kind in area_kinds:
            yield _patch(colour), words


def _agent(kind: AgentType, style: MarkStyle) -> _Sample:
    def draw(canvas: Canvas, at_m: Spot) -> None:
        pose = Pose(x_m=at_m[0], y_m=at_m[1], heading_rad=0.0)
        draw_mark(canvas, TrafficAgent.at(kind, pose), style)

    return draw


def _walk(canvas: Canvas, at_m: Spot) -> None:
    walker = replace(_make_mover(at_m), walk_to_m=(at_m[0] + 2.0, at_m[1]))
    draw_walks(canvas, [(walker, palette.CHANGED_MARK)])


def _motion(canvas: Canvas, at_m: Spot) -> None:
    draw_motion(canvas, _make_mover(at_m), palette.OTHER_MARK)


def _make_mover(at_m: Spot) -> TrafficAgent:
    pose = Pose(x_m=at_m[0] - 2.5, y_m=at_m[1], heading_rad=0.0)
    return TrafficAgent.at(AgentType.PEDESTRIAN, pose, speed_mps=4.0)


def _line_px(canvas: Canvas, at_m: Spot, half_px: float = 24.0) -> FloatArray:
    x, y = canvas.at(*at_m)
    return np.array([[x - half_px, y], [x + half_px, y]])


def _dashes(colour: Colour, on_px: float, off_px: float) -> _Sample:
    return lambda canvas, at_m: canvas.draw_dashes(
        _line_px(canvas, at_m), colour, 1.6, on_px, off_px
    )


def _solid(colour: Colour) -> _Sample:
    return lambda canvas, at_m: canvas.stroke(_line_px(canvas, at_m), colour, 2.0)


def _patch(colour: Colour) -> _Sample:
    return lambda canvas, at_m: canvas.plate(
        box_around(canvas.at(*at_m), 18.0, 9.0), colour, palette.ROAD_EDGE, 2.0
    )


def _between(canvas: Canvas, at_m: Spot) -> None:
    _patch(palette.ROAD)(canvas, at_m)
    canvas.draw_dashes(_line_px(canvas, at_m, 16.0), palette.LANE_LINE, 3.0, 8.0, 6.0)


# --- Keys ----------------------------------------------------------------------------


def _agent_keys(agent: TrafficAgent) -> set[str]:
    keys = {_AGENT_KEYS[agent.type]} if agent.type in _AGENT_KEYS else set()
    if is_walking(agent):
        keys.add("walk")
    elif not stands(agent):
        keys.add("motion")
    if agent.motion is not None:
        keys.add("trail")
    return keys


def _is_inside(points_m: FloatArray | Iterable[entities.Point], view: Mapping[str, Any]) -> bool:
    """Return whether any point of a line lies in the picture."""
    points = np.asarray(points_m, dtype=np.float64)
    if len(points) > 1:
        # Every 4 m: a line may cross the picture between two of its points.
        points = resample_line(points, _STEP_M)
    (ego_x, ego_y), scale = view["ego_px"], view["px_per_m"]
    x, y = ego_x + points[:, 0] * scale, ego_y - points[:, 1] * scale
    inside = (x >= 0.0) & (x <= view["width"]) & (y >= 0.0) & (y <= view["height"])
    return bool(inside.any())
