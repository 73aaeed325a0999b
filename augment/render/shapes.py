"""Plane shapes that the pictures are made of; any unit, any frame with y to the left of x."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.geometry.polyline import FloatArray
from augment.scene.entities import AnyLane

# Where a line turns sharply its offset is held back to this multiple of the distance.
_MITER_LIMIT = 2.0
# How far the surface of a lane goes on beyond its ends, in metres.
_REACH = 0.1


def offset(points: FloatArray, distance: float) -> FloatArray:
    """Shift a line (P, 2) by a distance to its left (negative: right), (P, 2)."""
    steps = points[1:] - points[:-1]
    steps = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    # (P, 2) sums of the unit steps before and after: their length is 2 cos(turn / 2).
    middle = np.empty_like(points, dtype=np.float64)
    middle[0], middle[-1] = 2.0 * steps[0], 2.0 * steps[-1]
    middle[1:-1] = steps[:-1] + steps[1:]
    length = np.maximum(np.hypot(middle[:, 0], middle[:, 1]), 1e-9)
    # The corner of the offset lies distance / cos(turn / 2) away, along the left of `middle`.
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


def lane_ring(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return the polygon (P, 2) between two sides of a lane, drawn out a little at its ends."""
    return np.concatenate([_lengthen(left), _lengthen(right)[::-1]])


def dashes(points: FloatArray, on: float, off: float) -> FloatArray:
    """Return the dashes of a line (P, 2) as straight pieces (K, 2, 2)."""
    stations = _stations(points)
    # (K,) stations; as (K, 2) with the ends they become points (K, 2, 2).
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
    # Changes come in pairs: where a run begins, and the first index behind it.
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(first), int(end) - 1) for first, end in edges.reshape(-1, 2)]


def stripes(
    polygon: FloatArray, angle_rad: float, period: float, width: float
) -> list[FloatArray]:
    """Return parallel stripes in a convex polygon (P, 2), long sides in the given direction.

    They lie evenly about the polygon's middle, which is left free.
    """
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    # Turned back by the angle, so that stripes lie along x and are cut by upright rectangles.
    turned = polygon @ np.array([[cos, -sin], [sin, cos]])
    (left, low), (right, high) = turned.min(axis=0) - 1.0, turned.max(axis=0) + 1.0
    shape, middle = shapely.Polygon(turned), (low + high) / 2.0
    count = math.ceil((high - low) / 2.0 / period)
    starts = [middle + (n + 0.5) * period - width / 2.0 for n in range(-count, count)]
    pieces = [shapely.clip_by_rect(shape, left, start, right, start + width) for start in starts]
    back = np.array([[cos, sin], [-sin, cos]])
    return [
        np.array(piece.exterior.coords)[:-1] @ back
        for piece in pieces
        if isinstance(piece, shapely.Polygon) and not piece.is_empty
    ]


def long_axis(polygon: FloatArray) -> tuple[float, float, float]:
    """Return the direction, length and width of a polygon's smallest rectangle."""
    rectangle = shapely.minimum_rotated_rectangle(shapely.Polygon(polygon))
    # (2, 2): two neighbouring sides.
    sides = np.diff(shapely.get_coordinates(rectangle)[:3], axis=0)
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    longer = int(lengths[1] > lengths[0])
    return math.atan2(*sides[longer, ::-1]), float(lengths[longer]), float(lengths[1 - longer])


# Private


def _stations(points: FloatArray) -> FloatArray:
    """Return how far along a line (P, 2) each point is, (P,)."""
    steps = np.diff(points, axis=0)
    return np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])


def _points_at(points: FloatArray, stations: FloatArray, at: FloatArray) -> FloatArray:
    """Return the points (..., 2) of a line at stations (...)."""
    x, y = np.interp(at, stations, points[:, 0]), np.interp(at, stations, points[:, 1])
    return np.stack([x, y], axis=-1)


def _lengthen(points: FloatArray) -> FloatArray:
    """Draw out both ends of a line; lanes that bend meet at a slight angle, with a gap."""
    longer = np.array(points, dtype=np.float64)
    for end, inner in ((0, 1), (-1, -2)):
        (x, y), (inner_x, inner_y) = points[end], points[inner]
        share = _REACH / math.hypot(x - inner_x, y - inner_y)
        longer[end] = x + share * (x - inner_x), y + share * (y - inner_y)
    return longer
