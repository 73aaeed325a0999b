"""A drive as a moving picture or as a strip of stills, drawn from its trace alone.

The window follows the ego and says the time. Drives of one scene lie beneath each other, in step;
on a strip each has a column.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from augment.geometry.frames import Pose, corners
from augment.geometry.polyline import FloatArray
from augment.render import palette

WINDOW_M = (84.0, 36.0)
PX_PER_M = 8
FINENESS = 2
EVERY_STEPS = 2
FRAME_MS = 200
STILLS = 6
GAP_PX = 3
TEXT_PX = 18
SCALE_M = 10.0
_SCALE = PX_PER_M * FINENESS
_CENTRE_SHARE = 0.35
"""How much of the window lies behind the ego."""

Trace = dict[str, Any]


def animation(traces: Sequence[Trace], *, file_format: str) -> bytes:
    """All drives in step, in real time: GIF, or APNG for everything that shows PNG.

    Args:
        traces: Of one scene, top to bottom; a shorter one stays at its end.
        file_format: "gif" or "apng".
    """
    scenes = [_Drawn(trace) for trace in traces]
    last = max(scene.steps for scene in scenes) - 1
    frames = [
        _stacked([scene.frame(step) for scene in scenes])
        for step in [*range(0, last, EVERY_STEPS), last]
    ]
    stream = io.BytesIO()
    if file_format == "gif":
        frames = [frame.quantize(64, dither=Image.Dither.NONE) for frame in frames]
    frames[0].save(
        stream,
        format="GIF" if file_format == "gif" else "PNG",
        save_all=True,
        append_images=frames[1:],
        duration=FRAME_MS,
        loop=0,
    )
    return stream.getvalue()


def strip(traces: Sequence[Trace]) -> bytes:
    """Six moments beneath each other, first to last, a column for every drive, as one PNG."""
    scenes = [_Drawn(trace) for trace in traces]
    last = max(scene.steps for scene in scenes) - 1
    moments = [round(last * number / (STILLS - 1)) for number in range(STILLS)]
    columns = [_stacked([scene.frame(moment) for moment in moments]) for scene in scenes]
    stream = io.BytesIO()
    _beside(columns).save(stream, format="PNG")
    return stream.getvalue()


# Private


@dataclass(frozen=True, slots=True)
class _Box:
    pose: list[float]
    length_m: float
    width_m: float


class _Drawn:
    """One drive: its ground drawn once, its road users anew for every frame."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self.steps: int = trace["steps"]
        ego = np.array(trace["ego"]["poses"])[:, :2]
        margin = np.array(WINDOW_M)
        self._low = ego.min(axis=0) - margin
        self._high = ego.max(axis=0) + margin
        self._ground = self._draw_ground()

    def frame(self, step: int) -> Image.Image:
        """The window at one step; at the last one beyond the end."""
        time_s = step * float(self._trace["step_s"])
        step = min(step, self.steps - 1)
        x, y = self._trace["ego"]["poses"][step][:2]
        left = x - WINDOW_M[0] * _CENTRE_SHARE
        top = y + WINDOW_M[1] / 2.0
        corner = self._pixels(np.array([[left, top]]))[0].round().astype(int)
        size = (round(WINDOW_M[0] * _SCALE), round(WINDOW_M[1] * _SCALE))
        first, second = int(corner[0]), int(corner[1])
        picture = self._ground.crop((first, second, first + size[0], second + size[1]))
        pen = ImageDraw.Draw(picture)
        for one in self._trace["objects"]:
            pose = _pose_at(one, step)
            if pose is not None:
                style = palette.CHANGED_MARK if one["changed"] else palette.OTHER_MARK
                self._mark(pen, _Box(pose, one["length_m"], one["width_m"]), style, corner)
        ego = self._trace["ego"]
        mark = _Box(ego["poses"][step], ego["length_m"], ego["width_m"])
        self._mark(pen, mark, palette.EGO_MARK, corner)
        finished = picture.reduce(FINENESS)
        _say_time_and_scale(finished, time_s)
        return finished

    def _mark(
        self,
        pen: ImageDraw.ImageDraw,
        box: _Box,
        style: palette.MarkStyle,
        corner: np.typing.NDArray[np.int64],
    ) -> None:
        pose = Pose(x_m=box.pose[0], y_m=box.pose[1], heading_rad=box.pose[2])
        body = self._pixels(corners(pose, box.length_m, box.width_m)) - corner
        pen.polygon(_flat(body), fill=style.fill, outline=style.outline, width=FINENESS)
        if box.length_m > 1.5:
            front = np.array([[0.25, 0.5], [0.5, 0.0], [0.25, -0.5]])
            nose = pose.to_parent(front * np.array([box.length_m, 0.8 * box.width_m]))
            pen.line(_flat(self._pixels(nose) - corner), fill=style.detail, width=FINENESS)

    def _draw_ground(self) -> Image.Image:
        size = ((self._high - self._low) * _SCALE).round().astype(int)
        picture = Image.new("RGB", (int(size[0]), int(size[1])), palette.PAPER)
        pen = ImageDraw.Draw(picture)
        road = self._trace["road"]
        for ring in road["walkways"]:
            pen.polygon(self._line(ring), fill=palette.WALKWAY)
        for outer, *holes in road["drivable"]:
            pen.polygon(self._line(outer), fill=palette.ROAD, outline=palette.ROAD_EDGE, width=2)
            for hole in holes:
                pen.polygon(self._line(hole), fill=palette.PAPER, outline=palette.ROAD_EDGE)
        for ring in road["crosswalks"]:
            pen.polygon(self._line(ring), fill=palette.ZEBRA_GROUND)
        for lane in road["lanes"]:
            pen.line(self._line(lane["edge"]), fill=palette.LANE_LINE, width=FINENESS)
            colour = palette.LIGHT_RED if lane["is_red"] else palette.ROAD_EDGE
            pen.line(self._line(lane["line"]), fill=colour, width=1)
        return picture

    def _line(self, flat: list[float]) -> list[tuple[float, float]]:
        return _flat(self._pixels(np.array(flat).reshape(-1, 2)))

    def _pixels(self, points_m: FloatArray) -> FloatArray:
        away = np.stack([points_m[:, 0] - self._low[0], self._high[1] - points_m[:, 1]], axis=1)
        return np.asarray(away * _SCALE, dtype=np.float64)


def _pose_at(one: dict[str, Any], step: int) -> list[float] | None:
    """Where an object is, None while it is not there."""
    poses: list[list[float] | None] = one["poses"]
    if len(poses) == 1 and one["first"] == 0:
        return poses[0]
    at = step - int(one["first"])
    return poses[at] if 0 <= at < len(poses) else None


def _say_time_and_scale(frame: Image.Image, time_s: float) -> None:
    """The time in the upper left corner, ten metres in the lower left one."""
    pen = ImageDraw.Draw(frame)
    font = ImageFont.load_default(TEXT_PX)
    bottom = frame.height - 14
    pen.rectangle((14, bottom - 3, 14 + SCALE_M * PX_PER_M, bottom), fill=palette.INK)
    for at, text in [((14, 26), f"{time_s:.1f} s"), ((14, bottom - 8), f"{SCALE_M:.0f} m")]:
        pen.text(
            at, text, fill=palette.INK, font=font, anchor="ls",
            stroke_width=2, stroke_fill=palette.PAPER,
        )  # fmt: skip


def _flat(points: FloatArray) -> list[tuple[float, float]]:
    return [(float(x), float(y)) for x, y in points]


def _stacked(pictures: list[Image.Image]) -> Image.Image:
    """Pictures of one size beneath each other, with a line between."""
    if len(pictures) == 1:
        return pictures[0]
    width, height = pictures[0].size
    sheet = Image.new("RGB", (width, _with_gaps(height, len(pictures))), palette.ROAD_EDGE)
    for number, picture in enumerate(pictures):
        sheet.paste(picture, (0, number * (height + GAP_PX)))
    return sheet


def _beside(pictures: list[Image.Image]) -> Image.Image:
    """Pictures of one size beside each other, with a line between."""
    width, height = pictures[0].size
    sheet = Image.new("RGB", (_with_gaps(width, len(pictures)), height), palette.ROAD_EDGE)
    for number, picture in enumerate(pictures):
        sheet.paste(picture, (number * (width + GAP_PX), 0))
    return sheet


def _with_gaps(length_px: int, count: int) -> int:
    return count * length_px + (count - 1) * GAP_PX
