"""A directed line through points, read by its arc length.

The verbs of a lane: `position(s, d)`, `project(x, y)` and `heading_at(s)`. s runs along the line
from its first point, d to the left of it, both in metres.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.geometry.frames import Pose

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Projection:
    """Position of a point relative to a line.

    Attributes:
        s_m: Along the line, within its ends.
        d_m: The distance, negative right of the line.
        heading_rad: The direction of travel there.
        beyond_m: How far past one of the ends the point lies.
    """

    s_m: float
    d_m: float
    heading_rad: float
    beyond_m: float = 0.0

    @property
    def distance_m(self) -> float:
        """From the line to the point."""
        return abs(self.d_m)


@dataclass(frozen=True, eq=False)
class Polyline:
    """At least two distinct points (P, 2) in metres, in order of travel; repeats are dropped.

    Raises:
        ValueError: The points are not (P, 2), not finite, or fewer than two remain.
    """

    points_m: FloatArray

    def __init__(self, points_m: ArrayLike) -> None:
        points = np.array(points_m, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2:
            raise ValueError(f"a line needs points of shape (P, 2), not {points.shape}")
        if not np.isfinite(points).all():
            raise ValueError("a line needs finite coordinates")
        keep = np.ones(len(points), dtype=bool)
        keep[1:] = np.hypot(*np.diff(points, axis=0).T) > 1e-6
        points = points[keep]
        if len(points) < 2:
            raise ValueError("a line needs at least two distinct points")
        points.flags.writeable = False
        object.__setattr__(self, "points_m", points)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Polyline) and np.array_equal(self.points_m, other.points_m)

    def __hash__(self) -> int:
        return hash(self.points_m.tobytes())

    @cached_property
    def stations_m(self) -> FloatArray:
        """Arc length at each point, (P,)."""
        steps = np.hypot(*np.diff(self.points_m, axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])

    @property
    def length_m(self) -> float:
        """The arc length from the first point to the last."""
        return float(self.stations_m[-1])

    def position(self, s_m: float, d_m: float = 0.0) -> tuple[float, float]:
        """The point s along the line and d to its left; the ends are extended straight."""
        # s before or past the ends stays with the first or last segment, which goes on straight.
        start_m, x, y, dx, dy = self._find_segment(s_m)
        along = s_m - start_m
        return x + along * dx - d_m * dy, y + along * dy + d_m * dx

    def heading_at(self, s_m: float) -> float:
        """The direction of travel at s, in (-pi, pi]."""
        *_, dx, dy = self._find_segment(s_m)
        return math.atan2(dy, dx)

    def pose_at(self, s_m: float, d_m: float = 0.0) -> Pose:
        """Position and direction of travel at s, d to the left."""
        x_m, y_m = self.position(s_m, d_m)
        return Pose(x_m=x_m, y_m=y_m, heading_rad=self.heading_at(s_m))

    def project(self, x_m: float, y_m: float) -> Projection:
        """The nearest place on the line; of equally near ones the first."""
        # (P - 1, 2) from the start of each segment to the point.
        offset = np.array([x_m, y_m]) - self.points_m[:-1]
        along = (offset * self._directions).sum(axis=1)
        # (P - 1,): how far the foot of the point lies before (negative) or past its segment.
        past = along - np.minimum(np.maximum(along, 0.0), self._spans_m)
        # The cross product with a unit direction: the distance to the left.
        left = self._directions[:, 0] * offset[:, 1] - self._directions[:, 1] * offset[:, 0]
        distances = np.hypot(left, past)
        # argmin takes the first of equally near segments.
        index = int(np.argmin(distances))
        past_m = float(past[index])
        is_past_end = index == (0 if past_m < 0.0 else len(past) - 1)
        return Projection(
            s_m=float(self.stations_m[index] + along[index]) - past_m,
            d_m=math.copysign(distances[index], left[index]),
            heading_rad=math.atan2(*self._directions[index, ::-1].tolist()),
            beyond_m=abs(past_m) if is_past_end else 0.0,
        )

    def resample(self, spacing_m: float) -> Polyline:
        """Points every `spacing_m` from the start; the last point is kept whatever is left."""
        stations = np.arange(0.0, self.length_m, spacing_m)
        # The end follows by itself: no second point in its place for rounding alone.
        if self.length_m - stations[-1] < 1e-6:
            stations = stations[:-1]
        return Polyline(self.points_at(np.concatenate([stations, [self.length_m]])))

    def between(self, start_m: float, end_m: float) -> Polyline:
        """The part from arc length `start_m` to `end_m` (clipped to the line)."""
        low, high = max(0.0, start_m), min(self.length_m, end_m)
        inner = self.stations_m[(self.stations_m > low) & (self.stations_m < high)]
        return Polyline(self.points_at(np.concatenate([[low], inner, [high]])))

    def points_at(self, stations_m: FloatArray) -> FloatArray:
        """The points (N, 2) at the arc lengths (N,), which are clipped to the line."""
        x = np.interp(stations_m, self.stations_m, self.points_m[:, 0])
        y = np.interp(stations_m, self.stations_m, self.points_m[:, 1])
        return np.column_stack([x, y])

    @cached_property
    def _spans_m(self) -> FloatArray:
        return np.diff(self.stations_m)  # (P - 1,)

    @cached_property
    def _directions(self) -> FloatArray:
        # (P - 1, 2), never of length 0: repeats were dropped.
        steps = np.diff(self.points_m, axis=0)
        return np.asarray(steps / np.hypot(steps[:, 0], steps[:, 1])[:, None], dtype=np.float64)

    @cached_property
    def _segments(self) -> tuple[list[float], list[list[float]]]:
        # Plain numbers, since one at a time is read ten times as fast as from an array: where each
        # of the P - 1 segments starts along the line; that, its first point and its direction.
        starts_m = self.stations_m[:-1]
        parts = np.column_stack([starts_m, self.points_m[:-1], self._directions])
        return starts_m.tolist(), parts.tolist()

    def _find_segment(self, s_m: float) -> list[float]:
        starts_m, segments = self._segments
        return segments[max(bisect_right(starts_m, s_m) - 1, 0)]
