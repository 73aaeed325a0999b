"""Ground that is asked about thousands of points at once: exact, by cells first.

Cells that no edge comes near lie wholly in or out and answer at once; points in the others are
put to shapely.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from augment.simulation.states import BoolArray, FloatArray

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

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
