"""Plane shapes that the pictures are made of; any unit, any frame with y to the left of x."""

import math

import numpy as np
from numpy.typing import NDArray

from augment.geometry.polyline import FloatArray
from augment.scene.lane_graph import AnyLane

# Where a line turns sharply its offset is held back to this multiple of the distance.
_MITER_LIMIT = 2.0
# How far the surface of a lane goes on beyond its ends.
_REACH = 0.1


def offset(points: FloatArray, distance: float) -> FloatArray:
    """Shift a line (P, 2) by a distance to its left (negative: right), (P, 2)."""
    steps = points[1:] - points[:-1]
    steps = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    middle = np.empty_like(points, dtype=np.float64)
    middle[0], middle[-1] = 2.0 * steps[0], 2.0 * steps[-1]
    middle[1:-1] = steps[:-1] + steps[1:]
    length = np.maximum(np.hypot(middle[:, 0], middle[:, 1]), 1e-9)
    reach = distance * np.minimum(2.0 / length, _MITER_LIMIT) / length
    return np.stack(
        [points[:, 0] - reach * middle[:, 1], points[:, 1] + reach * middle[:, 0]], axis=1
    )


def sides(lane: AnyLane) -> tuple[FloatArray, FloatArray]:
    """Return the left and the right boundary of a lane, (P, 2) each, from its map or its width."""
    line, half = lane.centerline.points_m, lane.width_m / 2.0
    left, right = lane.left_boundary, lane.right_boundary
    return (
        offset(line, half) if left is None else left.points_m,
        offset(line, -half) if right is None else right.points_m,
    )


def ring_of(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the polygon (P, 2) between two sides of a lane, drawn out a little at its ends."""
    return np.concatenate([_lengthened(left), _lengthened(right)[::-1]])


def dashes(points: FloatArray, on: float, off: float) -> FloatArray:
    """Return the dashes of a line (P, 2) as straight pieces (K, 2, 2)."""
    stations = _stations(points)
    starts = np.arange(0.0, stations[-1], on + off)
    ends = np.minimum(starts + on, stations[-1])
    return _points_at(points, stations, np.stack([starts, ends], axis=1))


def resample_line(points: FloatArray, spacing: float) -> FloatArray:
    """Cut a line (P, 2) into equal pieces no longer than the spacing, (K, 2)."""
    stations = _stations(points)
    count = math.ceil(stations[-1] / spacing) + 1
    return _points_at(points, stations, np.linspace(0.0, stations[-1], count))


def spread(points: FloatArray, every: float) -> FloatArray:
    """Return points (K, 2) along a line (P, 2), at least three and about so far apart."""
    stations = _stations(points)
    count = max(2, int(np.hypot(*np.diff(points, axis=0).T).sum() / every)) + 1
    return _points_at(points, stations, np.linspace(0.0, stations[-1], count))


def runs(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return first and last index of each unbroken run of true flags."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def stripes(
    polygon: FloatArray, angle_rad: float, period: float, width: float
) -> list[FloatArray]:
    """Return parallel stripes in a convex polygon (P, 2), long sides in the given direction.

    They lie evenly about the polygon's middle, which is left free.
    """
    normal = np.array([-math.sin(angle_rad), math.cos(angle_rad)])
    across = polygon @ normal
    middle = (across.min() + across.max()) / 2.0
    count = math.ceil((across.max() - across.min()) / 2.0 / period)
    pieces = []
    for index in range(-count, count):
        centre = middle + (index + 0.5) * period
        piece = _half(polygon, normal, centre - width / 2.0)
        pieces.append(_half(piece, -normal, -(centre + width / 2.0)))
    return [piece for piece in pieces if len(piece) >= 3]


def long_axis(polygon: FloatArray) -> tuple[float, float, float]:
    """Return the direction, length and width of a polygon's smallest rectangle."""
    best = (0.0, math.inf, 1.0)
    for dx, dy in np.diff(np.vstack([polygon, polygon[:1]]), axis=0):
        if math.hypot(dx, dy) < 1e-6:
            continue
        angle = math.atan2(dy, dx)
        along = polygon @ np.array([math.cos(angle), math.sin(angle)])
        across = polygon @ np.array([-math.sin(angle), math.cos(angle)])
        length, width = float(np.ptp(along)), float(np.ptp(across))
        if length * width < best[1] * best[2] - 1e-6:
            best = (angle, length, width)
    angle, length, width = best
    return best if length >= width else (angle + math.pi / 2.0, width, length)


# Private


def _stations(points: FloatArray) -> FloatArray:
    """Return how far along a line (P, 2) each point is, (P,)."""
    steps = np.diff(points, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])


def _points_at(points: FloatArray, stations: FloatArray, at: FloatArray) -> FloatArray:
    """Return the points (..., 2) of a line at stations (...)."""
    x, y = np.interp(at, stations, points[:, 0]), np.interp(at, stations, points[:, 1])
    return np.stack([x, y], axis=-1)


def _lengthened(points: FloatArray) -> FloatArray:
    """Draw out both ends of a line; lanes that bend meet at a slight angle, with a gap."""
    longer = np.array(points, dtype=np.float64)
    for end, inner in ((0, 1), (-1, -2)):
        (x, y), (inner_x, inner_y) = points[end], points[inner]
        share = _REACH / math.hypot(x - inner_x, y - inner_y)
        longer[end] = x + share * (x - inner_x), y + share * (y - inner_y)
    return longer


def _half(polygon: FloatArray, normal: FloatArray, limit: float) -> FloatArray:
    """Return the part of a polygon where the product with the normal is at least the limit."""
    depth = polygon @ normal - limit if len(polygon) else polygon
    kept: list[FloatArray] = []
    for index in range(len(polygon)):
        following = (index + 1) % len(polygon)
        if depth[index] >= 0.0:
            kept.append(polygon[index])
        if (depth[index] < 0.0) != (depth[following] < 0.0):
            share = depth[index] / (depth[index] - depth[following])
            kept.append(polygon[index] + share * (polygon[following] - polygon[index]))
    return np.array(kept).reshape(-1, 2)
