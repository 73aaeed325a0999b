"""The bird's-eye view: one renderer for every picture of a scene, whoever changed it.

In: a `Scene`, a `Modification` (an empty one draws the scene as it is) and a `Camera`. Out: the
bytes of a PNG.

A voting picture carries no text but its scale and the distances at its edge, and its bytes depend
on the scene, the change and the camera alone.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, Canvas, MetricCanvas, stack_png, text_width_px
from augment.render.labels import (
    draw_badges,
    draw_ghosts,
    draw_labels,
    mark_box,
    outside,
    overlap,
    place_badges,
    within,
)
from augment.render.legend import draw_legend
from augment.render.marks import draw_mark, draw_motion, draw_walks, is_small
from augment.render.palette import MarkStyle
from augment.render.road import (
    Corner,
    beyond_road,
    draw_goal,
    draw_grid,
    draw_ground,
    draw_scale,
    draw_signals,
    scale_box,
    scale_corner,
)
from augment.render.shapes import sides
from augment.scene.entities import (
    AgentType,
    LaneConnector,
    Modification,
    Point,
    Scene,
    TrafficAgent,
    apply,
)
from augment.scene.lane_graph import AnyLane


def draw(
    scene: Scene, modification: Modification, camera: Camera, *, labels: bool = False
) -> bytes:
    """The scene after a change, as the bytes of a PNG.

    Args:
        scene: The scene before the change.
        modification: What changes; removed agents are gone, added and moved ones are marked.
        camera: The window that all pictures of a scenario share (`camera_for`).
        labels: Whether ids, metres and faint outlines of what is gone are drawn, for reviewers
            and analysts, never for a vote; such a picture has half as many pixels each way.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    ground, taken = paint_scene(scene, modification, camera, ghosts=labels)
    if labels:
        draw_labels(ground, apply(scene, modification), taken=taken)
    return ground.canvas.png(halved=labels)


def paint_scene(
    scene: Scene, modification: Modification, camera: Camera, *, ghosts: bool = True
) -> tuple[MetricCanvas, list[Box]]:
    """All of a picture but its labels, and the boxes in pixels that text keeps free of.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    after = apply(scene, modification)
    changed = {agent.id for agent in modification.changed}
    rest = replace(after, agents=tuple(one for one in after.agents if one.id not in changed))
    # The scale keeps away from who was there before the change, the same for every contestant.
    corner = scale_corner(scene, camera)
    ground = _unchanged(rest, camera, corner).copy()
    if ghosts:
        draw_ghosts(ground, scene, modification)
    _paint(ground, [(agent, palette.CHANGED_MARK) for agent in modification.changed])
    lost = [agent for agent in modification.changed if outside(ground, agent)]
    seen = [agent for agent in (after.ego, *modification.changed) if agent not in lost]
    scale_px = scale_box(camera, corner)
    badges = place_badges(ground, lost, seen, taken=(scale_px,))
    draw_badges(ground, badges)
    return ground, [scale_px, *(badge.box_px for badge in badges)]


@lru_cache(maxsize=4)
def _unchanged(rest: Scene, camera: Camera, corner: Corner) -> MetricCanvas:
    """Everything that a change leaves as it is; nobody draws on it, only on copies."""
    ground = _flat(replace(rest, agents=()), camera).copy()
    draw_goal(ground, rest)
    draw_signals(ground, rest)
    draw_scale(ground, scale_box(camera, corner))
    traffic = [(agent, palette.OTHER_MARK) for agent in rest.agents]
    _paint(ground, [*traffic, (rest.ego, palette.EGO_MARK)])
    return ground


@lru_cache(maxsize=4)
def _flat(scene: Scene, camera: Camera) -> MetricCanvas:
    """All that lies flat under the traffic; nobody draws on it, only on copies.

    A job runs the contestants of a scenario one after the other; each of these holds 4 MB.
    """
    ground = MetricCanvas(Canvas(camera.width_px, camera.height_px, beyond_road(scene)), camera)
    draw_ground(ground, scene)
    draw_grid(ground)
    return ground


def _paint(ground: MetricCanvas, styled: list[tuple[TrafficAgent, MarkStyle]]) -> None:
    """Motions, then vehicles, then walks, which cross what is parked, then people and cones.

    The ego comes after the traffic; of the rest the large come first, so that nothing small is
    hidden.
    """
    ordered = sorted(styled, key=lambda one: _small_last(one[0]))
    for agent, style in ordered:
        draw_motion(ground, agent, style)
    for agent, style in ordered:
        if not is_small(agent):
            draw_mark(ground, agent, style)
    draw_walks(ground, ordered)
    for agent, style in ordered:
        if is_small(agent):
            draw_mark(ground, agent, style)


def _small_last(agent: TrafficAgent) -> tuple[bool, float, str]:
    return agent.type is AgentType.EGO_VEHICLE, -agent.length_m * agent.width_m, agent.id


NEAR_M = 8.0
"""Lanes this near to something changed are named, and lie over the boxes."""
SMALL_PX = 60.0
"""What is shorter than this in the picture is shown enlarged, too: a car at 12 px/m."""

_LEAST_GAIN = 1.4
_AROUND_M = 7.0
_LEAST_WIDTH_M = 20.0


def draw_for_review(scene: Scene, modification: Modification, camera: Camera) -> tuple[bytes, ...]:
    """One picture as a PNG, or two where the change is small in the first.

    Args:
        scene: The scene before the change, under the ids that the reviewer knows.
        modification: What is reviewed.
        camera: The window of the first picture.

    Raises:
        InvalidModification: The change does not fit the scene.
    """
    cameras = [camera]
    closer = _closer(modification, camera)
    if closer is not None:
        cameras.append(closer)
    return tuple(_drawn(scene, modification, one) for one in cameras)


def lanes_near(scene: Scene, agents: tuple[TrafficAgent, ...]) -> list[AnyLane]:
    """The lanes and connectors near one of the agents, the nearest first."""
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    near = []
    for lane in lanes:
        gap_m = min(
            (lane.centerline.project(one.x_m, one.y_m).distance_m for one in agents),
            default=np.inf,
        )
        if gap_m <= NEAR_M:
            near.append((gap_m, lane.id, lane))
    return [lane for _, _, lane in sorted(near, key=lambda one: one[:2])]


# Private


def _drawn(scene: Scene, modification: Modification, camera: Camera) -> bytes:
    ground, taken = paint_scene(scene, modification, camera)
    near = lanes_near(scene, modification.changed)
    for lane in near:
        _over_boxes(ground, scene, lane)
    # The scale stays readable; what crosses it is to be seen in the rest of the picture.
    draw_scale(ground, scale_box(camera, scale_corner(scene, camera)))
    draw_labels(
        ground,
        apply(scene, modification),
        taken=taken,
        first=tuple(agent.id for agent in modification.changed),
        named=tuple(lane.id for lane in near),
    )
    return stack_png(ground.canvas, draw_legend(scene, modification, camera.width_px))


def _over_boxes(ground: MetricCanvas, scene: Scene, lane: AnyLane) -> None:
    """The dashed centre once more, above what stands on it, and the edges of a connector."""
    if isinstance(lane, LaneConnector):
        colour = palette.CONNECTOR
        for side in sides(lane):
            ground.canvas.dashed(ground.camera.to_pixels(side), palette.INK, 1.2, 2.0, 4.0)
    else:
        colour = palette.OWN_LANE if lane.id == scene.ego.lane_id else palette.OTHER_LANE
    line = ground.camera.to_pixels(lane.centerline.points_m)
    ground.canvas.dashed(line, palette.PAPER, 3.6, 7.0, 8.0)
    ground.canvas.dashed(line, colour, 1.8, 7.0, 8.0)


def _closer(modification: Modification, camera: Camera) -> Camera | None:
    """A window around what was changed within the picture, None where nothing would be gained."""
    seen = [agent for agent in modification.changed if camera.shows(agent.box.corners_m)]
    if not seen:
        return None
    longest_px = min(max(agent.length_m, agent.width_m) for agent in seen) * camera.px_per_m
    if longest_px >= SMALL_PX:
        return None
    points = np.vstack([agent.box.corners_m for agent in seen])
    low, high = points.min(axis=0) - _AROUND_M, points.max(axis=0) + _AROUND_M
    shape = camera.width_px / camera.height_px
    width_m = max(high[0] - low[0], (high[1] - low[1]) * shape, _LEAST_WIDTH_M)
    if (camera.x_max_m - camera.x_min_m) / width_m < _LEAST_GAIN:
        return None
    x_m, y_m = (low + high) / 2.0
    return Camera(
        x_min_m=float(x_m - width_m / 2.0),
        x_max_m=float(x_m + width_m / 2.0),
        y_min_m=float(y_m - width_m / shape / 2.0),
        y_max_m=float(y_m + width_m / shape / 2.0),
        px_per_m=camera.width_px / width_m,
    )


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
