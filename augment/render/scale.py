"""What lets a reader measure: the 5 m grid through the ego's centre and the scale bar."""

from __future__ import annotations

import math

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.canvas import Box, Ground

GRID_M = 5.0
_TEXT_PX = 15


def draw_grid(ground: Ground) -> None:
    """Lines every 5 m; those through the ego's centre are stronger."""
    camera = ground.camera
    for x_m in raster(camera.x_min_m, camera.x_max_m):
        line = np.array([[x_m, camera.y_min_m], [x_m, camera.y_max_m]])
        _line(ground, line, axis=x_m == 0.0)
    for y_m in raster(camera.y_min_m, camera.y_max_m):
        line = np.array([[camera.x_min_m, y_m], [camera.x_max_m, y_m]])
        _line(ground, line, axis=y_m == 0.0)


def raster(low_m: float, high_m: float) -> list[float]:
    """The multiples of 5 m strictly between two values."""
    first, last = math.floor(low_m / GRID_M) + 1, math.ceil(high_m / GRID_M) - 1
    return [index * GRID_M for index in range(first, last + 1)]


def scale_box(ground: Ground) -> Box:
    """The plate of the scale bar, at the bottom left (left, top, right, bottom in pixels)."""
    height = ground.canvas.height_px
    bar_px = 2.0 * _unit_m(ground) * ground.camera.px_per_m
    return 12.0, height - 12.0 - 44.0, 12.0 + bar_px + 50.0, height - 12.0


def draw_scale(ground: Ground) -> None:
    """A bar of two units, one filled, one empty, with their lengths beneath."""
    left, top, right, bottom = scale_box(ground)
    ground.canvas.plate((left, top, right, bottom), palette.PLATE, None, 6.0)
    unit_m = _unit_m(ground)
    unit_px = unit_m * ground.camera.px_per_m
    start, bar_top, bar_bottom = left + 12.0, top + 8.0, top + 15.0
    ground.canvas.fill(_rectangle(start, bar_top, start + 2.0 * unit_px, bar_bottom), palette.INK)
    ground.canvas.fill(
        _rectangle(start + unit_px, bar_top + 1.5, start + 2.0 * unit_px - 1.5, bar_bottom - 1.5),
        palette.PAPER,
    )
    for index in range(3):
        text = f"{index * unit_m:.0f}" + (" m" if index == 2 else "")
        at = (start + index * unit_px, bar_bottom + 12.0)
        ground.canvas.text(at, text, palette.INK, _TEXT_PX, anchor="mm")


def _unit_m(ground: Ground) -> float:
    return 5.0 if ground.camera.px_per_m >= 9.0 else 10.0


def _rectangle(left: float, top: float, right: float, bottom: float) -> FloatArray:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def _line(ground: Ground, line_m: FloatArray, *, axis: bool) -> None:
    ground.stroke(line_m, palette.GRID_AXIS if axis else palette.GRID, 1.0)
