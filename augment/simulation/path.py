"""A line to drive along: dense, read by arc length, and points read beside it, many at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from augment.simulation.states import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry


SPACING_M = 0.5
_CELL_M = 2.0
_REACH_M = 30.0
_WINDOW = 10
"""Samples either way that may be nearest to a point of a cell, given the cell middle's nearest."""

_COARSE = 8


class Path:
    """Points (P, 2) every half metre, the heading between them, and the ends extended straight.

    Attributes:
        points_m: (P, 2).
        stations_m: (P,) arc length at each point.
        headings_rad: (P,) unwrapped, of the segment that follows (the last repeats).
    """

    def __init__(self, points_m: FloatArray) -> None:
        steps = np.diff(points_m, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        self.points_m = points_m
        self.stations_m = np.concatenate([[0.0], np.cumsum(lengths)])
        heading = np.unwrap(np.arctan2(steps[:, 1], steps[:, 0]))
        self.headings_rad = np.concatenate([heading, heading[-1:]])
        self._directions = steps / lengths[:, None]
        # The heading is read between the middles of segments, so that it turns without jumps.
        self._middles = self.stations_m[:-1] + lengths / 2.0
        self._grid: tuple[FloatArray, IntArray] | None = None

    @property
    def length_m(self) -> float:
        """The arc length."""
        return float(self.stations_m[-1])

    def poses(self, stations_m: FloatArray) -> FloatArray:
        """Poses (..., 3) at arc lengths (...,); beyond the ends straight on."""
        poses = np.empty((*stations_m.shape, 3))
        poses[..., 0] = np.interp(stations_m, self.stations_m, self.points_m[:, 0])
        poses[..., 1] = np.interp(stations_m, self.stations_m, self.points_m[:, 1])
        poses[..., 2] = np.interp(stations_m, self._middles, self.headings_rad[:-1])
        beyond = stations_m - np.clip(stations_m, 0.0, self.length_m)
        if beyond.any():
            poses[..., 0] += beyond * np.cos(poses[..., 2])
            poses[..., 1] += beyond * np.sin(poses[..., 2])
        return poses

    def beside(self, points_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points (N, 2) lie: arc length (N,) and distance to the left (N,).

        Beyond the ends the line goes on straight. Exact near the line; of points that are more
        than `_REACH_M` off it is known that they are far.
        """
        nearest = self._nearest(points_m)
        last = len(self._directions) - 1
        candidates = np.stack([np.maximum(nearest - 1, 0), np.minimum(nearest, last)])
        offset = points_m - self.points_m[candidates]
        direction = self._directions[candidates]
        along = (offset * direction).sum(axis=-1)
        lengths = np.diff(self.stations_m)[candidates]
        low = np.where(candidates == 0, -np.inf, 0.0)
        high = np.where(candidates == last, np.inf, lengths)
        along = np.clip(along, low, high)
        gap = offset - along[..., None] * direction
        distance = (gap**2).sum(axis=-1)
        pick = (distance[1] < distance[0]).astype(np.int64)
        row = np.arange(len(points_m))
        left = direction[..., 0] * offset[..., 1] - direction[..., 1] * offset[..., 0]
        side = np.where(left[pick, row] >= 0.0, 1.0, -1.0)
        s_m = self.stations_m[candidates[pick, row]] + along[pick, row]
        return s_m, side * np.sqrt(distance[pick, row])

    def offset(self, left_m: float) -> Path:
        """The parallel path so far to the left; where it would turn back, points are dropped."""
        if left_m == 0.0:
            return self
        poses = self.poses(self.stations_m)
        normal = np.stack([-np.sin(poses[:, 2]), np.cos(poses[:, 2])], axis=1)
        moved = self.points_m + left_m * normal
        steps = np.diff(moved, axis=0)
        forward = (steps * self._directions).sum(axis=1)
        keep = np.concatenate([[True], forward > 0.05 * SPACING_M])
        return Path(moved[keep])

    def _nearest(self, points_m: FloatArray) -> IntArray:
        """The index (N,) of the nearest sample."""
        origin, cells = self._cells()
        at = ((points_m - origin) * (1.0 / _CELL_M)).astype(np.int64)
        np.clip(at, 0, np.array(cells.shape) - 1, out=at)
        return self._around(points_m, cells[at[:, 0], at[:, 1]], _WINDOW)

    def _cells(self) -> tuple[FloatArray, IntArray]:
        """The nearest sample of the middle of each cell around the path; made once."""
        if self._grid is None:
            low = self.points_m.min(axis=0) - _REACH_M
            shape = np.ceil((self.points_m.max(axis=0) + _REACH_M - low) / _CELL_M).astype(int)
            columns = low[1] + (np.arange(shape[1]) + 0.5) * _CELL_M
            rows = low[0] + (np.arange(shape[0]) + 0.5) * _CELL_M
            # Among few samples first, then among those around the nearest of them.
            some = self.points_m[::_COARSE]
            across = (columns[:, None] - some[:, 1]) ** 2
            guess = np.stack([(across + (x_m - some[:, 0]) ** 2).argmin(axis=1) for x_m in rows])
            middles = np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1)
            fine = self._around(middles.reshape(-1, 2), guess.ravel() * _COARSE, _COARSE)
            self._grid = (low, fine.reshape(guess.shape))
        return self._grid

    def _around(self, points_m: FloatArray, guess: IntArray, window: int) -> IntArray:
        """The nearest (N,) of the samples around a guess (N,)."""
        near = guess[:, None] + np.arange(-window, window + 1)
        np.clip(near, 0, len(self.points_m) - 1, out=near)
        gap = self.points_m[near] - points_m[:, None, :]
        best = (gap[..., 0] ** 2 + gap[..., 1] ** 2).argmin(axis=1)
        return np.asarray(near[np.arange(len(near)), best], dtype=np.int64)


def dense(points_m: FloatArray, spacing_m: float = SPACING_M) -> FloatArray:
    """A line (P, 2) cut into equal pieces of about the spacing, (K, 2); repeats are dropped."""
    steps = np.hypot(*np.diff(points_m, axis=0).T)
    points_m = points_m[np.concatenate([[True], steps > 1e-6])]
    stations = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points_m, axis=0).T))])
    count = max(1, round(float(stations[-1]) / spacing_m))
    at = np.linspace(0.0, stations[-1], count + 1)
    return np.stack(
        [np.interp(at, stations, points_m[:, 0]), np.interp(at, stations, points_m[:, 1])], axis=1
    )


CELL_M = 0.5
_OUT, _IN, _EDGE = 0, 1, 2


class Region:
    """A polygon or several, as ground; the edge itself counts as outside."""

    def __init__(self, ground: BaseGeometry) -> None:
        import shapely

        shapely.prepare(ground)
        self.ground = ground
        self._origin = np.zeros(2)
        self._cells = np.full((3, 3), _OUT, dtype=np.int8)
        if not shapely.is_empty(ground):
            self._lay_cells()

    def contains(self, points_m: FloatArray) -> BoolArray:
        """Which points (..., 2) lie inside, (...,)."""
        import shapely

        rows = ((points_m - self._origin) * (1.0 / CELL_M)).astype(np.int64)
        np.clip(rows, 0, np.array(self._cells.shape) - 1, out=rows)
        marks = self._cells[rows[..., 0], rows[..., 1]]
        inside = np.asarray(marks == _IN)
        edge = marks == _EDGE
        if edge.any():
            near = points_m[edge]
            inside[edge] = shapely.contains_xy(self.ground, near[:, 0], near[:, 1])
        return inside

    def distance_m(self, points_m: FloatArray) -> FloatArray:
        """From points (..., 2) to the ground (...,), 0 inside; infinite where there is none."""
        import shapely

        if shapely.is_empty(self.ground):
            return np.full(points_m.shape[:-1], np.inf)
        distances = shapely.distance(shapely.points(points_m), self.ground)
        return np.asarray(distances, dtype=np.float64)

    def _lay_cells(self) -> None:
        """Mark the cells near an edge; ask about one cell of each run between them."""
        import shapely

        low_x, low_y, high_x, high_y = shapely.bounds(self.ground)
        self._origin = np.array([low_x, low_y]) - 3.0 * CELL_M
        shape = np.ceil((np.array([high_x, high_y]) - self._origin) / CELL_M).astype(int) + 3
        cells = np.full(shape, _OUT, dtype=np.int8)
        edge = shapely.segmentize(shapely.boundary(self.ground), CELL_M / 2.0)
        near = ((shapely.get_coordinates(edge) - self._origin) / CELL_M).astype(np.int64)
        for dx in (-1, 0, 1):
            for dy in (-1, 0, 1):
                cells[near[:, 0] + dx, near[:, 1] + dy] = _EDGE
        plain = cells != _EDGE
        first = plain.copy()
        first[:, 1:] &= ~plain[:, :-1]
        rows, columns = np.nonzero(first)
        middle = self._origin + (np.stack([rows, columns], axis=1) + 0.5) * CELL_M
        answers = np.zeros(shape, dtype=np.int8)
        answers[rows, columns] = shapely.contains_xy(self.ground, middle[:, 0], middle[:, 1])
        starts = np.where(first, np.arange(shape[1]), 0)
        run = np.maximum.accumulate(starts, axis=1)
        whole = np.take_along_axis(answers, run, axis=1)
        self._cells = np.where(plain, whole, cells).astype(np.int8)
