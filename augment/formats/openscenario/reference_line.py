"""Smooth reference lines and lane widths for OpenDRIVE, from a way's points.

A reference line goes through every point of the centreline, with a direction of its own at each,
so that neither it nor the lane beside it has a kink. Frame: the ego frame of t0. N pieces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from augment.formats.writing import CannotExpress, bounds_of
from augment.geometry.frames import difference
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.lane_graph import AnyLane

NARROWEST_M: Final = 0.1
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
"""Lengths of cubics to far below a millimetre."""
_SAMPLES: Final = 9
"""So many points of a piece are held against a lane's edges."""
_SHARPEST: Final = 0.3
"""Pieces may turn by this cosine at most between one end and the other: about 70 degrees."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A cubic in its own frame, its parameter from 0 to 1: (4,) coefficients of u and of v."""

    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    u: FloatArray
    v: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """How a road begins or ends: its direction, and where the lane's edges are beside its line."""

    heading_rad: float
    left_m: float
    right_m: float

    def between(self, other: End) -> End:
        """Half way to another one."""
        return End(
            heading_rad=self.heading_rad + difference(other.heading_rad, self.heading_rad) / 2.0,
            left_m=(self.left_m + other.left_m) / 2.0,
            right_m=(self.right_m + other.right_m) / 2.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceLine:
    """The line of a road and the lane beside it.

    Attributes:
        stations_m: (N + 1,) arc length along the pieces at each point.
        start, end: How it begins and ends.
        left_m, right_m: (N + 1,) from the line to the lane's edges, left positive.
    """

    pieces: tuple[Piece, ...]
    start: End
    end: End
    stations_m: FloatArray
    left_m: FloatArray
    right_m: FloatArray

    @property
    def length_m(self) -> float:
        """Of the whole line."""
        return float(self.stations_m[-1])


def reference_line(
    way: AnyLane, *, start: End | None = None, end: End | None = None
) -> ReferenceLine:
    """The reference line of a way.

    Args:
        way: A lane or connector.
        start: How it is to begin, so that it fits what it is joined to; None for its own way.
        end: How it is to end, likewise.

    Raises:
        CannotExpress: It turns too sharply between two points, or has no width.
    """
    points = way.centerline.points_m
    tangents = directions(points)
    edges = _edges(way, points, tangents)
    for row, wanted in ((0, start), (-1, end)):
        if wanted is not None:
            tangents[row] = np.cos(wanted.heading_rad), np.sin(wanted.heading_rad)
            edges[row] = wanted.left_m, wanted.right_m
    headings = np.arctan2(tangents[:, 1], tangents[:, 0])
    ends = [
        End(heading_rad=float(headings[n]), left_m=float(edges[n, 0]), right_m=float(edges[n, 1]))
        for n in (0, -1)
    ]
    if ((tangents[:-1] * tangents[1:]).sum(axis=1) < _SHARPEST).any():
        raise CannotExpress(f"{way.id} turns too sharply between two points for a smooth road")
    pieces = tuple(
        _piece(points[row], points[row + 1], tangents[row], tangents[row + 1])
        for row in range(len(points) - 1)
    )
    lengths = np.array([piece.length_m for piece in pieces])
    return ReferenceLine(
        pieces=pieces,
        start=ends[0],
        end=ends[1],
        stations_m=np.concatenate([[0.0], np.cumsum(lengths)]),
        left_m=edges[:, 0],
        right_m=edges[:, 1],
    )


def directions(points_m: FloatArray) -> FloatArray:
    """Unit tangents (P, 2) at a line's points: between the steps around each, nearer ones more."""
    steps = np.diff(points_m, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    ways = steps / lengths[:, None]
    mean = np.vstack(
        [ways[:1], ways[:-1] * lengths[1:, None] + ways[1:] * lengths[:-1, None], ways[-1:]]
    )
    return np.asarray(mean / np.maximum(np.hypot(mean[:, 0], mean[:, 1]), 1e-12)[:, None])


def deviation_m(line: ReferenceLine, way: AnyLane) -> float:
    """Return how far the edges of a road lie beside those of its way at most."""
    import shapely

    at = np.linspace(0.0, 1.0, _SAMPLES)[:, None] ** np.arange(4)
    slope = np.column_stack([np.zeros(_SAMPLES), at[:, :3] * (1.0, 2.0, 3.0)])
    written: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for row, piece in enumerate(line.pieces):
        local, tangent = (
            np.column_stack([powers @ piece.u, powers @ piece.v]) for powers in (at, slope)
        )
        gone_m = np.hypot(*np.diff(local, axis=0).T).cumsum()
        share = np.concatenate([[0.0], gone_m / gone_m[-1]])
        normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        normal /= np.hypot(*normal.T)[:, None]
        cos, sin = np.cos(piece.heading_rad), np.sin(piece.heading_rad)
        for edge, offsets_m in zip(written, (line.left_m, line.right_m), strict=True):
            beside_m = offsets_m[row] + share * (offsets_m[row + 1] - offsets_m[row])
            points = local + beside_m[:, None] * normal
            edge.append(points @ np.array([[cos, sin], [-sin, cos]]) + (piece.x_m, piece.y_m))
    return max(
        shapely.LineString(np.vstack(made)).hausdorff_distance(shapely.LineString(own.points_m))
        for made, own in zip(written, bounds_of(way), strict=True)
    )


# Private


def _piece(start: FloatArray, end: FloatArray, out: FloatArray, into: FloatArray) -> Piece:
    heading = float(np.arctan2(out[1], out[0]))
    turn = np.array([[out[0], out[1]], [-out[1], out[0]]])
    chord, last = turn @ (end - start), turn @ into
    size = float(np.hypot(*chord))
    # Hermite: from (0, 0) along (1, 0) to the chord's end along `last`.
    first_speed, last_speed = np.array([size, 0.0]), size * last
    c = 3.0 * chord - 2.0 * first_speed - last_speed
    d = -2.0 * chord + first_speed + last_speed
    u, v = (np.array([0.0, first_speed[n], c[n], d[n]]) for n in (0, 1))
    return Piece(
        x_m=float(start[0]),
        y_m=float(start[1]),
        heading_rad=heading,
        length_m=_length(u, v),
        u=u,
        v=v,
    )


def _length(u: FloatArray, v: FloatArray) -> float:
    at = (_NODES + 1.0) / 2.0
    slopes = [poly[1] + 2.0 * poly[2] * at + 3.0 * poly[3] * at**2 for poly in (u, v)]
    return float((np.hypot(*slopes) * _WEIGHTS).sum() / 2.0)


def _edges(way: AnyLane, points: FloatArray, tangents: FloatArray) -> FloatArray:
    """How far left the two edges are of the reference line at its points, (P, 2)."""
    if way.left_boundary is None and way.right_boundary is None:
        half = np.full(len(points), way.width_m / 2.0)
        return np.column_stack([half, -half])
    left, right = bounds_of(way)
    left_m, right_m = _offsets(left, points, tangents), _offsets(right, points, tangents)
    if (left_m - right_m < NARROWEST_M).any():
        raise CannotExpress(f"{way.id} has no width somewhere between its edges")
    return np.column_stack([left_m, right_m])


def _offsets(edge: Polyline, points: FloatArray, tangents: FloatArray) -> FloatArray:
    made = []
    for point, (cos, sin) in zip(points, tangents, strict=True):
        place = edge.project(float(point[0]), float(point[1]))
        x_m, y_m = edge.position(place.s_m)
        made.append((y_m - point[1]) * cos - (x_m - point[0]) * sin)
    return np.array(made, dtype=np.float64)
