"""Arrows at the edge of a picture for changed agents that lie outside of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from augment.render import palette
from augment.render.canvas import Box, MetricCanvas, text_width_px
from augment.scene.entities import TrafficAgent

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
