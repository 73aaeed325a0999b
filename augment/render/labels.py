"""Names and numbers inside a picture, for reviewers and analysts; never in a voting picture."""

from __future__ import annotations

import math

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import Box, MetricCanvas, text_width_px
from augment.render.edges import mark_box, overlap, within
from augment.render.scale import raster
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.lane_graph import AnyLane

_TEXT_PX = 14


def draw_ghosts(ground: MetricCanvas, scene: Scene, modification: Modification) -> None:
    """Faint dashed outlines where removed and moved agents were before the change."""
    gone = set(modification.removed) | {agent.id for agent in modification.moved}
    for agent in scene.agents:
        if agent.id in gone:
            box = agent.box.corners_m
            ring = ground.camera.to_pixels(np.vstack([box, box[:1]]))
            ground.canvas.dashed(ring, palette.GHOST, 1.5, 5.0, 4.0)


def draw_labels(
    ground: MetricCanvas,
    scene: Scene,
    taken: list[Box],
    *,
    first: tuple[str, ...] = (),
    named: tuple[str, ...] = (),
) -> None:
    """Ids beside agents and on lanes, metres along the upper and the left edge.

    Args:
        ground: What is drawn on.
        scene: The scene after the change.
        taken: Boxes in pixels that stay free of text.
        first: Ids of agents that must have a label, at the end of a thin line where there is no
            room beside them.
        named: Ids of lanes that must have one.
    """
    _metres(ground)
    everyone = sorted(scene.everyone, key=lambda agent: agent.id not in first)
    marks = [mark_box(ground, agent) for agent in everyone]
    words = list(taken)
    for agent, box in zip(everyone, marks, strict=True):
        if agent.id in first and _is_seen(ground, agent):
            _label_agent(ground, agent.id, box, words, marks)
    lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
    by_id = {lane.id: lane for lane in lanes}
    boxes = [mark_box(ground, agent) for agent in everyone if agent.id in first]
    for lane_id in named:
        line = by_id[lane_id].centerline.points_m
        spots = _near_first(_spots(ground, line, every_px=20.0), boxes)
        if not _label(ground, lane_id, palette.LANE_TEXT, spots, words, marks):
            _label(ground, lane_id, palette.LANE_TEXT, _aside(spots), words, [])
    for agent, (left, top, right, bottom) in zip(everyone, marks, strict=True):
        if agent.id in first:
            continue
        x, y = ground.at(agent.x_m, agent.y_m)
        aside = text_width_px(agent.id, _TEXT_PX) / 2.0 + 8.0
        spots = [(x, top - 12.0), (x, bottom + 12.0), (right + aside, y), (left - aside, y)]
        spots += [(right + aside, top - 12.0), (left - aside, bottom + 12.0), (x, top - 30.0)]
        if not _label(ground, agent.id, palette.INK, spots, words, marks):
            _label(ground, agent.id, palette.INK, [*spots, (x, y)], words, [])
    for lane in lanes:
        if lane.id in named:
            continue
        spots = _spots(ground, lane.centerline.points_m)
        _label(ground, lane.id, palette.LANE_TEXT, spots, words, marks)


def _metres(ground: MetricCanvas) -> None:
    camera = ground.camera
    for x_m in raster(camera.x_min_m, camera.x_max_m):
        x, _ = ground.at(x_m, 0.0)
        at = (x, 10.0)
        ground.canvas.text(at, f"{x_m:.0f}", palette.INK, 12, halo=palette.HALO)
    for y_m in raster(camera.y_min_m, camera.y_max_m):
        _, y = ground.at(0.0, y_m)
        # A dash of a lane beside the number would read as its minus sign.
        ground.canvas.plate((1.0, y - 8.0, 31.0, y + 8.0), palette.HALO, None, 3.0)
        ground.canvas.text((16.0, y), f"{y_m:.0f}", palette.INK, 12, halo=palette.HALO)


def _is_seen(ground: MetricCanvas, agent: TrafficAgent) -> bool:
    x, y = ground.at(agent.x_m, agent.y_m)
    return 0.0 <= x <= ground.canvas.width_px and 0.0 <= y <= ground.canvas.height_px


def _label_agent(
    ground: MetricCanvas, text: str, mark: Box, words: list[Box], marks: list[Box]
) -> None:
    """The id beside its mark, or in rings around it with a line that leads to it."""
    left, top, right, bottom = mark
    x, y = (left + right) / 2.0, (top + bottom) / 2.0
    half = text_width_px(text, _TEXT_PX) / 2.0
    beside = [
        (x, top - 18.0),
        (x, bottom + 18.0),
        (right + half + 12.0, y),
        (left - half - 12.0, y),
    ]
    if _label(ground, text, palette.INK, beside, words, marks):
        return
    reach = max(right - left, bottom - top) / 2.0 + half
    rings = [
        (x + (reach + 14.0 * ring) * math.cos(turn), y + (reach + 14.0 * ring) * math.sin(turn))
        for ring in range(1, 16)
        for turn in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False).tolist()
    ]
    if _label(ground, text, palette.INK, rings, words, marks) or _label(
        ground, text, palette.INK, rings, words, []
    ):
        at = words[-1]
        end = ((at[0] + at[2]) / 2.0, (at[1] + at[3]) / 2.0)
        ground.canvas.stroke(np.array([[x, y], end]), palette.INK, 1.0)


def _near_first(spots: list[tuple[float, float]], boxes: list[Box]) -> list[tuple[float, float]]:
    """The spots, those nearest to one of the boxes first."""
    centres = [((box[0] + box[2]) / 2.0, (box[1] + box[3]) / 2.0) for box in boxes]

    def gap(spot: tuple[float, float]) -> float:
        return min((math.dist(spot, centre) for centre in centres), default=0.0)

    return sorted(spots, key=gap)


def _aside(spots: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Places a little beside each spot, for a lane whose own places are all taken."""
    return [
        (x + dx, y + dy)
        for dx, dy in ((0.0, 0.0), (0.0, 16.0), (0.0, -16.0), (30.0, 16.0), (-30.0, -16.0))
        for x, y in spots
    ]


def _spots(
    ground: MetricCanvas, line_m: FloatArray, every_px: float = 40.0
) -> list[tuple[float, float]]:
    """Places on a line that are in the picture, the middle one first."""
    points = ground.camera.to_pixels(line_m)
    count = max(2, int(np.hypot(*np.diff(points, axis=0).T).sum() / every_px))
    steps = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.linspace(0.0, steps[-1], count + 1)
    x, y = np.interp(at, steps, points[:, 0]), np.interp(at, steps, points[:, 1])
    seen = [
        (float(px), float(py))
        for px, py in zip(x, y, strict=True)
        if 40.0 < px < ground.canvas.width_px - 40.0 and 24.0 < py < ground.canvas.height_px - 16.0
    ]
    middle = len(seen) // 2
    return sorted(seen, key=lambda spot: abs(seen.index(spot) - middle))


def _label(
    ground: MetricCanvas,
    text: str,
    colour: palette.Colour,
    spots: list[tuple[float, float]],
    words: list[Box],
    marks: list[Box],
) -> bool:
    """The text at the first spot in the picture that is free of words and marks, if there is one.

    What is written is added to the words.
    """
    half = text_width_px(text, _TEXT_PX) / 2.0 + 2.0
    for x, y in spots:
        box = (x - half, y - 9.0, x + half, y + 9.0)
        if within(ground, box) and not any(overlap(box, other) for other in words + marks):
            ground.canvas.text((x, y), text, colour, _TEXT_PX, halo=palette.HALO)
            words.append(box)
            return True
    return False
