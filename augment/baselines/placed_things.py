"""Vehicles of the rule placer: one that stands or drives in a lane, or a row of them."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from augment.baselines.placing_ground import PlacingGround
from augment.errors import CannotPlace
from augment.geometry.frames import Box, Pose, overlap, wrap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Point, Scene, TrafficAgent
from augment.scene.intent import (
    Bearing,
    Body,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
    Post,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.lane_graph import LanePosition

SIZES_M: dict[Body, tuple[float, float]] = {
    Body.VEHICLE: LENGTH_WIDTH_M[AgentType.VEHICLE],
    Body.CAR: LENGTH_WIDTH_M[AgentType.VEHICLE],
    Body.VAN: (5.4, 2.0),
    Body.TRUCK: (8.0, 2.4),
    Body.BUS: LENGTH_WIDTH_M[AgentType.BUS],
    Body.BICYCLE: LENGTH_WIDTH_M[AgentType.BICYCLE],
    Body.BARRIER: LENGTH_WIDTH_M[AgentType.BARRIER],
    Body.CONSTRUCTION_SIGN: LENGTH_WIDTH_M[AgentType.CONSTRUCTION_SIGN],
}
TYPES = {
    Body.BUS: AgentType.BUS,
    Body.BICYCLE: AgentType.BICYCLE,
    Body.BARRIER: AgentType.BARRIER,
    Body.CONSTRUCTION_SIGN: AgentType.CONSTRUCTION_SIGN,
}
"""Of the bodies that are no plain vehicle."""
FACING_RAD = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: math.pi, Facing.ACROSS: math.pi / 2.0}
_EDGE_GAP_M = 0.1
"""What is left between a box at the edge of a lane and that edge."""

BUMPER_GAP_M = 1.0
"""Between neighbours in a row, where no distance is said."""

SLIGHT_OFFSET_M = 0.75
"""What "slightly" means without a number: the middle of the paper's range of 0 to 1.5 m."""


def vehicle(
    request: VehicleRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """The vehicles that were asked for, one or a row, their ids still empty.

    Raises:
        CannotPlace: There is no such lane or side, or the offset leaves the lane.
    """
    apart_m = SIZES_M[request.body][0] + BUMPER_GAP_M
    if request.spacing is not None:
        apart_m = float(rng.uniform(request.spacing.low_m, request.spacing.high_m))
    centre = ground.beside(ground.along(distance_m), request.spot.lane)
    d_m = _offset_m(request, ground, centre, rng)
    return tuple(
        _vehicle(request, ground, distance_m + index * apart_m, d_m)
        for index in range(request.count or 1)
    )


def build_vehicle(body: Body, pose: Pose, lane_id: str | None, speed_mps: float) -> TrafficAgent:
    """A vehicle of that kind's size, its id still empty."""
    length_m, width_m = SIZES_M[body]
    return TrafficAgent(
        id="",
        type=TYPES.get(body, AgentType.VEHICLE),
        x_m=pose.x_m,
        y_m=pose.y_m,
        heading_rad=pose.heading_rad,
        length_m=length_m,
        width_m=width_m,
        speed_mps=speed_mps,
        lane_id=lane_id,
    )


# Private


def _vehicle(
    request: VehicleRequest, ground: PlacingGround, distance_m: float, d_m: float
) -> TrafficAgent:
    centre = ground.beside(ground.along(distance_m), request.spot.lane)
    place = ground.graph.place(centre.lane_id, centre.s_m, d_m)
    turn_rad = FACING_RAD[request.facing or Facing.WITH_LANE] + math.radians(request.turn_deg)
    pose = Pose(
        x_m=place.pose.x_m, y_m=place.pose.y_m, heading_rad=wrap(place.pose.heading_rad + turn_rad)
    )
    on_lane = abs(d_m) <= ground.lane(place).width_m / 2.0
    lane_id = place.lane_id if on_lane else None
    return build_vehicle(request.body, pose, lane_id, request.speed_mps or 0.0)


def _offset_m(
    request: VehicleRequest, ground: PlacingGround, place: LanePosition, rng: np.random.Generator
) -> float:
    """How far left of the lane's own direction (right is negative) the box stands."""
    lateral = request.spot.lateral
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return 0.0
    side = _side(lateral, ground)
    at_kerb = lateral.target is LateralTarget.KERB and lateral.nearness is Nearness.AT_EDGE
    if (lateral.on_shoulder or at_kerb) and ground.has_neighbour(place, side):
        raise CannotPlace(f"On the {side} is another lane, not the edge of the road.")
    half_lane_m = ground.lane(place).width_m / 2.0
    half_box_m = SIZES_M[request.body][1] / 2.0
    if lateral.offset is not None:
        size_m = float(rng.uniform(lateral.offset.low_m, lateral.offset.high_m))
        if size_m > half_lane_m + half_box_m:
            raise CannotPlace(f"An offset of {size_m:.1f} m leaves the lane.")
    else:
        size_m = {
            None: SLIGHT_OFFSET_M,
            Nearness.SLIGHTLY: SLIGHT_OFFSET_M,
            Nearness.AT_EDGE: max(0.0, half_lane_m - half_box_m - _EDGE_GAP_M),
            Nearness.HALF_OUT: half_lane_m,
            Nearness.OUTSIDE: half_lane_m + half_box_m + _EDGE_GAP_M,
        }[lateral.nearness]
    to_left = (side is Side.LEFT) is not (request.spot.lane is LaneChoice.ONCOMING)
    return size_m if to_left else -size_m


def _side(lateral: Lateral, ground: PlacingGround) -> Side:
    """The side of the ego's direction that a target is on, on this map."""
    sides = {
        LateralTarget.LEFT_BOUNDARY: Side.LEFT,
        LateralTarget.RIGHT_BOUNDARY: Side.RIGHT,
        LateralTarget.KERB: ground.kerb,
        LateralTarget.CENTRE_LINE: ground.kerb.other,
    }
    side = sides[lateral.target]
    if lateral.on_shoulder and side is not ground.kerb:
        raise CannotPlace(
            f"People drive on the {ground.kerb} here, so there is no shoulder on the {side}."
        )
    return side


WALK_S = 15.0
"""How long a walk takes in interPlan, whatever its length: 0.5 to 1.9 m/s."""

SHORTEST_M, LONGEST_M = 7.0, 29.0
"""interPlan's walks are 7 to 29 m long."""

_BEYOND_EDGE_M = 0.5
APART_M = 1.2


def walkers(
    request: WalkRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """The pedestrians: side by side 1.2 m apart along the road, or in a file behind the first.

    Raises:
        CannotPlace: The lanes end before.
    """
    start = _start(request)
    added = []
    for index in range(request.count or 1):
        behind_m = 0.0
        if request.is_file and index > 0:
            behind_m = _behind_m(request, index, rng)
        along_m = 0.0 if request.is_file else index * APART_M
        added.append(_walker(request, start, ground, distance_m + along_m, behind_m))
    return tuple(added)


def _start(request: WalkRequest) -> Side:
    assert request.start is not None  # the rule placer refuses an open one
    return request.start


def _behind_m(request: WalkRequest, index: int, rng: np.random.Generator) -> float:
    """How far behind the first one that one walks; 1.2 m from each to the next where open."""
    if index > len(request.behind):
        return index * APART_M
    asked = request.behind[index - 1]
    return float(rng.uniform(asked.low_m, asked.high_m))


def _walker(
    request: WalkRequest, start: Side, ground: PlacingGround, distance_m: float, behind_m: float
) -> TrafficAgent:
    place = ground.along(distance_m)
    if request.on_road:
        from_m = ground.lane(place).width_m / 4.0
    else:
        from_m = ground.road_edge_m(place.pose, start) + _BEYOND_EDGE_M
    arrives = ground.along(distance_m + (request.drift_m or 0.0)).pose
    to_m = ground.road_edge_m(arrives, start.other) + _BEYOND_EDGE_M
    sign = 1.0 if start is Side.LEFT else -1.0
    begin = place.pose.to_parent(np.array([[0.0, sign * (from_m + behind_m)]]))[0]
    end = arrives.to_parent(np.array([[0.0, -sign * to_m]]))[0]
    length_m = math.dist(begin, end)
    walked_m = min(max(length_m, SHORTEST_M), LONGEST_M)
    end = begin + (end - begin) * (walked_m / length_m)
    return _build_walker(ground, tuple(begin), tuple(end), request.speed_mps or walked_m / WALK_S)


def _build_walker(
    ground: PlacingGround, begin: Point, end: Point, speed_mps: float
) -> TrafficAgent:
    length_m, width_m = LENGTH_WIDTH_M[AgentType.PEDESTRIAN]
    return TrafficAgent(
        id="",
        type=AgentType.PEDESTRIAN,
        x_m=float(begin[0]),
        y_m=float(begin[1]),
        heading_rad=math.atan2(end[1] - begin[1], end[0] - begin[0]),
        length_m=length_m,
        width_m=width_m,
        speed_mps=round(speed_mps, 2),
        lane_id=ground.graph.under(float(begin[0]), float(begin[1])),
        walk_to_m=(float(end[0]), float(end[1])),
    )


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


_GAP_M = 0.05
_MOST_SHARED = 0.1
"""Crashed cars that people placed for interPlan share up to 5.6 % of a box."""

_TURNS_RAD = (math.radians(12.0), math.radians(-35.0), math.radians(30.0), -0.4)
"""How crashed cars are turned from the lane, the nearest first, where no angle is asked for."""

_SIDES_M = (-0.4, 0.6, -0.5, 0.5)
"""How far left of the lane centre each of them stands."""

_LOOSER = (1.0, 0.5, 0.0)
"""By how much of these turns and sides; less where the road is too narrow for them."""

_SHIFTS_M = (0.0, 0.25, -0.25, 0.5, -0.5)
"""How far left of the lane centre the first one stands where the others are told against it."""

_BEARINGS_RAD = {
    Bearing.AHEAD: 0.0,
    Bearing.BEHIND: math.pi,
    Bearing.LEFT: math.pi / 2.0,
    Bearing.RIGHT: -math.pi / 2.0,
}
_ASIDE_RAD = tuple(math.radians(sign * 8.0 * step) for step in range(6) for sign in (1.0, -1.0))
"""How far from the named direction a neighbour may stand."""

_COST_OF_TURN = 0.5


def count_arrangements(request: CrashRequest) -> int:
    """How many arrangements `crash` has for a request, the preferred one first."""
    return len(_SHIFTS_M if request.others else _LOOSER)


def crash(
    request: CrashRequest,
    ground: PlacingGround,
    distance_m: float,
    rng: np.random.Generator,
    *,
    arrangement: int = 0,
) -> tuple[TrafficAgent, ...]:
    """The crashed vehicles, the first at the spot.

    Args:
        request: What was asked for.
        ground: Where.
        distance_m: Of the first one, along the ego's lane.
        rng: Draws a gap from a range.
        arrangement: Which of those that `count_arrangements` counts.

    Raises:
        CannotPlace: The lanes end before the last of them, there is no such lane, or
            at the distance asked for they would stand in each other.
    """
    if request.others:
        poses = _chained(request, ground, distance_m, _SHIFTS_M[arrangement], rng)
    else:
        poses = _in_a_row(request, ground, distance_m, _LOOSER[arrangement])
    return tuple(build_vehicle(request.body, pose, ground.lane_at(pose), 0.0) for pose in poses)


# Private


def _in_a_row(
    request: CrashRequest, ground: PlacingGround, distance_m: float, looseness: float
) -> list[Pose]:
    """Each as near behind the one before as it can stand."""
    poses = [_row_pose(request, ground, distance_m, 0, looseness)]
    along_m = distance_m
    for index in range(1, request.count or 2):
        low_m, high_m = along_m, along_m + 2.0 * math.hypot(*SIZES_M[request.body])
        while high_m - low_m > 0.01:
            middle_m = (low_m + high_m) / 2.0
            pose = _row_pose(request, ground, middle_m, index, looseness)
            touches = _shared(request.body, poses[-1], pose) > 0.0
            low_m, high_m = (middle_m, high_m) if touches else (low_m, middle_m)
        along_m = high_m + _GAP_M
        poses.append(_row_pose(request, ground, along_m, index, looseness))
    return poses


def _row_pose(
    request: CrashRequest, ground: PlacingGround, distance_m: float, index: int, looseness: float
) -> Pose:
    place = ground.beside(ground.along(distance_m), request.spot.lane)
    pose = ground.graph.place(place.lane_id, place.s_m, looseness * _SIDES_M[index]).pose
    turn_rad = looseness * _TURNS_RAD[index]
    if index == 0:
        turn_rad += FACING_RAD[request.facing or Facing.WITH_LANE]
    return Pose(x_m=pose.x_m, y_m=pose.y_m, heading_rad=wrap(pose.heading_rad + turn_rad))


def _chained(
    request: CrashRequest,
    ground: PlacingGround,
    distance_m: float,
    left_m: float,
    rng: np.random.Generator,
) -> list[Pose]:
    """Each where the intent puts it against the one before."""
    centre = ground.beside(ground.along(distance_m), request.spot.lane)
    spot = ground.graph.place(centre.lane_id, centre.s_m, left_m)
    lane_rad = spot.pose.heading_rad
    turn_rad = FACING_RAD[request.facing or Facing.WITH_LANE]
    poses = [Pose(x_m=spot.pose.x_m, y_m=spot.pose.y_m, heading_rad=wrap(lane_rad + turn_rad))]
    for other in _everyone_after(request):
        gap_m = None
        if other.gap is not None:
            gap_m = float(rng.uniform(other.gap.low_m, other.gap.high_m))
        choices = list(_choices(request.body, other, poses, lane_rad, gap_m))
        poses.append(_best(choices, request.body, ground.scene, gap_m))
    return poses


def _everyone_after(request: CrashRequest) -> list[CrashedCar]:
    """What is said of each further one; of the last ones perhaps nothing."""
    unsaid = (request.count or 0) - 1 - len(request.others)
    return [*request.others, *[CrashedCar()] * unsaid]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Choice:
    """One way in which a vehicle could stand against the one before it, and what it costs."""

    pose: Pose
    shared: float
    cost: float


def _best(choices: list[_Choice], body: Body, scene: Scene, gap_m: float | None) -> Pose:
    """The cheapest that shares little ground with the others, if it can be none of the scene's."""
    fitting = [choice for choice in choices if choice.shared <= _MOST_SHARED]
    if not fitting:
        apart = "So near" if gap_m is None else f"{gap_m:g} m apart"
        raise CannotPlace(f"{apart} the cars would stand in each other.")
    ordered = sorted(fitting, key=lambda choice: choice.cost)
    return next((one for one in ordered if _is_free(one.pose, body, scene)), ordered[0]).pose


def _is_free(pose: Pose, body: Body, scene: Scene) -> bool:
    length_m, width_m = SIZES_M[body]
    box = Box(pose=pose, length_m=length_m, width_m=width_m)
    near = (
        agent
        for agent in scene.everyone
        if math.hypot(agent.x_m - pose.x_m, agent.y_m - pose.y_m) < 2.0 * length_m
    )
    return all(overlap(box, agent.box).depth_m == 0.0 for agent in near)


def _choices(
    body: Body, other: CrashedCar, poses: list[Pose], lane_rad: float, gap_m: float | None
) -> Iterator[_Choice]:
    before = poses[-1]
    for heading_rad, aside_rad in itertools.product(
        _headings(other, before.heading_rad, lane_rad), _ASIDE_RAD
    ):
        toward_rad = lane_rad + _BEARINGS_RAD[other.bearing or Bearing.AHEAD] + aside_rad
        size_m = gap_m
        if size_m is None:
            size_m = _touching_m(body, before, toward_rad, heading_rad)
        pose = _at_rule_placer_crash(before, toward_rad, size_m, heading_rad)
        shared = max(_shared(body, pose, one) for one in poses)
        off_lane = abs(wrap(heading_rad - lane_rad))
        if other.turn_deg is None:
            off_lane = 0.0
        cost = abs(aside_rad) + 10.0 * shared + _COST_OF_TURN * min(off_lane, math.pi - off_lane)
        yield _Choice(pose=pose, shared=shared, cost=round(cost, 6))


def _headings(other: CrashedCar, before_rad: float, lane_rad: float) -> list[float]:
    """The headings that the words allow; without any, a little turned from the lane."""
    if other.turn_deg is None:
        return [wrap(lane_rad + turn_rad) for turn_rad in _TURNS_RAD[1:3]]
    turn_rad = math.radians(other.turn_deg)
    turns = [turn_rad] if other.is_signed else [turn_rad, -turn_rad]
    return [wrap(before_rad + turn) for turn in turns]


def _touching_m(body: Body, before: Pose, toward_rad: float, heading_rad: float) -> float:
    """The smallest distance in that direction at which the two do not share ground."""
    low_m, high_m = 0.0, 2.0 * math.hypot(*SIZES_M[body])
    while high_m - low_m > 0.01:
        middle_m = (low_m + high_m) / 2.0
        pose = _at_rule_placer_crash(before, toward_rad, middle_m, heading_rad)
        touches = _shared(body, before, pose) > 0.0
        low_m, high_m = (middle_m, high_m) if touches else (low_m, middle_m)
    return high_m + _GAP_M


def _at_rule_placer_crash(
    before: Pose, toward_rad: float, size_m: float, heading_rad: float
) -> Pose:
    return Pose(
        x_m=before.x_m + size_m * math.cos(toward_rad),
        y_m=before.y_m + size_m * math.sin(toward_rad),
        heading_rad=heading_rad,
    )


def _shared(body: Body, one: Pose, other: Pose) -> float:
    """The share of a box that two of that kind have in common."""
    length_m, width_m = SIZES_M[body]
    shared = overlap(
        Box(pose=one, length_m=length_m, width_m=width_m),
        Box(pose=other, length_m=length_m, width_m=width_m),
    )
    return shared.share_of_first if shared.depth_m > 0.0 else 0.0
