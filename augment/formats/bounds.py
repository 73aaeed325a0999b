"""The edges of lanes and connectors, where the map has them and where it does not."""

from __future__ import annotations

import numpy as np

from augment.geometry.polyline import Polyline
from augment.scene.lane_graph import AnyLane


def bounds_of(way: AnyLane) -> tuple[Polyline, Polyline]:
    """The edges as the map has them, else half a width beside the centreline."""
    half_m = way.width_m / 2.0
    left = way.left_boundary or beside(way.centerline, half_m)
    return left, way.right_boundary or beside(way.centerline, -half_m)


def beside(line: Polyline, d_m: float) -> Polyline:
    """The line through the points d to the left of each of a line's points, mitred."""
    steps = np.diff(line.points_m, axis=0)
    ways = steps / np.hypot(steps[:, 0], steps[:, 1])[:, None]
    before, after = np.vstack([ways[:1], ways]), np.vstack([ways, ways[-1:]])
    mean = before + after
    lengths = np.hypot(mean[:, 0], mean[:, 1])
    mean = np.where(lengths[:, None] < 1e-6, after, mean / np.maximum(lengths, 1e-6)[:, None])
    # A mitre makes the strip as wide at a bend as beside it; a hairpin's would have no end.
    stretch = np.maximum((mean * after).sum(axis=1), 0.5)
    normals = np.column_stack([-mean[:, 1], mean[:, 0]]) / stretch[:, None]
    return Polyline(line.points_m + d_m * normals)
