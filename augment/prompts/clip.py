"""Cutting a map down to what lies around the ego.

Frame: ego frame. P points of a line or boundary.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from augment.geometry.polyline import Polyline

FloatArray = NDArray[np.float64]

_LOOK_EVERY_M = 0.5


def line_within(line: Polyline, radius_m: float) -> Polyline | None:
    """The part of the line that `span_within` names, None where there is none."""
    span = span_within(line, radius_m)
    return None if span is None else line.between(*span)


def span_within(line: Polyline, radius_m: float) -> tuple[float, float] | None:
    """From where a line first comes within the radius of the origin to where it last does.

    Two arc lengths; None where it never does, or for no more than a moment.
    """
    stations_m = np.append(np.arange(0.0, line.length_m, _LOOK_EVERY_M), line.length_m)
    inside = stations_m[np.hypot(*line.points_at(stations_m).T) <= radius_m]
    if len(inside) < 2:
        return None
    return float(inside[0]), float(inside[-1])


def boundary_within(boundary_m: FloatArray, radius_m: float) -> FloatArray:
    """A boundary (P, 2) cut to the square |x|, |y| <= radius; empty where they do not meet."""
    points = np.asarray(boundary_m, dtype=np.float64)
    for axis in (0, 1):
        for sign in (1.0, -1.0):
            points = _cut(points, sign * points[:, axis] - radius_m)
            if len(points) < 3:
                return np.empty((0, 2))
    return points


def simplify_boundary(boundary_m: FloatArray, tolerance_m: float) -> FloatArray:
    """The boundary (P, 2) with fewer of its points, nowhere further off than the tolerance.

    Douglas and Peucker's algorithm (1973) with distances to segments: every point left out is
    within the tolerance of the edge that replaces it and, since the piece left out runs from one
    end of that edge to the other, every point of the edge is within the tolerance of that piece.
    A boundary that would be less than a triangle stays as it is.
    """
    import shapely

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
