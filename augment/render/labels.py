"""Labels in a picture: arrows at its edge, and for reviewers names and numbers."""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, Canvas, Spot, box_around, overlap, text_width_px
from augment.render.road import raster
from augment.render.shapes import spread
from augment.scene.entities import AnyLane, Modification, Scene, TrafficAgent

BADGE_TEXT_PX = 21
_BADGE_PX, _ARROW_PX, _PADDING_PX = 34.0, 30.0, 11.0
_INSET_PX, _GAP_PX = 6.0, 4.0
_STEP_PX = 4.0
_ROWS = 8
_TEXT_PX = 14


@dataclass(frozen=True, slots=True, kw_only=True)
class Badge:
    """An arrow with a distance: its box in the picture and where it points (pixels, y down)."""

    box_px: Box
    towards_px: Spot
    text: str


def place_badges(
    ground: Canvas, ego: TrafficAgent, changed: tuple[TrafficAgent, ...], taken: tuple[Box, ...]
) -> list[Badge]:
    """Place a badge for each change outside, on the line from the ego to it or near that.

    Badges lie inside the picture, apart from each other and from what is taken, and clear of the
    agents that are seen if that is possible. When the edge is full a second row begins further
    in; when nothing is free at all, the farthest agents go without.
    """
    badges: list[Badge] = []
    boxes = list(taken)
    lost = [agent for agent in changed if not ground.shows(ground.at(agent.x_m, agent.y_m))]
    marks = [mark_box(ground.camera, agent) for agent in (ego, *changed) if agent not in lost]
    for agent in sorted(lost, key=lambda agent: (math.hypot(agent.x_m, agent.y_m), agent.id)):
        distance_m = math.hypot(agent.x_m, agent.y_m)
        text = f"{distance_m:.0f} m" if distance_m < 999.5 else f"{distance_m / 1000.0:.3g} km"
        width = _ARROW_PX + text_width_px(text, BADGE_TEXT_PX) + 2.0 * _PADDING_PX
        towards = ground.at(agent.x_m, agent.y_m)
        candidates = list(_candidates(ground, towards, width))
        box = _first_free(candidates, boxes + marks) or _first_free(candidates, boxes)
        if box is None:
            break
        badges.append(Badge(box_px=box, towards_px=towards, text=text))
        boxes.append(box)
    return badges


def draw_badges(ground: Canvas, badges: list[Badge]) -> None:
    """Draw white plates with a blue arrow and a distance."""
    style = palette.CHANGED_MARK
    for badge in badges:
        ground.plate(badge.box_px, palette.PAPER, style.outline, _BADGE_PX / 2.0)
        left, top, right, bottom = badge.box_px
        middle = np.array([left + _PADDING_PX + _ARROW_PX / 2.0 - 4.0, (top + bottom) / 2.0])
        step = np.array(badge.towards_px) - middle
        step = step / max(float(np.hypot(*step)), 1e-9)
        # Across the arrow, for its head.
        side = np.array([-step[1], step[0]])
        ground.stroke(np.array([middle - 9.0 * step, middle + 2.0 * step]), style.fill, 3.0)
        ground.fill(middle + np.array([10.0 * step, 6.0 * side, -6.0 * side]), style.fill)
        at = (right - _PADDING_PX, (top + bottom) / 2.0)
        ground.text(at, badge.text, palette.INK, BADGE_TEXT_PX, anchor="rm")


def mark_box(camera: Camera, agent: TrafficAgent) -> Box:
    """Return the upright box round an agent's own, in pixels."""
    box = camera.to_pixels(agent.box.corners_m)
    (left, top), (right, bottom) = box.min(axis=0).tolist(), box.max(axis=0).tolist()
    return left, top, right, bottom


def within(ground: Canvas, box: Box) -> bool:
    """Return whether a box lies in the picture as a whole."""
    left, top, right, bottom = box
    return left >= 0.0 and top >= 0.0 and right <= ground.width_px and bottom <= ground.height_px


def draw_ghosts(ground: Canvas, scene: Scene, modification: Modification) -> None:
    """Draw faint dashed outlines where removed and moved agents were before the change."""
    gone = set(modification.removed) | {agent.id for agent in modification.moved}
    for agent in scene.agents:
        if agent.id in gone:
            box = agent.box.corners_m
            ground.draw_dashes(ground.px(np.vstack([box, box[:1]])), palette.GHOST, 1.5, 5.0, 4.0)


def draw_labels(
    ground: Canvas,
    scene: Scene,
    taken: list[Box],
    *,
    first: tuple[str, ...] = (),
    named: tuple[str, ...] = (),
) -> None:
    """Write ids beside agents and on lanes, metres along the upper and the left edge.

    Args:
        ground: What is drawn on.
        scene: The scene after the change.
        taken: Boxes in pixels that stay free of text.
        first: Ids of agents that must have a label, at the end of a thin line where there is no
            room beside them.
        named: Ids of lanes that must have one.
    """
    _write_metres(ground)
    everyone = sorted(scene.everyone, key=lambda agent: agent.id not in first)
    boxes = {agent.id: mark_box(ground.camera, agent) for agent in everyone}
    writer = _Writer(ground, list(taken), list(boxes.values()))
    spots_of = {agent.id: ground.at(agent.x_m, agent.y_m) for agent in everyone}
    for name in (name for name in boxes if name in first and ground.shows(spots_of[name])):
        _label_at_a_line(ground, writer, name, boxes[name])
    by_id = {lane.id: lane for lane in scene.ways}
    centres = [_middle(box) for name, box in boxes.items() if name in first]
    for lane_id in named:
        spots = sorted(
            _lane_spots(ground, by_id[lane_id], 20.0),
            key=lambda spot: min((math.dist(spot, centre) for centre in centres), default=0.0),
        )
        asides = ((0.0, 0.0), (0.0, 16.0), (0.0, -16.0), (30.0, 16.0), (-30.0, -16.0))
        beside = [(x + dx, y + dy) for dx, dy in asides for x, y in spots]
        if not writer.write(lane_id, palette.LANE_TEXT, spots):
            writer.write(lane_id, palette.LANE_TEXT, beside, over_marks=True)
    for name in (name for name in boxes if name not in first):
        (left, top, right, bottom), (x, y) = boxes[name], spots_of[name]
        aside = text_width_px(name, _TEXT_PX) / 2.0 + 8.0
        spots = [(x, top - 12.0), (x, bottom + 12.0), (right + aside, y), (left - aside, y)]
        spots += [(right + aside, top - 12.0), (left - aside, bottom + 12.0), (x, top - 30.0)]
        if not writer.write(name, palette.INK, spots):
            writer.write(name, palette.INK, [*spots, (x, y)], over_marks=True)
    for lane in scene.ways:
        if lane.id not in named:
            writer.write(lane.id, palette.LANE_TEXT, _lane_spots(ground, lane, 40.0))


# Private


@dataclass(slots=True)
class _Writer:
    """Writes words where there is room, and remembers where they are.

    Attributes:
        words: Boxes that no other word may lie on.
        marks: Boxes of agents.
    """

    ground: Canvas
    words: list[Box]
    marks: list[Box]

    def write(
        self, text: str, colour: palette.Colour, spots: Iterable[Spot], *, over_marks: bool = False
    ) -> bool:
        """Write at the first spot in the picture that is free, if there is one."""
        half = text_width_px(text, _TEXT_PX) / 2.0 + 2.0
        blocked = self.words if over_marks else self.words + self.marks
        for spot in spots:
            box = box_around(spot, half, 9.0)
            if within(self.ground, box) and not any(overlap(box, other) for other in blocked):
                self.ground.text(spot, text, colour, _TEXT_PX, halo=palette.HALO)
                self.words.append(box)
                return True
        return False


def _write_metres(ground: Canvas) -> None:
    camera = ground.camera
    for x_m in raster(camera.x_min_m, camera.x_max_m):
        at = (ground.at(x_m, 0.0)[0], 10.0)
        ground.text(at, f"{x_m:.0f}", palette.INK, 12, halo=palette.HALO)
    for y_m in raster(camera.y_min_m, camera.y_max_m):
        y = ground.at(0.0, y_m)[1]
        # A dash of a lane beside the number would read as its minus sign.
        ground.plate((1.0, y - 8.0, 31.0, y + 8.0), palette.HALO, None, 3.0)
        ground.text((16.0, y), f"{y_m:.0f}", palette.INK, 12, halo=palette.HALO)


def _label_at_a_line(ground: Canvas, writer: _Writer, text: str, mark: Box) -> None:
    """Write the id beside its mark, or in rings around it with a line that leads to it."""
    left, top, right, bottom = mark
    x, y = _middle(mark)
    half = text_width_px(text, _TEXT_PX) / 2.0
    spots = [(x, top - 18.0), (x, bottom + 18.0)]
    spots += [(right + half + 12.0, y), (left - half - 12.0, y)]
    if writer.write(text, palette.INK, spots):
        return
    reach = max(right - left, bottom - top) / 2.0 + half
    rings = [
        (x + (reach + 14.0 * ring) * math.cos(turn), y + (reach + 14.0 * ring) * math.sin(turn))
        for ring in range(1, 16)
        for turn in np.linspace(0.0, 2.0 * math.pi, 24, endpoint=False).tolist()
    ]
    if writer.write(text, palette.INK, rings) or writer.write(
        text, palette.INK, rings, over_marks=True
    ):
        ground.stroke(np.array([[x, y], _middle(writer.words[-1])]), palette.INK, 1.0)


def _lane_spots(ground: Canvas, lane: AnyLane, every_px: float) -> list[Spot]:
    """Return places on a lane that are in the picture, the middle one first."""
    seen = [
        (x, y)
        for x, y in spread(ground.px(lane.centerline.points_m), every_px).tolist()
        if 40.0 < x < ground.width_px - 40.0 and 24.0 < y < ground.height_px - 16.0
    ]
    middle = len(seen) // 2
    return sorted(seen, key=lambda spot: abs(seen.index(spot) - middle))


def _middle(box: Box) -> Spot:
    left, top, right, bottom = box
    return (left + right) / 2.0, (top + bottom) / 2.0


def _candidates(ground: Canvas, towards: Spot, width: float) -> Iterator[Box]:
    """Yield boxes along the edge, nearest to where the line from the ego leaves it first."""
    ego = ground.at(0.0, 0.0)
    for row in range(_ROWS):
        # The middle of a badge may lie on this rectangle, run clockwise from its top left corner.
        inset = _INSET_PX + row * (_BADGE_PX + _GAP_PX)
        low = np.array([inset + width / 2.0, inset + _BADGE_PX / 2.0])
        high = np.array([ground.width_px, ground.height_px]) - low
        (left, top), (right, bottom) = low.tolist(), high.tolist()
        ring = np.array([[left, top], [right, top], [right, bottom], [left, bottom], [left, top]])
        stations = np.cumsum([0.0, *np.abs(np.diff(ring, axis=0)).sum(axis=1)])
        start = _station_towards(ego, towards, ring, stations)
        for step in range(math.ceil(stations[-1] / _STEP_PX / 2.0) + 1):
            for sign in (1.0, -1.0) if step else (1.0,):
                at = (start + sign * step * _STEP_PX) % stations[-1]
                x, y = np.interp(at, stations, ring[:, 0]), np.interp(at, stations, ring[:, 1])
                yield box_around((float(x), float(y)), width / 2.0, _BADGE_PX / 2.0)


def _station_towards(start: Spot, end: Spot, ring: np.ndarray, stations: np.ndarray) -> float:
    """Return where on a ring the line from a point inside to one outside crosses it."""
    low, high = ring[0], ring[2]
    step = np.array(end) - start
    # The edge that lies ahead on each axis; the first that is reached is where it leaves.
    gaps = np.where(step > 0.0, high, low) - start
    shares = [gap / way for gap, way in zip(gaps, step, strict=True) if abs(way) > 1e-9]
    share = max(0.0, min(shares, default=0.0))
    x, y = np.clip(np.array(start) + share * step, low, high)
    # Stations of the point on the top, right, bottom and left edge, by how far that is off.
    away = {
        x - low[0]: abs(y - low[1]),
        stations[1] + y - low[1]: abs(x - high[0]),
        stations[2] + high[0] - x: abs(y - high[1]),
        stations[3] + high[1] - y: abs(x - low[0]),
    }
    return float(min(away, key=lambda station: away[station]))


def _first_free(candidates: list[Box], taken: list[Box]) -> Box | None:
    free = (box for box in candidates if not any(overlap(box, other, _GAP_PX) for other in taken))
    return next(free, None)
