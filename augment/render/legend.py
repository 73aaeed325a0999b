"""What the marks of a reviewers' picture mean: a strip of samples with words, beneath it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Canvas, MetricCanvas, text_width_px
from augment.render.marks import draw_mark, draw_motion, draw_walks
from augment.render.palette import Colour, MarkStyle
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    AreaKind,
    Modification,
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
