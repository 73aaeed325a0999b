"""Poses and boxes as rows of numbers.

A pose is a row of 3 or more: x_m, y_m, heading_rad. A box is a row of 5: centre x_m, y_m,
heading_rad, length_m, width_m. Two boxes meet unless one of their four side directions parts them
(separating axes), so touching counts as meeting.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.geometry.polyline import FloatArray

BoolArray = NDArray[np.bool_]
# (4, 2) in lengths and widths, as `frames.corners`.
_SIGNS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


def move_ahead(poses: FloatArray, way_m: NDArray[Any] | float) -> FloatArray:
    """Return poses (..., 3) that lie so far (...) ahead of poses or boxes (..., 3 or more)."""
    moved = poses[..., :3].copy()
    moved[..., 0] += way_m * np.cos(moved[..., 2])
    moved[..., 1] += way_m * np.sin(moved[..., 2])
    return moved


def wrap_angles(angle_rad: FloatArray) -> FloatArray:
    """Return the same directions in [-pi, pi], whatever the shape."""
    return np.asarray(angle_rad - 2.0 * np.pi * np.round(angle_rad / (2.0 * np.pi)))


def corners(boxes: FloatArray) -> FloatArray:
    """Return corners (..., 4, 2) of boxes (..., 5): front left, rear left, rear right, front."""
    cos, sin = np.cos(boxes[..., 2])[..., None], np.sin(boxes[..., 2])[..., None]
    # (..., 4): corners in the box's own frame, then turned by its heading.
    along = boxes[..., 3, None] * _SIGNS[:, 0]
    left = boxes[..., 4, None] * _SIGNS[:, 1]
    points = np.empty((*boxes.shape[:-1], 4, 2))
    points[..., 0] = boxes[..., 0, None] + along * cos - left * sin
    points[..., 1] = boxes[..., 1, None] + along * sin + left * cos
    return points


def radii(boxes: FloatArray) -> FloatArray:
    """Return half the diagonal of each box, (...,)."""
    return np.asarray(0.5 * np.hypot(boxes[..., 3], boxes[..., 4]), dtype=np.float64)


def meet(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return which boxes (..., 5) meet their partners (..., 5), (...,)."""
    cos_a, sin_a = np.cos(first[..., 2]), np.sin(first[..., 2])
    cos_b, sin_b = np.cos(second[..., 2]), np.sin(second[..., 2])
    dx, dy = second[..., 0] - first[..., 0], second[..., 1] - first[..., 1]
    # Of the turn between the two, from the cosines and sines that are there.
    cos = np.abs(cos_a * cos_b + sin_a * sin_b)
    sin = np.abs(sin_a * cos_b - cos_a * sin_b)
    length_a, width_a = first[..., 3] / 2.0, first[..., 4] / 2.0
    length_b, width_b = second[..., 3] / 2.0, second[..., 4] / 2.0
    # On an axis of one box: the way between centres against both half shadows.
    hit = np.abs(dx * cos_a + dy * sin_a) <= length_a + length_b * cos + width_b * sin
    hit &= np.abs(dy * cos_a - dx * sin_a) <= width_a + length_b * sin + width_b * cos
    hit &= np.abs(dx * cos_b + dy * sin_b) <= length_b + length_a * cos + width_a * sin
    hit &= np.abs(dy * cos_b - dx * sin_b) <= width_b + length_a * sin + width_a * cos
    return np.asarray(hit, dtype=np.bool_)


def bearings(poses: FloatArray, places_m: FloatArray) -> FloatArray:
    """Return the angles (K,), 0 to pi, between the ego's heading and the way from its axle."""
    dx, dy = places_m[..., 0] - poses[..., 0], places_m[..., 1] - poses[..., 1]
    cos, sin = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    # Left over ahead, in the ego's frame.
    return np.abs(np.arctan2(dy * cos - dx * sin, dx * cos + dy * sin))
