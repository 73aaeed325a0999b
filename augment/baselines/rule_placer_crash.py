"""Accidents of the rule placer: cars that touch or nearly touch, turned against each other.

Where an intent says how they stand, each is put against the one before it; what it leaves open
is chosen so that they share as little ground as possible.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from augment.baselines.rule_placer_ground import PlacingGround
from augment.baselines.rule_placer_vehicles import FACING_RAD, SIZES_M, build_vehicle
from augment.errors import CannotPlace
from augment.geometry.frames import Box, Pose, overlap, wrap
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.intent import Bearing, Body, CrashedCar, CrashRequest, Facing

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
        pose = _at(before, toward_rad, size_m, heading_rad)
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
        pose = _at(before, toward_rad, middle_m, heading_rad)
        touches = _shared(body, before, pose) > 0.0
        low_m, high_m = (middle_m, high_m) if touches else (low_m, middle_m)
    return high_m + _GAP_M


def _at(before: Pose, toward_rad: float, size_m: float, heading_rad: float) -> Pose:
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
