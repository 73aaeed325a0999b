"""Vehicles of the rule placer: those that stand or drive in a lane, and those that have crashed.

Crashed ones touch or nearly touch, turned against each other. Where an intent says how they stand,
each is put against the one before it; what it leaves open is chosen so that they share as little
ground as possible.
"""

import itertools
import math
from collections.abc import Callable, Iterator

import numpy as np

from augment.baselines.placed_motions import find_arm, give_motion, is_on_other_arm
from augment.baselines.placing_ground import PlacingGround
from augment.checks.wish import BEARINGS_RAD
from augment.checks.wish_places import EDGE_GAP_M, find_across
from augment.errors import CannotPlace
from augment.geometry.frames import Box, Pose, overlap, wrap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import (
    Bearing,
    Body,
    CrashedCar,
    CrashRequest,
    Facing,
    LaneChoice,
    LateralTarget,
    Nearness,
    Request,
    Side,
    VehicleRequest,
)

_SIZES_M = {Body.VAN: (5.9, 2.0), Body.TRUCK: (8.0, 2.4)}
BUMPER_GAP_M = 1.0
"""Between neighbours in a row, where no distance is said."""
SLIGHT_OFFSET_M = 0.75
"""What "slightly" means without a number: the middle of the paper's range of 0 to 1.5 m."""
_INSIDE_M = {
    None: SLIGHT_OFFSET_M,
    Nearness.SLIGHTLY: SLIGHT_OFFSET_M,
    Nearness.OUTSIDE: EDGE_GAP_M,
}
"""How far inside of what is admitted something stands, from the lane's centre outwards."""

_CRASH_GAP_M = 0.05
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
_ASIDE_RAD = tuple(math.radians(sign * 8.0 * step) for step in range(6) for sign in (1.0, -1.0))
"""How far from the named direction a neighbour may stand."""
_COST_OF_TURN = 0.5


def _agent_type(body: Body) -> AgentType:
    return AgentType.__members__.get(body.name, AgentType.VEHICLE)


def _size_m(body: Body) -> tuple[float, float]:
    """Return length and width."""
    return _SIZES_M.get(body) or LENGTH_WIDTH_M[_agent_type(body)]


def place_vehicles(
    request: VehicleRequest, ground: PlacingGround, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """Return the vehicles that were asked for, one or a row, their ids still empty.

    Raises:
        CannotPlace: There is no such lane or side, or the offset leaves the lane.
    """
    lane, body, wish = request.spot.lane, request.body, request.motion
    if is_on_other_arm(wish):
        assert wish is not None
        speed_mps = request.speed_mps or 0.0
        pose, lane_id = find_arm(ground, wish.side, speed_mps, nearer_m=distance_m)
        vehicle = TrafficAgent.at(
            _agent_type(body), pose, _size_m(body), speed_mps=speed_mps, lane_id=lane_id
        )
        return (give_motion(wish, ground, vehicle, rng),)
    apart_m = request.spacing.draw(rng) if request.spacing else _size_m(body)[0] + BUMPER_GAP_M
    d_m = _offset_m(request, ground, distance_m, rng)
    open_to = Facing.ACROSS if body is Body.BARRIER else Facing.WITH_LANE
    facing_deg = (request.facing or open_to).turn_deg
    turn_rad = math.radians(facing_deg) + math.radians(request.turn_deg)
    added = []
    for index in range(request.count or 1):
        centre = ground.beside(distance_m + index * apart_m, lane)
        place = ground.graph.place(centre.lane_id, centre.s_m, d_m)
        on_lane = abs(d_m) <= ground.lane(place).width_m / 2.0
        agent = TrafficAgent.at(
            _agent_type(body),
            place.pose.turn(turn_rad),
            _size_m(body),
            speed_mps=request.speed_mps or 0.0,
            lane_id=place.lane_id if on_lane else None,
        )
        added.append(agent if wish is None else give_motion(wish, ground, agent, rng))
    return tuple(added)


def _offset_m(
    request: VehicleRequest | CrashRequest,
    ground: PlacingGround,
    distance_m: float,
    rng: np.random.Generator,
) -> float:
    """Return the box's offset to the left of the lane's direction (right is negative), in m."""
    lateral, lane = request.spot.lateral, request.spot.lane
    if lateral is None or lateral.target is LateralTarget.LANE_CENTRE:
        return 0.0
    place = ground.beside(distance_m, lane)
    # Sides are those of the ego's direction of travel, until here.
    is_left = (ground.side_sign(lateral, lane) > 0.0) is not (lane is LaneChoice.ONCOMING)
    side = Side.LEFT if is_left else Side.RIGHT
    if lateral.on_shoulder and side is not ground.kerb:
        raise CannotPlace(f"People drive on the {ground.kerb}: no shoulder on the {side}.")
    at_kerb = lateral.target is LateralTarget.KERB and lateral.nearness is Nearness.AT_EDGE
    if (lateral.on_shoulder or at_kerb) and ground.neighbour(place, side) is not None:
        raise CannotPlace(f"On the {side} is another lane, not the edge of the road.")
    half_lane_m = ground.lane(place).width_m / 2.0
    half_box_m = _size_m(request.body)[1] / 2.0
    if lateral.offset is not None:
        size_m = lateral.offset.draw(rng)
        is_beside = lateral.nearness is Nearness.OUTSIDE
        if size_m > half_lane_m + half_box_m and not is_beside:
            raise CannotPlace(f"An offset of {size_m:.1f} m leaves the lane.")
    else:
        low_m, _ = find_across(lateral, 1.0, 2.0 * half_lane_m, 2.0 * half_box_m)
        size_m = max(0.0, low_m) + _INSIDE_M.get(lateral.nearness, 0.0)
    return side.sign * size_m


def count_arrangements(request: Request) -> int:
    """Return how many arrangements there are of a request, the preferred one first."""
    if not isinstance(request, CrashRequest):
        return 1
    return len(_SHIFTS_M if request.others else _LOOSER)


def place_crash(
    request: CrashRequest,
    ground: PlacingGround,
    distance_m: float,
    rng: np.random.Generator,
    arrangement: int,
) -> tuple[TrafficAgent, ...]:
    """Return the crashed vehicles, the first at the spot, in one of `count_arrangements` ways.

    Raises:
        CannotPlace: The lanes end before the last of them, there is no such lane, or
            at the distance asked for they would stand in each other.
    """
    d_m = _offset_m(request, ground, distance_m, rng)
    if request.others:
        d_m += 0.0 if request.spot.lateral else _SHIFTS_M[arrangement]
        poses = _chain_poses(request, ground, distance_m, d_m, rng)
    else:
        poses = _in_a_row(request, ground, distance_m, d_m, _LOOSER[arrangement])
    kind = _agent_type(request.body)
    size_m = _size_m(request.body)
    return tuple(
        TrafficAgent.at(kind, pose, size_m, lane_id=ground.lane_at(pose)) for pose in poses
    )


def _in_a_row(
    request: CrashRequest, ground: PlacingGround, distance_m: float, offset_m: float, loose: float
) -> list[Pose]:
    """Put each as near behind the one before as it can stand."""
    poses: list[Pose] = []
    # The first stands as far from the lane's centre as is said.
    offset_m -= loose * _SIDES_M[0] if request.spot.lateral else 0.0
    along_m = distance_m
    for index in range(request.count or 2):
        first_rad = 0.0 if index else math.radians((request.facing or Facing.WITH_LANE).turn_deg)
        left_m = offset_m + loose * _SIDES_M[index]
        turn_rad = loose * _TURNS_RAD[index] + first_rad

        def pose_at(
            gap_m: float, from_m: float = along_m, left_m: float = left_m, rad: float = turn_rad
        ) -> Pose:
            place = ground.beside(from_m + gap_m, request.spot.lane)
            return ground.graph.place(place.lane_id, place.s_m, left_m).pose.turn(rad)

        gap_m = _touching_m(request.body, poses[-1], pose_at) if poses else 0.0
        poses.append(pose_at(gap_m))
        along_m += gap_m
    return poses


def _chain_poses(
    request: CrashRequest,
    ground: PlacingGround,
    distance_m: float,
    left_m: float,
    rng: np.random.Generator,
) -> list[Pose]:
    """Each where the intent puts it against the one before; of the last ones nothing is said."""
    centre = ground.beside(distance_m, request.spot.lane)
    spot = ground.graph.place(centre.lane_id, centre.s_m, left_m).pose
    poses = [spot.turn(math.radians((request.facing or Facing.WITH_LANE).turn_deg))]
    unsaid = (request.count or 0) - 1 - len(request.others)
    for other in [*request.others, *[CrashedCar()] * unsaid]:
        gap_m = None if other.gap is None else other.gap.draw(rng)
        choices = _choices(request.body, other, poses, spot.heading_rad, gap_m)
        ordered = [pose for _, pose in sorted(choices, key=lambda choice: choice[0])]
        if not ordered:
            apart = "So near" if gap_m is None else f"{gap_m:g} m apart"
            raise CannotPlace(f"{apart} the cars would stand in each other.")
        free = (pose for pose in ordered if _is_free(pose, request.body, ground))
        poses.append(next(free, ordered[0]))
    return poses


def _box(body: Body, pose: Pose) -> Box:
    length_m, width_m = _size_m(body)
    return Box(pose=pose, length_m=length_m, width_m=width_m)


def _is_free(pose: Pose, body: Body, ground: PlacingGround) -> bool:
    box = _box(body, pose)
    return all(
        overlap(box, agent.box).depth_m == 0.0
        for agent in ground.scene.everyone
        if math.hypot(agent.x_m - pose.x_m, agent.y_m - pose.y_m) < 2.0 * box.length_m
    )


def _choices(
    body: Body, other: CrashedCar, poses: list[Pose], lane_rad: float, gap_m: float | None
) -> Iterator[tuple[float, Pose]]:
    """Cost and pose of each way to stand against the one before that shares little ground.

    Without words about it, it is turned a little from the lane.
    """
    before = poses[-1]
    headings = [wrap(lane_rad + turn_rad) for turn_rad in _TURNS_RAD[1:3]]
    if other.turn_deg is not None:
        turn_rad = math.radians(other.turn_deg)
        turns = [turn_rad] if other.is_signed else [turn_rad, -turn_rad]
        headings = [wrap(before.heading_rad + turn) for turn in turns]
    for heading_rad, aside_rad in itertools.product(headings, _ASIDE_RAD):
        toward_rad = lane_rad + BEARINGS_RAD[other.bearing or Bearing.AHEAD] + aside_rad

        def pose_at(
            away_m: float, toward_rad: float = toward_rad, heading_rad: float = heading_rad
        ) -> Pose:
            x_m = before.x_m + away_m * math.cos(toward_rad)
            y_m = before.y_m + away_m * math.sin(toward_rad)
            return Pose(x_m=x_m, y_m=y_m, heading_rad=heading_rad)

        pose = pose_at(_touching_m(body, before, pose_at) if gap_m is None else gap_m)
        shared = max(_shared_area(body, pose, taken_pose) for taken_pose in poses)
        off_lane = 0.0 if other.turn_deg is None else abs(wrap(heading_rad - lane_rad))
        cost = abs(aside_rad) + 10.0 * shared + _COST_OF_TURN * min(off_lane, math.pi - off_lane)
        if shared <= _MOST_SHARED:
            yield round(cost, 6), pose


def _touching_m(body: Body, before: Pose, pose_at: Callable[[float], Pose]) -> float:
    """The smallest distance at which a pose does not share ground with the one before."""
    low_m, high_m = 0.0, 2.0 * math.hypot(*_size_m(body))
    while high_m - low_m > 0.01:
        middle_m = (low_m + high_m) / 2.0
        touches = _shared_area(body, before, pose_at(middle_m)) > 0.0
        low_m, high_m = (middle_m, high_m) if touches else (low_m, middle_m)
    return high_m + _CRASH_GAP_M


def _shared_area(body: Body, pose: Pose, other: Pose) -> float:
    """Return the share of a box that two of that kind have in common."""
    return overlap(_box(body, pose), _box(body, other)).share
