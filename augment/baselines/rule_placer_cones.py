"""Construction zones of the rule placer: a taper, a line, a row or a ring of cones, and a worker.

s runs along the ego's lane from the ego's centre, d to the left of it.
"""

from __future__ import annotations

import math

import numpy as np

from augment.baselines.rule_placer_ground import PlacingGround
from augment.errors import CannotPlace
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import ConesRequest, LaneChoice, LateralTarget, Post, Shape, Side
from augment.scene.lane_graph import LanePosition

CONE_SPACING_M = 2.5
"""Between cones of which nobody says how far: interPlan's median."""

_EDGE_M = LENGTH_WIDTH_M[AgentType.TRAFFIC_CONE][1] / 2.0
"""A cone at a lane boundary stands inside of it."""

_WORKER_GAP_M = 1.6
"""How far from the cones a worker stands; interPlan's are 0.8 to 4.0 m from the nearest."""

Place = tuple[float, float]
"""(s, d)."""


def cones(
    request: ConesRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """The cones in order, then the worker; ids are still empty.

    Raises:
        CannotPlace: The lanes end before the last cone, or there is no such lane.
    """
    spacing_m = CONE_SPACING_M
    if request.spacing is not None:
        spacing_m = float(rng.uniform(request.spacing.low_m, request.spacing.high_m))
    if spacing_m < 2.0 * _EDGE_M:
        raise CannotPlace(f"Cones {spacing_m:g} m apart would stand in each other.")
    lane = request.spot.lane
    half_lane_m = ground.lane(ground.beside(ground.along(distance_m), lane)).width_m / 2.0
    edge_m = half_lane_m - _EDGE_M
    places = _places(request, ground, distance_m, spacing_m, edge_m)
    agents = [
        _standing(AgentType.TRAFFIC_CONE, _at(ground, lane, place), ground) for place in places
    ]
    if request.has_worker:
        worker = _worker(request, ground, places)
        agents.append(_standing(AgentType.PEDESTRIAN, _at(ground, lane, worker), ground))
    return tuple(agents)


# Private


def _places(
    request: ConesRequest,
    ground: PlacingGround,
    distance_m: float,
    spacing_m: float,
    edge_m: float,
) -> list[Place]:
    count = request.count or 1
    gaps = max(count - 1, 1)
    along_m = spacing_m if request.reach_m is None else request.reach_m / gaps
    if along_m < 2.0 * _EDGE_M:
        raise CannotPlace(f"{count} cones have no room on {request.reach_m:g} m.")
    match request.shape:
        case Shape.RING:
            return _ring(distance_m, count, spacing_m, edge_m)
        case Shape.ROW:
            first_m = (count - 1) * spacing_m / 2.0
            return [(distance_m, first_m - index * spacing_m) for index in range(count)]
        case Shape.LINE:
            sides = (1.0, -1.0) if request.both_sides else (_line_side(request, ground),)
            return [
                (distance_m + index * along_m, side * edge_m)
                for side in sides
                for index in range(count)
            ]
    from_d_m = _sign(request.start or ground.kerb) * edge_m
    across_m = abs(from_d_m) if request.ends_in_middle else 2.0 * abs(from_d_m)
    if request.reach_m is not None:
        inwards_m = -math.copysign(across_m / gaps, from_d_m)
        return [(distance_m + i * along_m, from_d_m + i * inwards_m) for i in range(count)]
    return _taper(distance_m, count, spacing_m, from_d_m, across_m)


def _worker(request: ConesRequest, ground: PlacingGround, places: list[Place]) -> Place:
    """Where the worker stands: as said, else where people stand at such a shape."""
    if request.shape is Shape.RING:
        return sum(s for s, _ in places) / len(places), 0.0
    if request.post is Post.AT_LAST or request.post_side is not None:
        near = places[-2:] if request.post is Post.AT_LAST else places
        middle_m = sum(s for s, _ in near) / len(near)
        d_m = sum(d for _, d in near) / len(near)
        side = _sign(request.post_side or request.start or ground.kerb)
        return middle_m, d_m + side * _WORKER_GAP_M
    if request.shape is Shape.ROW:
        return places[0][0] + _WORKER_GAP_M, 0.0
    if request.shape is Shape.TAPER:
        return _behind_taper(places, _sign(request.start or ground.kerb))
    if request.post is Post.BEHIND:
        return places[-1][0] + _WORKER_GAP_M, places[-1][1]
    return _beside_line(places, ground, request.spot.lane)


def _taper(
    start_m: float, count: int, spacing_m: float, from_d_m: float, whole_m: float
) -> list[Place]:
    """Across `whole_m` of the lane, the neighbours `spacing_m` apart, as slanted as needed."""
    if count == 1:
        return [(start_m, from_d_m)]
    across_m = min(whole_m / (count - 1), spacing_m)
    along_m = math.sqrt(spacing_m**2 - across_m**2)
    inwards_m = -math.copysign(across_m, from_d_m)
    return [(start_m + i * along_m, from_d_m + i * inwards_m) for i in range(count)]


def _behind_taper(places: list[Place], sign: float) -> Place:
    """Beside the middle of a taper, on the side that it closes (beyond the cones, at `sign`)."""
    (first_s, first_d), (last_s, last_d) = places[0], places[-1]
    length_m = math.hypot(last_s - first_s, last_d - first_d)
    if length_m == 0.0:
        return first_s + _WORKER_GAP_M, first_d
    along, across = (last_s - first_s) / length_m, abs(last_d - first_d) / length_m
    middle_s, middle_d = (first_s + last_s) / 2.0, (first_d + last_d) / 2.0
    return middle_s + across * _WORKER_GAP_M, middle_d + sign * along * _WORKER_GAP_M


def _beside_line(places: list[Place], ground: PlacingGround, lane: LaneChoice | None) -> Place:
    """Beside the middle of a line: off the road if the line's outer side is, else in its lane."""
    middle_m, d_m = (places[0][0] + places[-1][0]) / 2.0, places[0][1]
    gap_m = math.copysign(_WORKER_GAP_M, d_m or _sign(ground.kerb))
    outside = (middle_m, d_m + gap_m)
    is_free = ground.lane_at(_at(ground, lane, outside).pose) is None
    return outside if is_free else (middle_m, d_m - gap_m)


def _ring(centre_m: float, count: int, spacing_m: float, widest_m: float) -> list[Place]:
    """A circle around the centre, or two rows in the lane where the lane is too narrow for it.

    An odd cone closes the rows towards the ego.
    """
    if count < 3:
        raise CannotPlace("A ring needs at least three cones.")
    radius_m = spacing_m / (2.0 * math.sin(math.pi / count))
    if radius_m <= widest_m:
        angles = (math.pi + 2.0 * math.pi * index / count for index in range(count))
        return [(centre_m + radius_m * math.cos(a), radius_m * math.sin(a)) for a in angles]
    side_m, rows = min(spacing_m / 2.0, widest_m), count // 2
    first_m = centre_m - (rows - 1) * spacing_m / 2.0
    along = [first_m + index * spacing_m for index in range(rows)]
    closing = [(first_m - math.sqrt(spacing_m**2 - side_m**2), 0.0)] if count % 2 else []
    return [*closing, *((s, -side_m) for s in along), *((s, side_m) for s in reversed(along))]


def _line_side(request: ConesRequest, ground: PlacingGround) -> float:
    """1 for the left boundary of the ego's direction, -1 for the right one, 0 for the centre."""
    lateral = request.spot.lateral
    return {
        LateralTarget.LANE_CENTRE: 0.0,
        LateralTarget.LEFT_BOUNDARY: 1.0,
        LateralTarget.RIGHT_BOUNDARY: -1.0,
        LateralTarget.KERB: _sign(ground.kerb),
        LateralTarget.CENTRE_LINE: _sign(ground.kerb.other),
    }[LateralTarget.LANE_CENTRE if lateral is None else lateral.target]


def _sign(side: Side) -> float:
    return 1.0 if side is Side.LEFT else -1.0


def _at(ground: PlacingGround, lane: LaneChoice | None, place: Place) -> LanePosition:
    """The place (s, d): s along the ego's lane, d from the centre of the lane asked for."""
    s_m, d_m = place
    centre = ground.beside(ground.along(s_m), lane)
    sign = -1.0 if lane is LaneChoice.ONCOMING else 1.0
    return ground.graph.place(centre.lane_id, centre.s_m, sign * d_m)


def _standing(kind: AgentType, place: LanePosition, ground: PlacingGround) -> TrafficAgent:
    length_m, width_m = LENGTH_WIDTH_M[kind]
    on_lane = abs(place.d_m) <= ground.lane(place).width_m / 2.0
    return TrafficAgent(
        id="",
        type=kind,
        x_m=place.pose.x_m,
        y_m=place.pose.y_m,
        heading_rad=place.pose.heading_rad,
        length_m=length_m,
        width_m=width_m,
        lane_id=place.lane_id if on_lane else ground.lane_at(place.pose),
    )
