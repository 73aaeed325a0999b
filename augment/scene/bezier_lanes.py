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

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from augment.geometry.bezier import CHORD_REACH_M, CubicBezier, chord_headings, fit, fit_error
from augment.geometry.polyline import Polyline

SHORTEST_PIECE_M = 1.0
"""Nothing is cut shorter: below it the points of a recorded line are its shape."""

ALLOWED = np.array([0.092, math.radians(2.9)])
"""How far off its centreline a piece may be, in metres and radians: as written, to the centimetre,
it is then within 0.1 m and 3 degrees."""
# What is within this share of it of a straight line is written as one.
_STRAIGHT_SHARE = 0.75
# Places of a cut that are tried in a row; samples of the parabola at an end.
_CUTS_TRIED = 9
_END_SAMPLES = 21
_END_M = 2.0 * CHORD_REACH_M
_FREE_ENDS = ((False, False), (False, True), (True, False))
_Span = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LanePiece:
    """One cubic, and from where to where on the lane it leads.

    Attributes:
        error: The worst of the lane's places and headings, in metres and radians.
        is_straight: Whether its two ends say all of it.
    """

    curve: CubicBezier
    start_m: float
    end_m: float
    error: tuple[float, float] = (0.0, 0.0)
    is_straight: bool = False

    @property
    def length_m(self) -> float:
        """The arc length of the part of the source centreline."""
        return self.end_m - self.start_m

    @property
    def is_astray(self) -> bool:
        """True if a place of it is too far off its centreline, whatever the headings are."""
        return bool(self.error[0] > ALLOWED[0])


@lru_cache(maxsize=4096)
def bezier_lane(line: Polyline) -> tuple[LanePiece, ...]:
    """Return pieces as near as is allowed; a piece that is not is cut where that helps most.

    Pieces share their heading at a joint as long as that keeps to what is allowed; where a lane
    turns on the spot they may meet at an angle within it. A line can be too restless even then:
    it is not cut below 1 m and keeps what error is left; every piece says its error.

    Fitting takes tens of milliseconds for a winding lane, and prompt and tool ask for the same
    lanes in every augmentation of a scene: what was fitted lately is remembered.
    """
    return tuple(_cut(line, (0.0, line.length_m)))


def straight_curve(start_m: ArrayLike, end_m: ArrayLike) -> CubicBezier:
    """Return the curve from a point (2,) straight to another, at an even pace."""
    ends = np.array([start_m, end_m], dtype=np.float64)
    # Control points at thirds: the parameter is the share of the way.
    return CubicBezier(np.linspace(ends[0], ends[1], 4))


def piece_ids(lane_id: str, count: int) -> tuple[str, ...]:
    """Return how pieces of a lane are called: "Lane3" where it is one, else "Lane3a", "Lane3b"."""
    if count == 1:
        return (lane_id,)
    return tuple(lane_id + _letters(number) for number in range(count))


# Private


def _letters(number: int) -> str:
    """The letters a to z, then aa, ab and so on."""
    before, last = divmod(number, 26)
    return ("" if before == 0 else _letters(before - 1)) + chr(ord("a") + last)


def _usage(*pieces: LanePiece) -> float:
    """The largest share that the errors of pieces use up; above 1 it is too large."""
    # (pieces, 2) metres and radians, each as a share of its limit.
    return float((np.array([piece.error for piece in pieces]) / ALLOWED).max())


def _cut(line: Polyline, span: _Span) -> list[LanePiece]:
    """The part of the line as the pieces that it takes to stay within what is allowed."""
    # A straight piece first: its two ends are the shortest that can be written.
    chord = straight_curve(*line.points_at(np.array(span)))
    error = fit_error(chord, line, *span)
    straight = LanePiece(
        curve=chord, start_m=span[0], end_m=span[1], error=error, is_straight=True
    )
    if _usage(straight) <= _STRAIGHT_SHARE:
        return [straight]
    whole = _piece(line, span)
    if _usage(whole) > 1.0:
        # Without the line's headings where it comes closer so.
        whole = min([whole, *(_piece(line, span, ends) for ends in _FREE_ENDS)], key=_usage)
    if _usage(whole) <= 1.0 or whole.length_m < 2.0 * SHORTEST_PIECE_M:
        return [whole]
    halves = _best_halves(line, span)
    # A heading that no cut betters is the line's own unrest; a place off the line is cut on.
    if not whole.is_astray and _usage(*halves) >= _usage(whole):
        return [whole]
    return [piece for half in halves for piece in _cut(line, (half.start_m, half.end_m))]


def _best_halves(line: Polyline, span: _Span) -> tuple[LanePiece, LanePiece]:
    """The two pieces whose worse one is best, over a coarse row of cuts and then a fine one.

    Above all none may be off its place, for it would have to be cut again.
    """

    def badness(halves: tuple[LanePiece, LanePiece]) -> tuple[bool, float]:
        return any(half.is_astray for half in halves), _usage(*halves)

    start_m, end_m = span
    low_m, high_m = start_m + SHORTEST_PIECE_M, end_m - SHORTEST_PIECE_M
    for _ in range(2):
        cuts_m = np.linspace(low_m, high_m, _CUTS_TRIED)
        halves = [
            (_piece(line, (start_m, cut_m)), _piece(line, (cut_m, end_m)))
            for cut_m in cuts_m.tolist()
        ]
        best = min(range(_CUTS_TRIED), key=lambda number: badness(halves[number]))
        # The second row lies between the neighbours of the best cut.
        low_m, high_m = cuts_m[max(0, best - 1)], cuts_m[min(best + 1, _CUTS_TRIED - 1)]
    return halves[best]


def _piece(line: Polyline, span: _Span, fixed: tuple[bool, bool] = (True, True)) -> LanePiece:
    """One cubic with the line's heading at the ends where that is fixed."""
    start_rad, end_rad = (
        _heading_at(line, s_m) if is_fixed else None
        for s_m, is_fixed in zip(span, fixed, strict=True)
    )
    curve = fit(line.between(*span), start_rad=start_rad, end_rad=end_rad)
    error = fit_error(curve, line, *span)
    return LanePiece(curve=curve, start_m=span[0], end_m=span[1], error=error)


def _heading_at(line: Polyline, s_m: float) -> float:
    """The heading of all pieces that begin or end there: no kink at a joint, no flare at an end.

    It is the chord's, or at an end of the line, where there is none, that of the parabola from
    the end through the last 1.5 m.
    """
    if 0.0 < s_m < line.length_m:
        return float(chord_headings(line, np.array([s_m]))[0])
    inwards_m = np.linspace(0.0, min(_END_M, line.length_m), _END_SAMPLES)
    points = line.points_at(np.abs(s_m - inwards_m))
    # p(s) - p(0) = a s + b s^2 by least squares, (samples, 2); a is the direction at the end.
    powers = np.column_stack([inwards_m, inwards_m * inwards_m])
    dx, dy = np.linalg.lstsq(powers, points - points[0], rcond=None)[0][0]
    return math.atan2(dy, dx) if s_m == 0.0 else math.atan2(-dy, -dx)
