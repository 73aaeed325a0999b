"""A line to drive along, and ground to drive on; thousands of points are asked about at once."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from augment.geometry.polyline import Polyline
from augment.simulation.states import BoolArray, FloatArray

if TYPE_CHECKING:
    from scipy.spatial import KDTree
SPACING_M = 0.5


class Path:
    """Points (P, 2) every half metre, the heading between them, and the ends extended straight.

    Attributes:
        points_m: (P, 2).
        stations_m: (P,) arc length at each point.
        length_m: The arc length.
    """

    def __init__(self, points_m: FloatArray) -> None:
        steps = np.diff(points_m, axis=0)
        self._lengths = np.hypot(steps[:, 0], steps[:, 1])
        self.points_m = points_m
        self.stations_m = np.concatenate([[0.0], np.cumsum(self._lengths)])
        self.length_m = float(self.stations_m[-1])
        # Unwrapped, so that headings between two segments may be interpolated.
        self._headings = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        self._directions = steps / self._lengths[:, None]
        # The heading is read between the middles of segments, so that it turns without jumps.
        self._middles = self.stations_m[:-1] + self._lengths / 2.0

    def poses(self, stations_m: FloatArray) -> FloatArray:
        """Return poses (..., 3) at arc lengths (...,); beyond the ends straight on."""
        poses = np.empty((*stations_m.shape, 3))
        poses[..., 0] = np.interp(stations_m, self.stations_m, self.points_m[:, 0])
        poses[..., 1] = np.interp(stations_m, self.stations_m, self.points_m[:, 1])
        poses[..., 2] = np.interp(stations_m, self._middles, self._headings)
        beyond = stations_m - np.clip(stations_m, 0.0, self.length_m)
        if beyond.any():
            poses[..., 0] += beyond * np.cos(poses[..., 2])
            poses[..., 1] += beyond * np.sin(poses[..., 2])
        return poses

    def beside(self, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return arc length (N,) and distance to the left (N,) of points (N, 2).

        Beyond the ends the line goes on straight.
        """
        # Segment i leads from point i to point i + 1.
        last = len(self._directions) - 1
        nearest = np.asarray(self._tree.query(points_m)[1], dtype=np.int64)
        # (2, N): the segments before and after the nearest point.
        candidates = np.stack([np.maximum(nearest - 1, 0), np.minimum(nearest, last)])
        offset = points_m - self.points_m[candidates]
        direction = self._directions[candidates]
        # The first and the last segment go on without an end.
        low = np.where(candidates == 0, -np.inf, 0.0)
        high = np.where(candidates == last, np.inf, self._lengths[candidates])
        # (2, N) the foot on each segment, then the squared way from there.
        along = np.clip((offset * direction).sum(axis=-1), low, high)
        distance = ((offset - along[..., None] * direction) ** 2).sum(axis=-1)
        # (N,) the nearer of the two, the earlier one of equals.
        pick = (distance[1] < distance[0]).astype(np.int64), np.arange(len(points_m))
        left = direction[..., 0] * offset[..., 1] - direction[..., 1] * offset[..., 0]
        side = np.where(left[pick] >= 0.0, 1.0, -1.0)
        return self.stations_m[candidates[pick]] + along[pick], side * np.sqrt(distance[pick])

    def station_of(self, place: FloatArray) -> float:
        """Return the arc length of one place (2 or more,)."""
        return float(self.beside(place[None, :2])[0][0])

    def offset(self, left_m: float) -> Path:
        """Return the parallel so far to the left; where it would turn back, points are dropped."""
        if left_m == 0.0:
            return self
        heading = self.poses(self.stations_m)[:, 2]
        moved = self.points_m + left_m * np.stack([-np.sin(heading), np.cos(heading)], axis=1)
        # On the inside of a bend tighter than the offset points come to lie in reverse order.
        forward = (np.diff(moved, axis=0) * self._directions).sum(axis=1)
        return Path(moved[np.concatenate([[True], forward > 0.05 * SPACING_M])])

    @cached_property
    def _tree(self) -> KDTree:
        from scipy.spatial import KDTree

        return KDTree(self.points_m)


def dense(points_m: FloatArray, spacing_m: float = SPACING_M) -> FloatArray:
    """Return a line (P, 2) cut into equal pieces of about the spacing; repeats are dropped."""
    line = Polyline(points_m)
    count = max(1, round(line.length_m / spacing_m))
    return line.points_at(np.linspace(0.0, line.length_m, count + 1))


class Region:
    """A polygon or several, as ground; the edge itself counts as outside."""

    def __init__(self, ground: BaseGeometry) -> None:
        shapely.prepare(ground)
        self.ground = ground

    def contains(self, points_m: FloatArray) -> BoolArray:
        """Return which points (..., 2) lie inside, (...,)."""
        return np.asarray(shapely.contains_xy(self.ground, points_m[..., 0], points_m[..., 1]))

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """Return how far points (..., 2) are from the ground; infinite where there is none."""
        if shapely.is_empty(self.ground):
            return np.full(points_m.shape[:-1], np.inf)
        return np.asarray(shapely.distance(shapely.points(points_m), self.ground))
