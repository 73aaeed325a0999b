"""What lets a reader measure: the 5 m grid through the ego's centre and the scale bar."""

from __future__ import annotations

import math

import numpy as np

from augment.geometry.polyline import FloatArray
from augment.render import palette
from augment.render.camera import Camera
from augment.render.canvas import Box, MetricCanvas
from augment.scene.entities import Scene

GRID_M = 5.0
Corner = tuple[bool, bool]
"""Of a picture: whether it is right, whether it is at the top."""
TEXT_PX = 21
_INSET_PX = 12.0
_PADDING_PX = 28.0
_HEIGHT_PX = 52.0
# About half a car at the usual scale.
_NEAR_PX = 50.0


def draw_grid(ground: MetricCanvas) -> None:
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


def scale_corner(scene: Scene, camera: Camera) -> Corner:
    """The quiet corner that the scale bar lies in: (whether right, whether at the top).

    It depends on the scene before the change alone, so that all pictures of a scenario have their
    scale in the same place: bottom left, unless another one hides fewer agents.
    """
    corners: list[Corner] = [(right, top) for top in (False, True) for right in (False, True)]
    places = np.array([[agent.x_m, agent.y_m] for agent in scene.everyone])
    agents_px = camera.to_pixels(places).tolist()
    boxes = {corner: scale_box(camera, corner) for corner in corners}
    return min(corners, key=lambda one: sum(_close(boxes[one], x, y) for x, y in agents_px))


def scale_box(camera: Camera, corner: Corner) -> Box:
    """The plate of the scale bar in a corner: left, top, right, bottom in pixels."""
    is_right, is_top = corner
    width = 2.0 * _unit_m(camera) * camera.px_per_m + 2.0 * _PADDING_PX
    left = camera.width_px - _INSET_PX - width if is_right else _INSET_PX
    top = _INSET_PX if is_top else camera.height_px - _INSET_PX - _HEIGHT_PX
    return left, top, left + width, top + _HEIGHT_PX


def draw_scale(ground: MetricCanvas, box_px: Box) -> None:
    """A bar of two units, one filled, one empty, with their lengths beneath."""
    left, top, _, _ = box_px
    ground.canvas.plate(box_px, palette.PAPER, None, 6.0)
    unit_m = _unit_m(ground.camera)
    unit_px = unit_m * ground.camera.px_per_m
    start, bar_top, bar_bottom = left + _PADDING_PX, top + 9.0, top + 16.0
    middle, end = start + unit_px, start + 2.0 * unit_px
    ground.canvas.fill(_rectangle(start, bar_top, end, bar_bottom), palette.INK)
    ground.canvas.fill(
        _rectangle(middle, bar_top + 1.5, end - 1.5, bar_bottom - 1.5), palette.PAPER
    )
    for index in range(3):
        text = f"{index * unit_m:.0f}" + (" m" if index == 2 else "")
        at = (start + index * unit_px, bar_bottom + 15.0)
        ground.canvas.text(at, text, palette.INK, TEXT_PX)


def _close(box: Box, x_px: float, y_px: float) -> bool:
    """Whether a mark in the picture may touch the box."""
    left, top, right, bottom = box
    return (
        max(0.0, left - _NEAR_PX) < x_px < right + _NEAR_PX
        and max(0.0, top - _NEAR_PX) < y_px < bottom + _NEAR_PX
    )


def _unit_m(camera: Camera) -> float:
    return 5.0 if camera.px_per_m >= 9.0 else 10.0


def _rectangle(left: float, top: float, right: float, bottom: float) -> FloatArray:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])


def _line(ground: MetricCanvas, line_m: FloatArray, *, axis: bool) -> None:
    ground.stroke(line_m, palette.GRID_AXIS if axis else palette.GRID, 1.0)
