"""A cubic Bezier curve, read by its arc length, and its fit to a directed line.

Frame: any plane frame in metres. t is the curve's own parameter, 0 to 1; s is the arc length
from its first control point. N places, 4 control points.
"""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline

FloatArray = NDArray[np.float64]

CHORD_REACH_M = 0.75
"""A line's heading is read between the points this far before and past: a line of points has a
kink at each of them, and what drives along it does not."""

_KNOTS = np.linspace(0.0, 1.0, 1001)
"""Between these parameters a curve is taken as straight: a chord is some centimetres long."""
# Rounds of moving the parameters to the nearest points of the curve.
_REFITS = 8
# Least and most pieces that a line is cut into, one every half metre between these.
_FIT_SAMPLES = (12, 120)
# Distance of the places at which curve and line are compared; their least and most.
_ERROR_EVERY_M = 0.05
_ERROR_SAMPLES = (8, 600)


@dataclass(frozen=True, eq=False)
class CubicBezier:
    """Four control points (4, 2) in metres; the curve runs from the first to the last.

    Raises:
        ValueError: They are not (4, 2), not finite, or all in one place.
    """

    control_m: FloatArray

    def __init__(self, control_m: ArrayLike) -> None:
        control = np.array(control_m, dtype=np.float64)
        if control.shape != (4, 2):
            raise ValueError(f"a curve needs control points of shape (4, 2), not {control.shape}")
        if not np.isfinite(control).all():
            raise ValueError("a curve needs finite coordinates")
        if np.ptp(control, axis=0).max() < 1e-6:
            raise ValueError("a curve needs control points in more than one place")
        control.flags.writeable = False
        object.__setattr__(self, "control_m", control)

    @property
    def length_m(self) -> float:
        """The arc length from the first control point to the last."""
        return float(self._stations_m[-1])

    def points(self, t: FloatArray) -> FloatArray:
        """Return the points (N, 2) at the parameters (N,)."""
        c0, c1, c2, c3 = self._powers
        # (N, 1) against coefficients (2,), by Horner's scheme.
        column = t[:, None]
        return np.asarray(c0 + column * (c1 + column * (c2 + column * c3)), dtype=np.float64)

    def derivatives(self, t: FloatArray) -> FloatArray:
        """Return the change of the point with the parameter, (N, 2), at the parameters (N,)."""
        _, c1, c2, c3 = self._powers
        column = t[:, None]
        return np.asarray(c1 + column * (2.0 * c2 + column * 3.0 * c3), dtype=np.float64)

    def headings(self, t: FloatArray) -> FloatArray:
        """Return the directions of travel (N,) in radians at the parameters (N,)."""
        steps = self.derivatives(t)
        still = np.hypot(steps[:, 0], steps[:, 1]) < 1e-6 * np.ptp(self.control_m, axis=0).max()
        if still.any():
            # Where a control point is doubled the curve stands still; it leaves along the chord.
            nearby = np.clip(t[still] + 1e-3, 0.0, 1.0), np.clip(t[still] - 1e-3, 0.0, 1.0)
            steps[still] = self.points(nearby[0]) - self.points(nearby[1])
        return np.arctan2(steps[:, 1], steps[:, 0])

    def parameters_at(self, stations_m: ArrayLike) -> FloatArray:
        """Return the parameters (N,) at the arc lengths (N,), which are clipped to the curve."""
        return np.interp(np.asarray(stations_m, dtype=np.float64), self._stations_m, _KNOTS)

    @cached_property
    def _powers(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """The coefficients of 1, t, t^2 and t^3."""
        p0, p1, p2, p3 = self.control_m
        return p0, 3.0 * (p1 - p0), 3.0 * (p0 - 2.0 * p1 + p2), p3 - p0 + 3.0 * (p1 - p2)

    @cached_property
    def _stations_m(self) -> FloatArray:
        """The arc length at each knot."""
        steps = np.hypot(*np.diff(self.points(_KNOTS), axis=0).T)
        return np.concatenate([[0.0], np.cumsum(steps)])


def fit(
    line: Polyline, *, start_rad: float | None = None, end_rad: float | None = None
) -> CubicBezier:
    """Return the cubic with the line's two ends that is closest to it by least squares.

    The parameters of the line's points start as their share of the way and are then moved to the
    nearest points of the curve, a few times over.

    Args:
        line: What to come close to.
        start_rad: The heading that the curve must have at its beginning, None where it is free.
        end_rad: The same for its end; curves that share a heading at a joint have no kink there.
    """
    count = int(np.clip(line.length_m / 0.5, *_FIT_SAMPLES))
    shares = np.linspace(0.0, 1.0, count + 1)
    points = line.points_at(shares * line.length_m)
    arms = _arms(start_rad), _arms(end_rad)
    t = shares
    curve = _least_squares(points, t, arms)
    for _ in range(_REFITS):
        along, gaps = curve.derivatives(t), curve.points(t) - points
        # One Gauss-Newton step of |B(t) - p|^2 in each t: (B - p) . B' / |B'|^2.
        share = (gaps * along).sum(axis=1) / np.maximum((along * along).sum(axis=1), 1e-12)
        # Never backwards: points that change their order would fold the curve.
        t = np.maximum.accumulate(np.clip(t - share, 0.0, 1.0))
        curve = _least_squares(points, t, arms)
    return curve


def fit_error(
    curve: CubicBezier, line: Polyline, start_m: float = 0.0, end_m: float | None = None
) -> tuple[float, float]:
    """Return how far the curve is from the line between two stations, in place and in heading.

    The worst of 600 places at most counts, and its turn against the line's chord of
    `CHORD_REACH_M` either way, where the line is that long.

    The same part of the way is compared with the same part: a curve that has the right shape but
    runs ahead of its line is wrong by that much.
    """
    end_m = line.length_m if end_m is None else end_m
    count = int(np.clip((end_m - start_m) / _ERROR_EVERY_M, *_ERROR_SAMPLES))
    shares = np.linspace(0.0, 1.0, count + 1)
    t = curve.parameters_at(shares * curve.length_m)
    stations = start_m + shares * (end_m - start_m)
    gaps = curve.points(t) - line.points_at(stations)
    inner = (stations >= CHORD_REACH_M) & (stations <= line.length_m - CHORD_REACH_M)
    turns = curve.headings(t[inner]) - chord_headings(line, stations[inner])
    # Turns past pi are the shorter ones the other way round.
    turns = np.abs(np.remainder(turns + math.pi, 2.0 * math.pi) - math.pi)
    return float(np.hypot(gaps[:, 0], gaps[:, 1]).max()), float(turns.max(initial=0.0))


def chord_headings(line: Polyline, stations_m: FloatArray) -> FloatArray:
    """Return the headings (N,) of the chords from `CHORD_REACH_M` before stations to past them."""
    chords = line.points_at(stations_m + CHORD_REACH_M) - line.points_at(
        stations_m - CHORD_REACH_M
    )
    return np.arctan2(chords[:, 1], chords[:, 0])


def travel_pose(line: Polyline, s_m: float, d_m: float = 0.0) -> Pose:
    """Return the line's own point at s with the heading of what drives along it, d to the left.

    The heading is the chord's. Nearer to an end than the chord reaches it is that of the parabola
    through the end and the two points that follow a reach apart. The ends are extended straight.
    """
    on_m = min(max(s_m, 0.0), line.length_m)
    reach_m = min(CHORD_REACH_M, line.length_m / 2.0)
    # Near an end the chord is taken further in, and bent by the parabola's second difference.
    inner_m = min(max(on_m, reach_m), line.length_m - reach_m)
    before, middle, after = line.points_at(inner_m + np.array([-reach_m, 0.0, reach_m]))
    bend = (before - 2.0 * middle + after) * (on_m - inner_m) / reach_m
    dx, dy = (after - before) / 2.0 + bend
    x_m, y_m = line.points_at(np.array([s_m]))[0].tolist()
    heading_rad = math.atan2(dy, dx)
    (place,) = Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad).to_parent(
        np.array([[s_m - on_m, d_m]])
    )
    return Pose(x_m=float(place[0]), y_m=float(place[1]), heading_rad=heading_rad)


# Private


def _arms(heading_rad: float | None) -> FloatArray:
    """The directions (2, 2) or (1, 2) in which an inner control point may move from its end."""
    if heading_rad is None:
        return np.eye(2)
    return np.array([[math.cos(heading_rad), math.sin(heading_rad)]])


def _least_squares(
    points: FloatArray, t: FloatArray, arms: tuple[FloatArray, FloatArray]
) -> CubicBezier:
    """The cubic with the first and the last of the points (N, 2), closest to all at t (N,)."""
    first, last = points[0], points[-1]
    rest = 1.0 - t
    # Bernstein's polynomials (2, N): of the two inner control points, and of the two ends.
    inner = np.stack([3.0 * rest * rest * t, 3.0 * rest * t * t])
    outer = np.stack([rest * rest * rest, t * t * t])
    # (N, 2): what is left with each inner control point on its own end.
    missing = points - (inner + outer).T @ np.stack([first, last])
    # Unknown u moves the inner point `side[u]` along `arm[u]`: two by free ends, one by fixed.
    arm = np.concatenate(arms)
    side = np.repeat([0, 1], [len(arms[0]), len(arms[1])])
    # The normal equations (U, U): sum over t of b_i b_j, times the directions' product.
    square = (inner @ inner.T)[side[:, None], side] * (arm @ arm.T)
    wanted = ((inner @ missing)[side] * arm).sum(axis=1)
    # The normal equations have four unknowns at most; lstsq bears it if they depend on each other.
    moves = np.linalg.lstsq(square, wanted, rcond=None)[0]
    starts, finishes = moves[: len(arms[0])], moves[len(arms[0]) :]
    # A curve that leaves against its heading would turn back on itself.
    if len(starts) == 1:
        starts = np.maximum(starts, 1e-2)
    if len(finishes) == 1:
        finishes = np.minimum(finishes, -1e-2)
    return CubicBezier([first, first + starts @ arms[0], last + finishes @ arms[1], last])
