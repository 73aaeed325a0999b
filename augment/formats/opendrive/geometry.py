"""Reference lines of OpenDRIVE, and the polynomials along them.

A reference line is a row of pieces. Straight lines, arcs and spirals are of one kind: curvature is
linear along s. N stations, K pieces. Source: ASAM OpenDRIVE 1.8, geometry.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from xml.etree.ElementTree import Element

import numpy as np

from augment import foreign
from augment.foreign import FURTHEST, FloatArray, fault_at
from augment.geometry.frames import Pose

LONGEST_M = 100_000.0
"""No road is longer."""
SHARPEST_PM = 10.0
"""No line is more curved, in 1/m: that of a circle of 10 cm."""
_PANEL_M, _PANEL_RAD, _CUBIC_PANEL_M = 2.0, 0.5, 0.25
"""Integrals are taken over panels that are no longer, and bend no more."""
_ROOTS, _WEIGHTS = np.polynomial.legendre.leggauss(5)
_NODES, _WEIGHTS = (_ROOTS + 1.0) / 2.0, _WEIGHTS / 2.0
"""Gauss-Legendre's, (5,), on a panel of length 1."""
_CUBIC = "abcd"
_CURVATURES = {
    "arc": ("curvature", "curvature"),
    "spiral": ("curvStart", "curvEnd"),
    **dict.fromkeys(("poly3", "paramPoly3"), ()),
}
"""The attributes that name a piece's curvatures, by its kind."""


def read_float(
    element: Element,
    name: str,
    place: str,
    least: float = -FURTHEST,
    most: float = FURTHEST,
    *,
    default: float | None = None,
) -> float:
    """Return an attribute that is a number; raises InvalidDocument as `foreign.read_number`."""
    return foreign.read_number(element.get(name, default), f"{place}.{name}", least, most)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class PiecewiseCubic:
    """A value along s as cubics, each from its start to that of the next.

    Attributes:
        starts_m: (K,) ascending.
        rows: (K, 4) coefficients a to d of the way since the start.
    """

    starts_m: FloatArray
    rows: FloatArray

    @classmethod
    def read(cls, elements: Iterable[Element], at: str, place: str) -> "PiecewiseCubic":
        """Return the profile in elements whose attribute `at` is their start."""
        table = [
            [read_float(part, at, place, -0.01), *(read_float(part, n, place) for n in _CUBIC)]
            for part in elements
        ]
        numbers = np.array(sorted(table, key=lambda row: row[0])).reshape(-1, 5)
        return cls(starts_m=numbers[:, 0], rows=numbers[:, 1:])

    def values_at(self, s_m: FloatArray) -> FloatArray:
        """Return the values (N,) at stations, the first before the first cubic; 0 without any."""
        if not len(self.rows):
            return np.zeros(len(s_m))
        row = np.maximum(np.searchsorted(self.starts_m, s_m + 1e-9, side="right") - 1, 0)
        since_m, (a, b, c, d) = np.maximum(s_m - self.starts_m[row], 0.0), self.rows[row].T
        return np.asarray(a + since_m * (b + since_m * (c + since_m * d)))


@dataclass(frozen=True, slots=True, kw_only=True)
class LinePiece:
    """A piece of a reference line.

    Attributes:
        curvatures_pm: At its start and end; of a cubic none.
        cubics: (2, 4) coefficients of u and v over a parameter; None for other pieces.
        span: How far the parameter goes; None where u is the parameter.
    """

    start: Pose
    length_m: float
    s_m: float = 0.0
    curvatures_pm: tuple[float, float] = (0.0, 0.0)
    cubics: FloatArray | None = None
    span: float | None = None

    def poses_at(self, way_m: FloatArray) -> FloatArray:
        """Return x, y, heading (N, 3) so far along the piece."""
        if self.cubics is not None:
            local = _follow_cubics(self.cubics, self.span, self.length_m, way_m)
        elif any(self.curvatures_pm):
            local = _follow_spiral(*self.curvatures_pm, self.length_m, way_m)
        else:
            local = np.column_stack([way_m, np.zeros((len(way_m), 2))])
        turned_rad = self.start.heading_rad + local[:, 2]
        return np.column_stack([self.start.to_parent(local[:, :2]), turned_rad])


class ReferenceLine:
    """The line that a road's lanes lie beside.

    Raises:
        InvalidDocument: It has no piece, or one of them is none that is known.

    Attributes:
        length_m: Where the last piece ends.
        starts_m: (K,) where pieces begin.
    """

    def __init__(self, view: Element | None, place: str) -> None:
        elements = [] if view is None else view.findall("geometry")
        pieces = [_read_piece(element, f"{place}.planView") for element in elements]
        # Pieces of no length are joints that some editors leave behind.
        self._pieces = sorted((p for p in pieces if p.length_m > 1e-9), key=lambda p: p.s_m)
        if not self._pieces:
            raise fault_at(f"{place}.planView", "needs a geometry that has a length")
        self.starts_m = np.array([piece.s_m for piece in self._pieces])
        self.length_m = self._pieces[-1].s_m + self._pieces[-1].length_m

    def poses_at(self, s_m: FloatArray) -> FloatArray:
        """Return x, y, heading (N, 3) at stations; beyond an end, straight on."""
        poses = np.empty((len(s_m), 3))
        row = np.maximum(np.searchsorted(self.starts_m, s_m, side="right") - 1, 0)
        for number in np.unique(row).tolist():
            piece, rows = self._pieces[number], row == number
            way_m = s_m[rows] - piece.s_m
            held_m = np.clip(way_m, 0.0, piece.length_m)
            poses[rows] = piece.poses_at(held_m)
            beyond_m = (way_m - held_m)[:, None]
            headings = poses[rows, 2]
            poses[rows, :2] += beyond_m * np.column_stack([np.cos(headings), np.sin(headings)])
        return poses


# Private


def _read_piece(element: Element, place: str) -> LinePiece:
    s_m, x_m, y_m, heading_rad = (read_float(element, n, place) for n in ("s", "x", "y", "hdg"))
    length_m = read_float(element, "length", place, 0.0, LONGEST_M)
    start = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)
    line = LinePiece(s_m=s_m, start=start, length_m=length_m)
    shape = next((child for child in element if child.tag != "userData"), None)
    if shape is None:
        raise fault_at(place, f"has no shape; allowed are line, {', '.join(_CURVATURES)}")
    if shape.tag == "line":
        return line
    bounds = place, -SHARPEST_PM, SHARPEST_PM
    names = foreign.look_up(_CURVATURES, shape.tag, place)
    if names:
        first_pm, last_pm = (read_float(shape, name, *bounds) for name in names)
        return replace(line, curvatures_pm=(first_pm, last_pm))
    if shape.tag == "poly3":
        v = [read_float(shape, name, place) for name in _CUBIC]
        return replace(line, cubics=np.array([[0.0, 1.0, 0.0, 0.0], v]))
    cubics = [[read_float(shape, f"{name}{axis}", place) for name in _CUBIC] for axis in "UV"]
    spans = {"arcLength": length_m, "normalized": 1.0}
    span = foreign.look_up(spans, shape.get("pRange", "normalized"), f"{place}.pRange")
    return replace(line, cubics=np.array(cubics), span=span)


def _follow_spiral(
    first_pm: float, last_pm: float, length_m: float, way_m: FloatArray
) -> FloatArray:
    """x, y, heading (N, 3) along a line of linear curvature from the origin, ahead at first."""
    rate_pm2 = (last_pm - first_pm) / length_m
    panel_m = min(_PANEL_M, _PANEL_RAD / max(abs(first_pm), abs(last_pm)))
    ends_m = np.union1d(np.linspace(0.0, length_m, math.ceil(length_m / panel_m) + 1), way_m)
    sizes_m = np.diff(ends_m)
    # (panels, 5) stations, and the headings there: the integral of the curvature.
    inner_m = ends_m[:-1, None] + sizes_m[:, None] * _NODES
    turn_rad = inner_m * (first_pm + inner_m * rate_pm2 / 2.0)
    steps = np.column_stack([np.cos(turn_rad) @ _WEIGHTS, np.sin(turn_rad) @ _WEIGHTS])
    places = np.vstack([[0.0, 0.0], np.cumsum(sizes_m[:, None] * steps, axis=0)])
    heading_rad = way_m * (first_pm + way_m * rate_pm2 / 2.0)
    return np.column_stack([places[np.searchsorted(ends_m, way_m)], heading_rad])


def _follow_cubics(
    cubics: FloatArray, span: float | None, length_m: float, way_m: FloatArray
) -> FloatArray:
    """u, v, heading (N, 3) so far along two cubics of a parameter, by their arc length.

    Where the arc is longer or shorter than the piece says, it is stretched to it.
    """
    count = math.ceil(length_m / _CUBIC_PANEL_M) + 8
    grid = np.linspace(0.0, length_m if span is None else span, count + 1)
    inner = grid[:-1, None] + np.diff(grid)[:, None] * _NODES
    # Derivatives of the cubics (2, 3), lowest power first.
    slopes = cubics[:, 1:] * [1.0, 2.0, 3.0]
    rates = np.hypot(*(np.polynomial.polynomial.polyval(inner, row) for row in slopes))
    arc_m = np.append(0.0, np.cumsum(np.diff(grid) * (rates @ _WEIGHTS)))
    # v over u is followed as far as the length goes, which its parameter does not reach.
    stretch = 1.0 if span is None else arc_m[-1] / length_m
    at = np.interp(way_m * stretch, arc_m, grid)
    (u, v), (du, dv) = (
        [np.polynomial.polynomial.polyval(at, row) for row in rows] for rows in (cubics, slopes)
    )
    return np.column_stack([u, v, np.arctan2(dv, du)])
