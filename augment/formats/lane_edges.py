"""Edges and widths of lanes whose source knows lines beside them, but no boundaries of their own.

World frame. P points of a lane, Q of a line.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NARROWEST_M = 2.0
WIDEST_M = 8.0
USUAL_M = 3.5
MOST_CELLS = 500_000
"""Pairs of a point and a piece of line that are looked at in one go."""


def nearest_on(points: FloatArray, line: FloatArray) -> FloatArray:
    """The nearest place (P, 2) on a line (Q, 2) to each of some points (P, 2)."""
    if len(line) < 2:
        return np.full(points.shape, np.nan)
    most = max(1, MOST_CELLS // len(line))
    if len(points) > most:
        parts = [nearest_on(points[at : at + most], line) for at in range(0, len(points), most)]
        return np.vstack(parts)
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-12)
    along = ((points[:, None] - start) * step).sum(axis=2) / square
    feet = start + np.clip(along, 0.0, 1.0)[:, :, None] * step
    away = np.hypot(*np.moveaxis(points[:, None] - feet, 2, 0))
    nearest: FloatArray = feet[np.arange(len(points)), away.argmin(axis=1)]
    return nearest


def edge_of(line: FloatArray, parts: Iterable[tuple[int, int, FloatArray]]) -> FloatArray:
    """Where the edge of a lane lies beside each of its points (P, 2), NaN where nothing is.

    Args:
        line: The lane's middle (P, 2).
        parts: From which of its points to which (both among them) what line is its edge.
    """
    edge = np.full(line.shape, np.nan)
    for start, end, beside in parts:
        rows = slice(max(start, 0), max(end + 1, 0))
        if len(line[rows]) and len(beside) >= 2:
            edge[rows] = nearest_on(line[rows], beside)
    return edge


def width_of(line: FloatArray, left: FloatArray, right: FloatArray) -> float | None:
    """The mean width where an edge is known on both sides, else twice the half that is known.

    None where neither is, or where the edge lies too far away to be the lane's own.
    """
    halves = [np.hypot(*(edge - line).T) for edge in (left, right)]
    whole = halves[0] + halves[1]
    for widths in (whole, 2.0 * halves[0], 2.0 * halves[1]):
        known = widths[np.isfinite(widths)]
        if len(known):
            width_m = float(np.median(known))
            if NARROWEST_M <= width_m <= WIDEST_M:
                return width_m
    return None


def whole_edge(line: FloatArray, edge: FloatArray) -> FloatArray | None:
    """An edge that is known all along and has a length, None else."""
    if not np.isfinite(edge).all() or len(edge) < 2:
        return None
    # An edge that is far away in places is another lane's: it is no boundary of this one.
    if np.hypot(*(edge - line).T).max() > WIDEST_M:
        return None
    return edge if np.hypot(*np.diff(edge, axis=0).T).sum() > 0.5 else None
