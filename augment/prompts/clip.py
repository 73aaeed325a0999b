"""Cutting a map down to what lies around the ego.

Frame: ego frame. P points of a boundary.
"""

from __future__ import annotations

import numpy as np
import shapely
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def boundary_within(
    boundary_m: FloatArray, box_m: tuple[float, float, float, float]
) -> FloatArray:
    """A boundary (P, 2) cut to a box: least x, least y, most x, most y; empty where they part."""
    points = np.asarray(boundary_m, dtype=np.float64)
    for side, limit_m in enumerate(box_m):
        axis, sign = side % 2, -1.0 if side < 2 else 1.0
        points = _cut(points, sign * (points[:, axis] - limit_m))
        if len(points) < 3:
            return np.empty((0, 2))
    return points


def distance_to_area_m(boundary_m: FloatArray, points_m: FloatArray) -> float:
    """From the nearest of points (N, 2) to an area with a boundary (P, 2), 0 inside."""
    area = shapely.make_valid(shapely.Polygon(boundary_m))
    return float(shapely.distance(area, shapely.MultiPoint(points_m)))


def simplify_boundary(boundary_m: FloatArray, tolerance_m: float) -> FloatArray:
    """The boundary (P, 2) with fewer of its points, nowhere further off than the tolerance.

    Douglas and Peucker's algorithm (1973) with distances to segments: every point left out is
    within the tolerance of the edge that replaces it and, since the piece left out runs from one
    end of that edge to the other, every point of the edge is within the tolerance of that piece.
    A boundary that would be less than a triangle stays as it is.
    """
    closed = shapely.LineString([*boundary_m, boundary_m[0]])
    kept = shapely.get_coordinates(shapely.simplify(closed, tolerance_m, preserve_topology=False))[
        :-1
    ]
    return kept if len(kept) >= 3 else boundary_m


def _cut(points: FloatArray, outside_m: FloatArray) -> FloatArray:
    """The part of a closed boundary where `outside_m`, given at each point, is not positive."""
    kept: list[FloatArray] = []
    for index in range(len(points)):
        before, here = outside_m[index - 1], outside_m[index]
        if (before > 0.0) != (here > 0.0):
            share = before / (before - here)
            kept.append(points[index - 1] + share * (points[index] - points[index - 1]))
        if here <= 0.0:
            kept.append(points[index])
    return np.array(kept).reshape(-1, 2)
