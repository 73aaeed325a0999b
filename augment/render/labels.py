"""Names and numbers inside a picture, for reviewers and analysts; never in a voting picture."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import Box, MetricCanvas, text_width_px
from augment.render.road import raster
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.lane_graph import AnyLane

TEXT_PX = 21
_HEIGHT_PX = 34.0
_ARROW_PX = 30.0
_PADDING_PX = 11.0
_INSET_PX = 6.0
_GAP_PX = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Badge:
    """An arrow with a distance: its box in the picture and where it points (pixels, y down)."""

    box_px: Box
    towards_px: tuple[float, float]
    text: str

    @property
    def middle_px(self) -> tuple[float, float]:
        """The middle of the box."""
        left, top, right, bottom = self.box_px
        return (left + right) / 2.0, (top + bottom) / 2.0


def outside(ground: MetricCanvas, agent: TrafficAgent) -> bool:
    """Whether the centre of an agent lies outside the picture."""
    x, y = ground.at(agent.x_m, agent.y_m)
    return not (0.0 <= x < ground.canvas.width_px and 0.0 <= y < ground.canvas.height_px)


def place_badges(
    ground: MetricCanvas,
    lost: list[TrafficAgent],
    seen: list[TrafficAgent],
    taken: tuple[Box, ...] = (),
) -> list[Badge]:
    """A badge for each agent outside, on the line from the ego to it or as near as there is room.

    Badges lie inside the picture, apart from each other and from what is taken, and clear of the
    agents that are seen if that is possible. When the edge is full a second row begins further
    in; when nothing is free at all, the farthest agents go without.
    """
    badges: list[Badge] = []
    boxes = list(taken)
    marks = [mark_box(ground, agent) for agent in seen]
    for agent in sorted(lost, key=lambda agent: (math.hypot(agent.x_m, agent.y_m), agent.id)):
        text = distance_text(math.hypot(agent.x_m, agent.y_m))
        width = _ARROW_PX + text_width_px(text, TEXT_PX) + 2.0 * _PADDING_PX
        towards = ground.at(agent.x_m, agent.y_m)
        candidates = list(_candidates(ground, towards, width))
        box = _first_free(candidates, boxes + marks) or _first_free(candidates, boxes)
        if box is None:
            break
        badges.append(Badge(box_px=box, towards_px=towards, text=text))
        boxes.append(box)
    return badges


def draw_badges(ground: MetricCanvas, badges: list[Badge]) -> None:
    """White plates with a blue arrow and a distance."""
    style = palette.CHANGED_MARK
    for badge in badges:
        ground.canvas.plate(badge.box_px, palette.PAPER, style.outline, _HEIGHT_PX / 2.0)
        left, top, right, bottom = badge.box_px
        middle = np.array([left + _PADDING_PX + _ARROW_PX / 2.0 - 4.0, (top + bottom) / 2.0])
        step = np.array(badge.towards_px) - middle
        step = step / max(float(np.hypot(*step)), 1e-9)
        side = np.array([-step[1], step[0]])
        ground.canvas.stroke(np.array([middle - 9.0 * step, middle + 2.0 * step]), style.fill, 3.0)
        head = np.array([10.0 * step, 6.0 * side, -6.0 * side])
        ground.canvas.fill(middle + head, style.fill)
        ground.canvas.text(
            (right - _PADDING_PX, middle[1]), badge.text, palette.INK, TEXT_PX, anchor="rm"
        )


def mark_box(ground: MetricCanvas, agent: TrafficAgent) -> Box:
    """The upright box round an agent's own, in pixels."""
    box = ground.camera.to_pixels(agent.box.corners_m)
    (left, top), (right, bottom) = box.min(axis=0), box.max(axis=0)
    return float(left), float(top), float(right), float(bottom)


def overlap(one: Box, other: Box, gap_px: float = 0.0) -> bool:
    """Whether two boxes come nearer to each other than a gap."""
    return (
        one[0] < other[2] + gap_px
        and other[0] < one[2] + gap_px
        and one[1] < other[3] + gap_px
        and other[1] < one[3] + gap_px
    )


def within(ground: MetricCanvas, box: Box) -> bool:
    """Whether a box lies in the picture as a whole."""
    left, top, right, bottom = box
    canvas = ground.canvas
    return left >= 0.0 and top >= 0.0 and right <= canvas.width_px and bottom <= canvas.height_px


def distance_text(distance_m: float) -> str:
    """Whole metres, kilometres from 1 km on."""
    if distance_m < 999.5:
        return f"{distance_m:.0f} m"
    if distance_m < 999_500.0:
        return f"{distance_m / 1000.0:.3g} km"
    return "> 999 km"


def _candidates(ground: MetricCanvas, towards: tuple[float, float], width: float) -> Iterator[Box]:
    """Boxes along the edge, nearest to where the line from the ego leaves the picture first."""
    ego = ground.at(0.0, 0.0)
    for row in range(8):
        inset = _INSET_PX + row * (_HEIGHT_PX + _GAP_PX)
        # The middle of a badge may lie on this rectangle.
        x_low, x_high = inset + width / 2.0, ground.canvas.width_px - inset - width / 2.0
        y_low, y_high = (
            inset + _HEIGHT_PX / 2.0,
            ground.canvas.height_px - inset - _HEIGHT_PX / 2.0,
        )
        ring = _Ring(x_low, x_high, y_low, y_high)
        start = ring.station_towards(ego, towards)
        for step in range(math.ceil(ring.length / 4.0 / 2.0) + 1):
            for sign in (1.0, -1.0) if step else (1.0,):
                x, y = ring.point(start + sign * step * 4.0)
                yield (
                    x - width / 2.0,
                    y - _HEIGHT_PX / 2.0,
                    x + width / 2.0,
                    y + _HEIGHT_PX / 2.0,
                )


@dataclass(frozen=True, slots=True)
class _Ring:
    """A rectangle's edge, run clockwise from its top left corner."""

    x_low: float
    x_high: float
    y_low: float
    y_high: float

    @property
    def length(self) -> float:
        return 2.0 * (self.x_high - self.x_low + self.y_high - self.y_low)

    def point(self, station: float) -> tuple[float, float]:
        width, height = self.x_high - self.x_low, self.y_high - self.y_low
        station %= self.length
        if station < width:
            return self.x_low + station, self.y_low
        if station < width + height:
            return self.x_high, self.y_low + station - width
        if station < 2.0 * width + height:
            return self.x_high - (station - width - height), self.y_high
        return self.x_low, self.y_high - (station - 2.0 * width - height)

    def station_towards(self, start: tuple[float, float], end: tuple[float, float]) -> float:
        """Where the line from a point inside to one outside crosses the edge."""
        dx, dy = end[0] - start[0], end[1] - start[1]
        across = (self.x_high if dx > 0.0 else self.x_low) - start[0]
        down = (self.y_high if dy > 0.0 else self.y_low) - start[1]
        shares = [gap / step for gap, step in ((across, dx), (down, dy)) if abs(step) > 1e-9]
        share = max(0.0, min(shares, default=0.0))
        x = min(max(start[0] + share * dx, self.x_low), self.x_high)
        y = min(max(start[1] + share * dy, self.y_low), self.y_high)
        width, height = self.x_high - self.x_low, self.y_high - self.y_low
        gaps = {
            x - self.x_low: abs(y - self.y_low),
            width + y - self.y_low: abs(x - self.x_high),
            width + height + self.x_high - x: abs(y - self.y_high),
            2.0 * width + height + self.y_high - y: abs(x - self.x_low),
        }
        return min(gaps, key=lambda station: gaps[station])


def _first_free(candidates: list[Box], taken: list[Box]) -> Box | None:
    free = (box for box in candidates if not any(overlap(box, other, _GAP_PX) for other in taken))
    return next(free, None)


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
