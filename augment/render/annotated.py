"""A picture with numbered marks at what the checks found: for analysts, never for a vote.

The numbers are those of the list beside the picture. A mark stands at its agents; a dashed line
leads to where what was asked for would be.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from augment.render import palette
from augment.render.bev import paint_scene
from augment.render.camera import Camera
from augment.render.canvas import Box, MetricCanvas, text_width_px
from augment.render.edges import mark_box, overlap, within
from augment.render.labels import draw_labels
from augment.scene.entities import Modification, Point, Scene, TrafficAgent, apply

_RADIUS_PX = 15.0
_GAP_PX = 3.0
_INSET_PX = 18.0
_MARGIN_PX = 5.0
_STAMP_PX = 30


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultMark:
    """A finding in the picture.

    Attributes:
        number: As in the list.
        agents: Ids of whom it is about; ids that are not in the scene are passed over.
        is_wrong: Whether it is wrong, not only doubtful.
        belongs_m: Where what was asked for would be, None for nowhere.
    """

    number: int
    agents: tuple[str, ...]
    is_wrong: bool
    belongs_m: Point | None = None


def draw_annotated(
    scene: Scene,
    modification: Modification,
    camera: Camera,
    marks: Sequence[FaultMark],
    *,
    stamp: str = "",
) -> bytes:
    """The scene after a change with the marks and everybody's id, as the bytes of a PNG.

    Args:
        scene: The scene before the change.
        modification: The change.
        camera: The window that all pictures of the scenario share.
        marks: What is marked.
        stamp: A word across the picture, such as what it must not be taken for.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    ground, taken = paint_scene(scene, modification, camera)
    after = apply(scene, modification)
    by_id = {agent.id: agent for agent in after.everyone}
    boxes = [mark_box(ground, agent) for agent in (after.ego, *modification.changed)]
    if stamp:
        _stamp(ground, stamp, taken)
    for mark in marks:
        marked = [by_id[name] for name in mark.agents if name in by_id]
        for agent in marked:
            _ring(ground, agent, _colour(mark))
        _place(ground, mark, marked, taken, boxes)
    draw_labels(ground, after, taken=taken)
    return ground.canvas.png(halved=True)


# Private


def _colour(mark: FaultMark) -> palette.Colour:
    return palette.WRONG if mark.is_wrong else palette.DOUBTFUL


def _place(
    ground: MetricCanvas,
    mark: FaultMark,
    agents: list[TrafficAgent],
    taken: list[Box],
    boxes: list[Box],
) -> None:
    """The number beside the first of the agents, else where something is missing."""
    colour = _colour(mark)
    belongs_px = None if mark.belongs_m is None else ground.at(*mark.belongs_m)
    if agents:
        anchor = _inside(ground, ground.at(agents[0].x_m, agents[0].y_m))
        if belongs_px is not None:
            line = np.array([ground.at(agents[0].x_m, agents[0].y_m), belongs_px])
            ground.canvas.dashed(line, colour, 2.5, 7.0, 5.0)
    elif belongs_px is not None:
        anchor = _inside(ground, belongs_px)
    else:
        anchor = (_INSET_PX, _INSET_PX + 24.0)
    if belongs_px is not None:
        _cross(ground, belongs_px, colour)
        taken.append(_box(belongs_px))
    spot = _free(ground, anchor, taken, boxes)
    if math.dist(spot, anchor) > 2.5 * _RADIUS_PX:
        ground.canvas.stroke(np.array([spot, anchor]), colour, 1.5)
    ground.canvas.disc(spot, _RADIUS_PX, colour, outline=palette.PAPER, outline_px=2.0)
    ground.canvas.text(spot, str(mark.number), palette.PAPER, 18)
    taken.append(_box(spot))


def _ring(ground: MetricCanvas, agent: TrafficAgent, colour: palette.Colour) -> None:
    left, top, right, bottom = mark_box(ground, agent)
    left, top, right, bottom = (
        *(value - _MARGIN_PX for value in (left, top)),
        *(value + _MARGIN_PX for value in (right, bottom)),
    )
    corners = np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
    ground.canvas.stroke(corners, colour, 2.0, closed=True)


def _cross(ground: MetricCanvas, at_px: tuple[float, float], colour: palette.Colour) -> None:
    x, y = at_px
    for dx, dy in ((7.0, 7.0), (7.0, -7.0)):
        line = np.array([[x - dx, y - dy], [x + dx, y + dy]])
        ground.canvas.stroke(line, palette.PAPER, 5.0)
        ground.canvas.stroke(line, colour, 2.5)


def _free(
    ground: MetricCanvas, anchor: tuple[float, float], taken: list[Box], boxes: list[Box]
) -> tuple[float, float]:
    """The nearest spot round the anchor that covers no number and no agent, else no number."""
    for blocked in (taken + boxes, taken):
        for spot in _spots(anchor):
            box = _box(spot)
            if within(ground, box) and not any(overlap(box, one, _GAP_PX) for one in blocked):
                return spot
    return anchor


def _spots(anchor: tuple[float, float]) -> Iterator[tuple[float, float]]:
    for ring in range(1, 14):
        for step in range(12):
            angle = -math.pi / 2.0 + 2.0 * math.pi * step / 12.0
            radius = 1.2 * _RADIUS_PX * ring
            yield anchor[0] + radius * math.cos(angle), anchor[1] + radius * math.sin(angle)


def _box(spot: tuple[float, float]) -> Box:
    x, y = spot
    return x - _RADIUS_PX, y - _RADIUS_PX, x + _RADIUS_PX, y + _RADIUS_PX


def _inside(ground: MetricCanvas, at_px: tuple[float, float]) -> tuple[float, float]:
    """The point, or the nearest of the picture where it lies outside."""
    width, height = ground.canvas.width_px, ground.canvas.height_px
    return (
        min(max(at_px[0], _INSET_PX), width - _INSET_PX),
        min(max(at_px[1], _INSET_PX), height - _INSET_PX),
    )


def _stamp(ground: MetricCanvas, word: str, taken: list[Box]) -> None:
    """The word in large letters, above and below what happens in the middle."""
    middle, height = ground.canvas.width_px / 2.0, ground.canvas.height_px
    half = text_width_px(word, _STAMP_PX) / 2.0 + _MARGIN_PX
    for y in (_STAMP_PX + 14.0, height - _STAMP_PX):
        at = (middle, y)
        ground.canvas.text(at, word, palette.STAMP, _STAMP_PX, halo=palette.HALO)
        taken.append((middle - half, y - _STAMP_PX / 2.0, middle + half, y + _STAMP_PX / 2.0))
