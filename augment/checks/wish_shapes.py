"""Cones in a taper, a line, a row or a ring, and the worker beside them, as an intent admits them.

(s, d) is s ahead of the ego along its lane, d left of the centre of the lane that is asked for.
`lay_out` is the one place that says how a shape looks: the distance to the wish looks for the
nearest of its placements, the rule placer takes one.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from operator import attrgetter

import numpy as np
import shapely

from augment.checks.lanes_across import LanesAcross
from augment.checks.wish_patterns import THERE_M, Pattern, find_step_m
from augment.checks.wish_places import Place, Span, find_across, is_exact, list_stations
from augment.geometry.frames import difference
from augment.geometry.polyline import FloatArray
from augment.scene import intent as wish
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Point

WORKER_M = 6.0
"""From a worker to the nearest cone at most; interPlan's stand 0.8 to 4.0 m off."""
CONE_M = LENGTH_WIDTH_M[AgentType.TRAFFIC_CONE][1]
EDGE_M = 0.3
"""So near to a boundary a cone, half a metre wide, stands at it, inside or outside."""
_OPEN_GAP_M = (CONE_M, 10.0)
_BENT_RAD = math.radians(0.5)
_ALONG_SHARE = 0.1
"""Cones that lead less than this across form a line along the lane."""

Placement = tuple[float, float]
"""(s, d)."""


def lay_out(
    request: wish.ConesRequest,
    count: int,
    numbers: Sequence[float],
    *,
    is_along: bool = False,
    is_oblong: bool = False,
) -> list[Placement]:
    """Return where the cones of a shape stand.

    Args:
        request: With its shape; an open one is a line.
        count: Of cones, on each side where the request has two.
        numbers: s of the first cone or of a ring's centre; the gap between neighbours; d of the
            first cone, or of the middle of a row or ring; d of a taper's last cone, or by how
            much a ring is turned, in radians.
        is_along: The gap counts along the lane; else from cone to cone.
        is_oblong: A ring is two rows, an odd cone before them, for a narrow lane.
    """
    first_m, gap_m, from_m, to = numbers
    gaps = max(count - 1, 1)
    along_m = gap_m if request.reach_m is None else request.reach_m / gaps
    match request.shape:
        case wish.Shape.RING if is_oblong:
            return _lay_out_rows(first_m, from_m, count, gap_m, to)
        case wish.Shape.RING:
            radius_m = ring_radius_m(count, gap_m)
            # The first cone is the one towards the ego, but for the turn.
            angles = [math.pi + to + 2.0 * math.pi * index / count for index in range(count)]
            return [
                (first_m + radius_m * math.cos(a), from_m + radius_m * math.sin(a)) for a in angles
            ]
        case wish.Shape.ROW:
            left_m = from_m + (count - 1) * gap_m / 2.0
            return [(first_m, left_m - index * gap_m) for index in range(count)]
        case wish.Shape.TAPER:
            across_m = (to - from_m) / gaps
            if request.reach_m is None and not is_along:
                across_m = math.copysign(min(abs(across_m), gap_m), across_m)
                # From cone to cone: along^2 + across^2 = gap^2.
                along_m = math.sqrt(gap_m**2 - across_m**2)
            return [(first_m + i * along_m, from_m + i * across_m) for i in range(count)]
    sides = (1.0, -1.0) if request.both_sides else (1.0,)
    return [(first_m + i * along_m, side * from_m) for side in sides for i in range(count)]


def ring_radius_m(count: int, gap_m: float) -> float:
    """Return the radius of a ring of cones that are so far apart."""
    # The chord between neighbours: gap = 2 r sin(pi / n).
    return gap_m / (2.0 * math.sin(math.pi / max(count, 2)))


def _lay_out_rows(
    centre_m: float, middle_m: float, count: int, gap_m: float, side_m: float
) -> list[Placement]:
    first_m = centre_m - (count // 2 - 1) * gap_m / 2.0
    along = [first_m + index * gap_m for index in range(count // 2)]
    # An odd cone closes the rows from before, a gap away from the first of either.
    closing_m = first_m - math.sqrt(max(gap_m**2 - side_m**2, 0.0))
    closing = [(closing_m, middle_m)] if count % 2 else []
    rows = [(s, middle_m - side_m) for s in along]
    return [*closing, *rows, *((s, middle_m + side_m) for s in reversed(along))]


def find_nearest_cones(
    request: wish.ConesRequest, count: int, lanes: LanesAcross, points: FloatArray
) -> FloatArray:
    """Return where cones at points (M, 2) belong, (M, 2).

    Args:
        request: With its distance counted from the ego.
        count: Of cones on each side, those that are missing too.
        lanes: Of the scene.
        points: Where there are cones, at least one.
    """
    here = sorted(
        (lanes.route.locate(*point) for point in points.tolist()), key=attrgetter("ahead_m")
    )
    stations = np.array([place.ahead_m for place in here])
    band = lanes.band(request.spot.lane or wish.LaneChoice.OWN, float(stations[0]))
    if band is None or request.shape is None:
        place = Place.of(request.spot, lanes, CONE_M)
        first = int(np.argmin([lanes.route.locate(*point).ahead_m for point in points.tolist()]))
        there = points.copy()
        there[first] = place.nearest(tuple(points[first].tolist()))
        return there
    lefts = [place.left_m - band.left_m for place in here]
    gaps_m = np.hypot(*np.diff(points, axis=0).T)
    # The median: a cone that is missing or astray moves the guess little.
    gap_m = float(np.median(gaps_m)) if len(gaps_m) else 1.0
    best: FloatArray | None = None
    bend_rad = difference(here[-1].tangent_rad, here[0].tangent_rad)
    readings = _list_readings(request, count, lanes, band.width_m)
    # On a straight lane both readings of a gap are the same.
    if abs(bend_rad) < _BENT_RAD:
        readings = [reading for reading in readings if not reading.is_straight]
    for pattern in _list_patterns(request, count, lanes, readings):
        guess = (stations[0], gap_m, lefts[0], lefts[-1])
        if request.shape is wish.Shape.RING:
            guess = (stations.mean(), gap_m, float(np.mean(lefts)), 0.0)
        elif request.shape is wish.Shape.ROW:
            guess = (stations[0], gap_m, float(np.mean(lefts)), 0.0)
        tried = pattern.nearest(points, guess)
        if best is None or _total_m(points, tried) < _total_m(points, best):
            best = tried
        if _total_m(points, best) < THERE_M * len(points):
            break
    assert best is not None
    return best


def find_worker_ground(
    request: wish.ConesRequest, cones: FloatArray, lanes: LanesAcross
) -> shapely.Geometry:
    """Return where a worker may stand by cones (N, 2) that are in order along the lane.

    Near one of them, and on the side that is said: behind them is beyond the line that they
    form as seen from the ego, and further on than the first where it runs along the lane.
    """
    first, last = cones[0], cones[-1]
    here = lanes.route.locate(*last.tolist())
    if request.shape is wish.Shape.RING:
        return shapely.MultiPoint(cones).convex_hull
    near = cones[-2:] if request.post is wish.Post.AT_LAST else cones
    ground = shapely.MultiPoint(near).buffer(WORKER_M, quad_segs=64)
    ahead = np.array([math.cos(here.tangent_rad), math.sin(here.tangent_rad)])
    leads = last - first
    # Left of the lane's direction.
    across_m = float(leads @ np.array([-ahead[1], ahead[0]]))
    is_along = abs(across_m) <= _ALONG_SHARE * float(np.hypot(*leads))
    normal, begin = ahead, first
    if request.post_side is not None:
        normal = request.post_side.sign * np.array([-ahead[1], ahead[0]])
        begin = near.mean(axis=0)
    elif request.post is not wish.Post.BEHIND:
        return ground
    elif not is_along:
        normal = np.array([-leads[1], leads[0]]) / np.hypot(*leads)
        normal = normal if normal @ ahead > 0.0 else -normal
    # Half the plane, as a rectangle of 200 m by 100 m from the line on.
    side = 100.0 * np.array([-normal[1], normal[0]])
    half = [
        begin + side,
        begin - side,
        begin - side + 100.0 * normal,
        begin + side + 100.0 * normal,
    ]
    return shapely.Polygon(half).intersection(ground)


# Private


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reading:
    """One reading of a shape.

    Attributes:
        from_m, to: Ranges of the last two numbers of `lay_out`.
        is_along, is_oblong: As for `lay_out`.
        is_straight: The gap is that of the two points, in a bend as well.
    """

    from_m: Span
    to: Span = (0.0, 0.0)
    is_along: bool = False
    is_oblong: bool = False
    is_straight: bool = False


def _list_readings(
    request: wish.ConesRequest, count: int, lanes: LanesAcross, lane_m: float
) -> list[_Reading]:
    half_m, lateral = lane_m / 2.0, request.spot.lateral
    sign = lanes.side_sign(lateral, request.spot.lane) or float(request.both_sides)
    across = find_across(lateral, sign, lane_m, CONE_M)

    def at_edge(side: float) -> Span:
        return side * half_m - EDGE_M, side * half_m + EDGE_M

    match request.shape:
        case wish.Shape.RING:
            turned = _Reading(from_m=across, to=(-math.pi / count, math.pi / count))
            return [turned, _Reading(from_m=across, to=(CONE_M, half_m), is_oblong=True)]
        case wish.Shape.ROW:
            return [_Reading(from_m=across)]
        case wish.Shape.TAPER:
            sides = (1.0, -1.0) if request.start is None else (request.start.sign,)
            middle = (0.0, 0.0) if request.ends_in_middle else None
            ends = [(at_edge(side), middle or at_edge(-side)) for side in sides]
        case _:
            is_edge = sign != 0.0 and not is_exact(lateral)
            ends = [(at_edge(sign) if is_edge else across, (0.0, 0.0))]
    return [
        _Reading(from_m=from_m, to=to, is_along=is_along, is_straight=is_straight)
        for is_along, is_straight in ((False, False), (True, False), (False, True))
        for from_m, to in ends
    ]


def _list_patterns(
    request: wish.ConesRequest, count: int, lanes: LanesAcross, readings: Sequence[_Reading]
) -> Iterator[Pattern]:
    lane = request.spot.lane or wish.LaneChoice.OWN
    spacing = request.spacing
    gap_m = _OPEN_GAP_M if spacing is None else spacing.span_m
    for reading in readings:

        def slots(numbers: FloatArray, reading: _Reading = reading) -> FloatArray:
            flags = {"is_along": reading.is_along, "is_oblong": reading.is_oblong}
            placed = lay_out(request, count, numbers.tolist(), **flags)
            if reading.is_straight and request.reach_m is None:
                placed = _straighten(placed, float(numbers[1]), partial(_position, lanes, lane))
            points = np.array([_position(lanes, lane, spot) for spot in placed])
            # (N, 2, 2): each slot is a point, so both ends of its line are the same.
            return np.repeat(points[:, None], 2, axis=1)

        for stations in list_stations(request.spot, lanes):
            yield Pattern(ranges=(stations, gap_m, reading.from_m, reading.to), slots=slots)


def _straighten(
    placed: Sequence[Placement], gap_m: float, at: Callable[[Placement], Point]
) -> list[Placement]:
    """Return the cones moved along the lane until each is that far from the one before."""
    moved = [placed[0]]
    for (before_m, before_d), (s_m, d_m) in pairwise(placed):
        if s_m < before_m:  # the line at the other boundary begins
            moved.append((placed[0][0], d_m))
            continue

        def abreast(station_m: float, d_m: float = d_m) -> Point:
            return at((station_m, d_m))

        begin_m = moved[-1][0]
        step_m = find_step_m(abreast, at((begin_m, before_d)), begin_m, gap_m)
        moved.append((begin_m + step_m, d_m))
    return moved


def _position(lanes: LanesAcross, lane: wish.LaneChoice, spot: Placement) -> Point:
    ahead_m, left_m = spot
    band = lanes.band(lane, ahead_m)
    return lanes.route.position(ahead_m, left_m + (0.0 if band is None else band.left_m))


def _total_m(points: FloatArray, placed: FloatArray) -> float:
    return float(np.hypot(*(points - placed).T).sum())
