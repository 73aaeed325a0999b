"""A drive as a moving picture or as a strip of stills, drawn from its trace alone.

The window follows the ego and says the time. Drives of one scene lie beneath each other, in step;
on a strip each has a column.
"""

import io
from collections.abc import Sequence
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
# How much of the window lies behind the ego.
_CENTRE_SHARE = 0.35

Trace = dict[str, Any]


def animation(traces: Sequence[Trace], *, file_format: str) -> bytes:
    """Draw all drives in step, in real time: GIF, or APNG for everything that shows PNG.

    Args:
        traces: Of one scene, top to bottom; a shorter one stays at its end.
        file_format: "gif" or "apng".
    """
    films = [_Film(trace) for trace in traces]
    last = max(film.steps for film in films) - 1
    frames = [
        _tiled([[film.frame(step)] for film in films])
        for step in [*range(0, last, EVERY_STEPS), last]
    ]
    is_gif = file_format == "gif"
    if is_gif:
        frames = [frame.quantize(64, dither=Image.Dither.NONE) for frame in frames]
    stream = io.BytesIO()
    frames[0].save(
        stream,
        format="GIF" if is_gif else "PNG",
        save_all=True,
        append_images=frames[1:],
        duration=FRAME_MS,
        loop=0,
    )
    return stream.getvalue()


def strip(traces: Sequence[Trace]) -> bytes:
    """Draw six moments beneath each other, a column for every drive, as one PNG."""
    films = [_Film(trace) for trace in traces]
    last = max(film.steps for film in films) - 1
    moments = [round(last * number / (STILLS - 1)) for number in range(STILLS)]
    stream = io.BytesIO()
    rows = [[film.frame(moment) for film in films] for moment in moments]
    _tiled(rows).save(stream, format="PNG")
    return stream.getvalue()


# Private


class _Film:
    """One drive: its ground drawn once, its road users anew for every frame."""

    def __init__(self, trace: Trace) -> None:
        self._trace = trace
        self.steps: int = trace["steps"]
        ego = np.array(trace["ego"]["poses"])[:, :2]
        low, high = ego.min(axis=0) - WINDOW_M, ego.max(axis=0) + WINDOW_M
        self._corner = np.array([low[0], high[1]])
        self._ground = self._draw_ground((high - low) * _SCALE)

    def frame(self, step: int) -> Image.Image:
        """Draw the window at one step; at the last one beyond the end."""
        time_s = step * float(self._trace["step_s"])
        step = min(step, self.steps - 1)
        ego = self._trace["ego"]
        x, y = ego["poses"][step][:2]
        left_top = [[x - WINDOW_M[0] * _CENTRE_SHARE, y + WINDOW_M[1] / 2.0]]
        left, top = self._pixels(np.array(left_top))[0].round().astype(int).tolist()
        width, height = (round(side * _SCALE) for side in WINDOW_M)
        picture = self._ground.crop((left, top, left + width, top + height))
        users = [
            (one, palette.CHANGED_MARK if one["changed"] else palette.OTHER_MARK)
            for one in self._trace["objects"]
        ]
        for user, style in (*users, (ego, palette.EGO_MARK)):
            pose = _pose_at(user, step)
            if pose is not None:
                self._mark(picture, user, pose, style, np.array([left, top]))
        finished = picture.reduce(FINENESS)
        _say_time_and_scale(finished, time_s)
        return finished

    def _mark(
        self,
        picture: Image.Image,
        user: Trace,
        pose: Pose,
        style: palette.MarkStyle,
        corner: np.ndarray,
    ) -> None:
        pen = ImageDraw.Draw(picture)
        length_m, width_m = user["length_m"], user["width_m"]
        body = self._pixels(corners(pose, length_m, width_m)) - corner
        pen.polygon(_flat(body), fill=style.fill, outline=style.outline, width=FINENESS)
        if length_m > 1.5:
            front = np.array([[0.25, 0.5], [0.5, 0.0], [0.25, -0.5]])
            nose = pose.to_parent(front * np.array([length_m, 0.8 * width_m]))
            pen.line(_flat(self._pixels(nose) - corner), fill=style.detail, width=FINENESS)

    def _draw_ground(self, size: FloatArray) -> Image.Image:
        width, height = size.round().astype(int).tolist()
        picture = Image.new("RGB", (width, height), palette.PAPER)
        pen, road = ImageDraw.Draw(picture), self._trace["road"]
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
        return np.asarray((points_m - self._corner) * (_SCALE, -_SCALE), dtype=np.float64)


def _pose_at(user: Trace, step: int) -> Pose | None:
    """Return where a road user is, None while it is not there; what never moves has one pose."""
    poses, first = user["poses"], int(user.get("first", 0))
    at = 0 if len(poses) == 1 and first == 0 else step - first
    pose = poses[at] if 0 <= at < len(poses) else None
    return pose and Pose(x_m=pose[0], y_m=pose[1], heading_rad=pose[2])


def _say_time_and_scale(frame: Image.Image, time_s: float) -> None:
    """Write the time in the upper left corner, ten metres in the lower left one."""
    pen, font = ImageDraw.Draw(frame), ImageFont.load_default(TEXT_PX)
    bottom = frame.height - 14
    pen.rectangle((14, bottom - 3, 14 + SCALE_M * PX_PER_M, bottom), fill=palette.INK)
    halo: dict[str, Any] = {"stroke_width": 2, "stroke_fill": palette.PAPER}
    for at, text in [((14, 26), f"{time_s:.1f} s"), ((14, bottom - 8), f"{SCALE_M:.0f} m")]:
        pen.text(at, text, fill=palette.INK, font=font, anchor="ls", **halo)


def _flat(points: FloatArray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in points.tolist()]


def _tiled(rows: list[list[Image.Image]]) -> Image.Image:
    """Return pictures of one size in rows and columns, with lines between."""
    width, height = rows[0][0].size
    across, down = len(rows[0]), len(rows)
    size = (across * (width + GAP_PX) - GAP_PX, down * (height + GAP_PX) - GAP_PX)
    sheet = Image.new("RGB", size, palette.ROAD_EDGE)
    for row, pictures in enumerate(rows):
        for column, picture in enumerate(pictures):
            sheet.paste(picture, (column * (width + GAP_PX), row * (height + GAP_PX)))
    return sheet
