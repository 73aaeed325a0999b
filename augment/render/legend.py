"""What the marks of a reviewers' picture mean: a strip of samples with words, beneath it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from augment.geometry.frames import wrap
from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Canvas, MetricCanvas, text_width_px
from augment.render.marks import draw_mark, draw_motion, draw_walks, is_walking, stands
from augment.render.palette import Colour, MarkStyle
from augment.render.road import own_lanes
from augment.render.shapes import resample_line
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    AreaKind,
    Modification,
    Point,
    Scene,
    TrafficAgent,
    TrafficLight,
)

_TEXT_PX = 14
_ROW_PX, _SAMPLE_PX, _GAP_PX, _MARGIN_PX = 36.0, 56.0, 18.0, 10.0
_PX_PER_M = 9.0

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

_Sample = Callable[[MetricCanvas, float, float], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Entry:
    """A sample, drawn about a point in metres, and what it is."""

    draw: _Sample
    words: str


def draw_legend(scene: Scene, modification: Modification, width_px: int) -> Canvas:
    """The samples of all that is drawn of the changed scene, in rows as wide as the picture."""
    places, height_px = _places(list(_entries(scene, modification)), width_px)
    camera = Camera(
        x_min_m=0.0,
        x_max_m=width_px / _PX_PER_M,
        y_min_m=0.0,
        y_max_m=height_px / _PX_PER_M,
        px_per_m=_PX_PER_M,
    )
    canvas = Canvas(width_px, camera.height_px, palette.PAPER)
    ground = MetricCanvas(canvas, camera)
    for entry, x_px, y_px in places:
        middle_px = x_px + _SAMPLE_PX / 2.0
        entry.draw(ground, middle_px / _PX_PER_M, camera.y_max_m - y_px / _PX_PER_M)
        at = (x_px + _SAMPLE_PX + 6.0, y_px)
        canvas.text(at, entry.words, palette.INK, _TEXT_PX, anchor="lm")
    return canvas


# Private


def _places(
    entries: list[_Entry], width_px: int
) -> tuple[list[tuple[_Entry, float, float]], float]:
    """Where each entry begins and its row lies, in pixels, and how high all rows are."""
    places, x_px, y_px = [], _MARGIN_PX, _MARGIN_PX + _ROW_PX / 2.0
    for entry in entries:
        wide = _SAMPLE_PX + 6.0 + text_width_px(entry.words, _TEXT_PX) + _GAP_PX
        if x_px + wide > width_px and x_px > _MARGIN_PX:
            x_px, y_px = _MARGIN_PX, y_px + _ROW_PX
        places.append((entry, x_px, y_px))
        x_px += wide
    return places, y_px + _ROW_PX / 2.0 + _MARGIN_PX


def _entries(scene: Scene, modification: Modification) -> Iterator[_Entry]:
    changed = {agent.id for agent in modification.changed}
    yield _Entry(draw=_agent(AgentType.EGO_VEHICLE, palette.EGO_MARK), words="ego; arrow: front")
    groups = (
        ("changed: ", palette.CHANGED_MARK, modification.changed),
        ("other ", palette.OTHER_MARK, [a for a in scene.agents if a.id not in changed]),
    )
    for prefix, style, agents in groups:
        for kind in _NAMES:
            if any(agent.type is kind for agent in agents):
                yield _Entry(draw=_agent(kind, style), words=prefix + _NAMES[kind])
    everyone = (scene.ego, *scene.agents, *modification.changed)
    if any(agent.walk_to_m is not None for agent in everyone):
        yield _Entry(draw=_walk, words="to where a walk ends")
    if any(abs(agent.speed_mps) > 0.0 and agent.walk_to_m is None for agent in everyone):
        yield _Entry(draw=_motion, words="way in one second")
    if modification.moved or modification.removed:
        yield _Entry(draw=_dashes(palette.GHOST, 5.0, 4.0), words="where something was before")
    yield from _map_entries(scene)


def _map_entries(scene: Scene) -> Iterator[_Entry]:
    yield _Entry(draw=_dashes(palette.OWN_LANE, 7.0, 8.0), words="centre of the ego's lane")
    yield _Entry(draw=_dashes(palette.OTHER_LANE, 7.0, 8.0), words="centre of another lane")
    if scene.connectors:
        yield _Entry(draw=_dashes(palette.CONNECTOR, 7.0, 8.0), words="centre of a connector")
        yield _Entry(draw=_dashes(palette.INK, 2.0, 4.0), words="edge of a connector at the edit")
    yield _Entry(draw=_solid(palette.LANE_SOLID), words="edge of a lane or of the road")
    if any(lane.left_neighbor or lane.right_neighbor for lane in scene.lanes):
        yield _Entry(draw=_between, words="between lanes of one direction")
    dark = TrafficLight.NONE, TrafficLight.UNKNOWN
    if any(one.traffic_light not in dark for one in scene.connectors):
        yield _Entry(draw=_solid(palette.LIGHT_RED), words="bar in red, yellow or green: light")
    yield _Entry(draw=_patch(palette.ROAD), words="road")
    kinds = {area.kind for area in scene.areas}
    for area_kind, (colour, words) in _AREAS.items():
        if area_kind in kinds:
            yield _Entry(draw=_patch(colour), words=words)


def _agent(kind: AgentType, style: MarkStyle) -> _Sample:
    length_m, width_m = LENGTH_WIDTH_M[kind]

    def draw(ground: MetricCanvas, x_m: float, y_m: float) -> None:
        sample = TrafficAgent(
            id="", type=kind, x_m=x_m, y_m=y_m, heading_rad=0.0, width_m=width_m, length_m=length_m
        )
        draw_mark(ground, sample, style)

    return draw


def _walk(ground: MetricCanvas, x_m: float, y_m: float) -> None:
    draw_walks(ground, [(_mover(x_m, y_m, walk=True), palette.CHANGED_MARK)])


def _motion(ground: MetricCanvas, x_m: float, y_m: float) -> None:
    draw_motion(ground, _mover(x_m, y_m, walk=False), palette.OTHER_MARK)


def _mover(x_m: float, y_m: float, *, walk: bool) -> TrafficAgent:
    return TrafficAgent(
        id="",
        type=AgentType.PEDESTRIAN,
        x_m=x_m - 2.5,
        y_m=y_m,
        heading_rad=0.0,
        width_m=0.8,
        length_m=0.9,
        speed_mps=4.0,
        walk_to_m=(x_m + 2.0, y_m) if walk else None,
    )


def _dashes(colour: Colour, on_px: float, off_px: float) -> _Sample:
    def draw(ground: MetricCanvas, x_m: float, y_m: float) -> None:
        ground.canvas.dashed(_line_px(ground, x_m, y_m), colour, 1.6, on_px, off_px)

    return draw


def _solid(colour: Colour) -> _Sample:
    def draw(ground: MetricCanvas, x_m: float, y_m: float) -> None:
        ground.canvas.stroke(_line_px(ground, x_m, y_m), colour, 2.0)

    return draw


def _between(ground: MetricCanvas, x_m: float, y_m: float) -> None:
    _patch(palette.ROAD)(ground, x_m, y_m)
    x, y = ground.at(x_m, y_m)
    ground.canvas.dashed(
        np.array([[x - 16.0, y], [x + 16.0, y]]), palette.LANE_LINE, 3.0, 8.0, 6.0
    )


def _patch(colour: Colour) -> _Sample:
    def draw(ground: MetricCanvas, x_m: float, y_m: float) -> None:
        x, y = ground.at(x_m, y_m)
        ground.canvas.plate((x - 18.0, y - 9.0, x + 18.0, y + 9.0), colour, palette.ROAD_EDGE, 2.0)

    return draw


def _line_px(ground: MetricCanvas, x_m: float, y_m: float) -> FloatArray:
    x, y = ground.at(x_m, y_m)
    return np.array([[x - 24.0, y], [x + 24.0, y]])


_KINDS = {
    AgentType.BUS: "bus",
    AgentType.BICYCLE: "bicycle",
    AgentType.PEDESTRIAN: "person",
    AgentType.TRAFFIC_CONE: "cone",
    AgentType.BARRIER: "barrier",
    AgentType.CONSTRUCTION_SIGN: "sign",
    AgentType.GENERIC_OBJECT: "object",
}
_AREAS_legend_keys = {AreaKind.CROSSWALK: "crosswalk", AreaKind.WALKWAY: "walkway"}
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
        if area.kind in _AREAS_legend_keys and _is_inside(area.boundary_m, view):
            keys.add(_AREAS_legend_keys[area.kind])
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


CHANGED, GONE = "changed", "gone"

STEP_DEG = 5
"""Headings are told in these steps: finer ones can't be seen, and would be a handwriting."""

_UPRIGHT = {AgentType.TRAFFIC_CONE, AgentType.CONSTRUCTION_SIGN}
"""Drawn upright whatever their heading."""

_SYMMETRIC = {AgentType.BARRIER, AgentType.GENERIC_OBJECT}
"""Drawn alike from either end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedAgent:
    """One agent of the list.

    Frame: ego frame, metres ahead of the ego's centre and to its left.

    Attributes:
        change: `CHANGED` or `GONE`.
        kind: The value of an `AgentType`.
        heading_deg: To the left of the ego's, in (-180, 180]; None where its mark shows none.
        along_deg: How a thing without a front lies, in (-90, 90]; None for all others.
        speed_mps: 0 for a road user that stands; None for things that do, and for who walks.
        walk_to_m: Where a walk ends, ahead and left; None without a walk.
    """

    change: str
    kind: str
    ahead_m: float
    left_m: float
    heading_deg: int | None = None
    along_deg: int | None = None
    speed_mps: float | None = None
    walk_to_m: Point | None = None


def describe(scene: Scene, modification: Modification) -> list[DescribedAgent]:
    """What was changed, then what is gone, each the nearest first, then by kind.

    Args:
        scene: The scene before the change; ids that it does not have are passed over.
        modification: The change; the list of an empty one is empty.
    """
    left = {agent.id for agent in modification.moved} | set(modification.removed)
    lines = [_line(CHANGED, agent) for agent in modification.changed]
    lines += [_line(GONE, agent) for agent in scene.agents if agent.id in left]
    return sorted(lines, key=_place)


# Private


def _line(change: str, agent: TrafficAgent) -> DescribedAgent:
    walks, moves = is_walking(agent), not stands(agent)
    is_thing = agent.type in _UPRIGHT | _SYMMETRIC
    heading, along = None, None
    if moves or not is_thing:
        heading = _turn(agent.heading_rad)
    elif agent.type in _SYMMETRIC:
        along = _turn(math.remainder(agent.heading_rad, math.pi))
        along = 90 if along == -90 else along
    return DescribedAgent(
        change=change,
        kind=agent.type.value,
        ahead_m=_metres(agent.x_m),
        left_m=_metres(agent.y_m),
        heading_deg=heading,
        along_deg=along,
        speed_mps=None if walks or (is_thing and not moves) else _speed(agent),
        walk_to_m=_end(agent.walk_to_m) if walks else None,
    )


def _place(line: DescribedAgent) -> tuple[object, ...]:
    """Everything that a line says, so that two which differ never stand as they came."""
    distance_m = round(math.hypot(line.ahead_m, line.left_m), 3)
    walk = line.walk_to_m or ()
    rest = (line.heading_deg, line.along_deg, line.speed_mps)
    known = tuple((value is not None, value or 0) for value in rest)
    return (line.change, distance_m, line.kind, line.ahead_m, line.left_m, *known, walk)


def _end(point: Point | None) -> Point | None:
    return None if point is None else (_metres(point[0]), _metres(point[1]))


def _metres(value: float) -> float:
    return round(value, 1) + 0.0  # no minus before a zero


def _speed(agent: TrafficAgent) -> float:
    return 0.0 if stands(agent) else _metres(agent.speed_mps)


def _turn(angle_rad: float) -> int:
    degrees = STEP_DEG * round(math.degrees(wrap(angle_rad)) / STEP_DEG)
    return 180 if degrees == -180 else degrees
