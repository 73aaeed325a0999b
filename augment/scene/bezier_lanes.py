"""A lane's centreline as cubic Bezier pieces: short enough to be read, close enough to be used.

A lane keeps its one id, whatever the number of its pieces. Agents, connectors and the answer of a
language model all name lanes, a distance along a lane runs on over its pieces, and most lanes
need one piece only; so a lane is written down as the list of its pieces ("Lane3": [[four points],
[four points]]), and where there are several, each can be named by the lane and a letter
("Lane3a", "Lane3b") without becoming a lane of its own. The letters follow from the line alone.

Frame: that of the line. s runs along the source centreline, also within a piece, where it is
spread evenly over the curve's own arc length: the place 21.4 m along a lane is the same place in
every part of the program, and no distance is lost or gained at a joint.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from augment.geometry.bezier import (
    CHORD_REACH_M,
    CubicBezier,
    FitError,
    chord_headings,
    fit,
    fit_error,
)
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline, Projection

SHORTEST_PIECE_M = CHORD_REACH_M
SHORTEST_FOR_HEADING_M = 2.0 * CHORD_REACH_M
"""Nothing is cut shorter for its heading's sake, which is read over a chord of this length."""

_CUTS_TRIED = 9
_END_SAMPLES = 21


@dataclass(frozen=True, slots=True, kw_only=True)
class Tolerance:
    """How far a piece may be from its centreline."""

    position_m: float = 0.3
    heading_rad: float = math.radians(3.0)

    def used_by(self, error: FitError) -> float:
        """The larger share of the two that an error uses up; above 1 it is too large."""
        return max(error.position_m / self.position_m, error.heading_rad / self.heading_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePiece:
    """One cubic, and from where to where on the lane it leads."""

    curve: CubicBezier
    start_m: float
    end_m: float
    error: FitError

    @property
    def length_m(self) -> float:
        """The arc length of the part of the source centreline."""
        return self.end_m - self.start_m

    def own_station(self, s_m: float) -> float:
        """The curve's own arc length at the lane's s."""
        return (s_m - self.start_m) * self.curve.length_m / self.length_m

    def lane_station(self, own_m: float) -> float:
        """The lane's s at the curve's own arc length."""
        return self.start_m + own_m * self.length_m / self.curve.length_m


@dataclass(frozen=True, kw_only=True)
class BezierLane:
    """A centreline as pieces that follow each other, read by the verbs of `Polyline`."""

    pieces: tuple[LanePiece, ...]

    @property
    def length_m(self) -> float:
        """The arc length of the source centreline."""
        return self.pieces[-1].end_m

    @property
    def control_m(self) -> tuple[NDArray[np.float64], ...]:
        """The control points (4, 2) of each piece, in order of travel."""
        return tuple(piece.curve.control_m for piece in self.pieces)

    @cached_property
    def error(self) -> FitError:
        """The worst error of all pieces."""
        return FitError(
            position_m=max(piece.error.position_m for piece in self.pieces),
            heading_rad=max(piece.error.heading_rad for piece in self.pieces),
        )

    def pose_at(self, s_m: float, d_m: float = 0.0) -> Pose:
        """Position and direction of travel at s, d to the left; the ends are extended straight."""
        piece = self.pieces[self.piece_at(s_m)]
        return piece.curve.pose_at(piece.own_station(s_m), d_m)

    def position(self, s_m: float, d_m: float = 0.0) -> tuple[float, float]:
        """The point s along the lane and d to its left."""
        pose = self.pose_at(s_m, d_m)
        return pose.x_m, pose.y_m

    def heading_at(self, s_m: float) -> float:
        """The direction of travel at s, in (-pi, pi]."""
        return self.pose_at(s_m).heading_rad

    def project(self, x_m: float, y_m: float) -> Projection:
        """The nearest place on the lane; of equally near ones the first."""
        found = [(piece, piece.curve.project(x_m, y_m)) for piece in self.pieces]
        piece, place = min(found, key=lambda item: item[1].distance_m)
        return Projection(
            s_m=piece.lane_station(place.s_m), d_m=place.d_m, distance_m=place.distance_m
        )

    def piece_at(self, s_m: float) -> int:
        """The number of the piece at s, from 0; a joint belongs to the piece that begins there."""
        return max(0, sum(piece.start_m <= s_m for piece in self.pieces) - 1)


@lru_cache(maxsize=4096)
def bezier_lane(line: Polyline, tolerance: Tolerance | None = None) -> BezierLane:
    """Pieces that stay within the tolerance; a piece that does not is cut where that helps most.

    A recorded line can be too restless for the tolerance. It is not cut where that brings its
    heading no closer, nor below 5 m (2.5 m where its position is off), and keeps what error is
    left; every piece says its error.

    Fitting takes tens of milliseconds for a winding lane, and prompt and tool ask for the same
    lanes in every augmentation of a scene: what was fitted lately is remembered.
    """
    whole = _piece(line, 0.0, line.length_m)
    return BezierLane(pieces=tuple(_cut(line, whole, tolerance or Tolerance())))


def piece_ids(lane_id: str, count: int) -> tuple[str, ...]:
    """How the pieces of a lane are called: "Lane3" where it is one, else "Lane3a", "Lane3b"."""
    if count == 1:
        return (lane_id,)
    return tuple(lane_id + _letters(number) for number in range(count))


# Private


def _cut(line: Polyline, piece: LanePiece, allowed: Tolerance) -> list[LanePiece]:
    """The piece, or the pieces that it takes to stay within the tolerance."""
    used = allowed.used_by(piece.error)
    strays = piece.error.position_m > allowed.position_m
    shortest_m = SHORTEST_PIECE_M if strays else SHORTEST_FOR_HEADING_M
    if used <= 1.0 or piece.length_m < 2.0 * shortest_m:
        return [piece]
    halves = _best_halves(line, piece, allowed, shortest_m)
    if not strays and max(allowed.used_by(half.error) for half in halves) >= used:
        return [piece]
    return [small for half in halves for small in _cut(line, half, allowed)]


def _best_halves(
    line: Polyline, piece: LanePiece, allowed: Tolerance, shortest_m: float
) -> tuple[LanePiece, LanePiece]:
    """The two pieces whose worse one is best, over a coarse row of cuts and then a fine one."""
    low_m, high_m = piece.start_m + shortest_m, piece.end_m - shortest_m
    for _ in range(2):
        cuts_m = np.linspace(low_m, high_m, _CUTS_TRIED)
        halves = [
            (_piece(line, piece.start_m, cut_m), _piece(line, cut_m, piece.end_m))
            for cut_m in cuts_m.tolist()
        ]
        best = min(range(_CUTS_TRIED), key=lambda number: _badness(halves[number], allowed))
        low_m, high_m = cuts_m[max(0, best - 1)], cuts_m[min(best + 1, _CUTS_TRIED - 1)]
    return halves[best]


def _badness(halves: tuple[LanePiece, LanePiece], allowed: Tolerance) -> tuple[bool, float]:
    """What to keep small: above all a place that is off, for it would have to be cut again."""
    strays = any(half.error.position_m > allowed.position_m for half in halves)
    return strays, max(allowed.used_by(half.error) for half in halves)


def _piece(line: Polyline, start_m: float, end_m: float) -> LanePiece:
    curve = fit(
        line.between(start_m, end_m),
        start_rad=_heading_of(line, start_m),
        end_rad=_heading_of(line, end_m),
    )
    error = fit_error(curve, line, start_m, end_m)
    return LanePiece(curve=curve, start_m=start_m, end_m=end_m, error=error)


def _heading_of(line: Polyline, s_m: float) -> float:
    """The heading of all pieces that begin or end there: no kink at a joint, no flare at an end.

    It is the chord's, or at an end of the line, where there is none, that of the parabola from
    the end through the last 5 m.
    """
    if 0.0 < s_m < line.length_m:
        return float(chord_headings(line, np.array([s_m]))[0])
    inwards_m = np.linspace(0.0, min(2.0 * CHORD_REACH_M, line.length_m), _END_SAMPLES)
    points = line.points_at(np.abs(s_m - inwards_m))
    powers = np.column_stack([inwards_m, inwards_m * inwards_m])
    dx, dy = np.linalg.lstsq(powers, points - points[0], rcond=None)[0][0]
    return math.atan2(dy, dx) if s_m == 0.0 else math.atan2(-dy, -dx)


def _letters(number: int) -> str:
    """The letters a to z, then aa, ab and so on."""
    before, last = divmod(number, 26)
    return ("" if before == 0 else _letters(before - 1)) + chr(ord("a") + last)
