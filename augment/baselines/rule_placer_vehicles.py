"""Vehicles of the rule placer: one that stands or drives in a lane, and cars that have crashed."""

from __future__ import annotations

import math

import numpy as np

from augment.baselines.rule_placer_ground import Ground
from augment.errors import InstructionNotUnderstood
from augment.geometry.angles import wrap
from augment.geometry.boxes import Box, overlap
from augment.geometry.frames import Pose
from augment.instruction.intent import (
    SLIGHT_OFFSET_M,
    Body,
    CrashRequest,
    Facing,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
    Side,
    VehicleRequest,
)
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.lane_graph import PlaceOnWay
from augment.scene.sizes import LENGTH_WIDTH_M

_LENGTH_WIDTH_M: dict[Body, tuple[float, float]] = {
    Body.VEHICLE: LENGTH_WIDTH_M[AgentType.VEHICLE],
    Body.CAR: LENGTH_WIDTH_M[AgentType.VEHICLE],
    Body.VAN: (5.4, 2.0),
    Body.TRUCK: (8.0, 2.4),
    Body.BUS: LENGTH_WIDTH_M[AgentType.BUS],
}
_FACING_RAD = {
    Facing.WITH_LANE: 0.0,
    Facing.AGAINST_LANE: math.pi,
    Facing.ACROSS: math.pi / 2.0,
}
_EDGE_GAP_M = 0.1
"""What is left between a box at the edge of a lane and that edge."""

_CRASH_GAP_M = 0.05
_CRASH_TURNS_RAD = (math.radians(12.0), math.radians(-35.0), math.radians(30.0), -0.4)
"""How crashed cars are turned from the lane, the nearest first, where no angle is asked for."""

_CRASH_SIDES_M = (-0.4, 0.6, -0.5, 0.5)
"""How far left of the lane centre each of them stands."""


def vehicle(
    request: VehicleRequest, ground: Ground, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """The one vehicle that was asked for, its id still empty.

    Raises:
        InstructionNotUnderstood: There is no such lane or side, or the offset leaves the lane.
    """
    centre = ground.beside(ground.along(distance_m), request.spot.lane)
    d_m = _offset_m(request, ground, centre, rng)
    place = ground.graph.place(centre.way_id, centre.s_m, d_m)
    turn_rad = _FACING_RAD[request.facing] + math.radians(request.turn_deg)
    pose = Pose(
        x_m=place.pose.x_m,
        y_m=place.pose.y_m,
        heading_rad=wrap(place.pose.heading_rad + turn_rad),
    )
    return (_made(request.body, pose, place.way_id, request.speed_mps),)


def crash(
    request: CrashRequest, ground: Ground, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """Cars that touch or nearly touch, turned against each other, the nearest at the spot.

    Raises:
        InstructionNotUnderstood: The lanes end before the last of them, or there is no such lane.
    """
    del rng  # nothing about a crash is drawn
    poses = [_crash_pose(request, ground, distance_m, 0)]
    along_m = distance_m
    for index in range(1, request.count):
        length_m, width_m = _LENGTH_WIDTH_M[request.body]
        low_m, high_m = along_m, along_m + 2.0 * math.hypot(length_m, width_m)
        while high_m - low_m > 0.01:
            middle_m = (low_m + high_m) / 2.0
            pose = _crash_pose(request, ground, middle_m, index)
            touching = overlap(
                Box(pose=poses[-1], length_m=length_m, width_m=width_m),
                Box(pose=pose, length_m=length_m, width_m=width_m),
            ).depth_m
            low_m, high_m = (middle_m, high_m) if touching > 0.0 else (low_m, middle_m)
        along_m = high_m + _CRASH_GAP_M
        poses.append(_crash_pose(request, ground, along_m, index))
    return tuple(_made(request.body, pose, ground.lane_at(pose), 0.0) for pose in poses)


# Private


def _made(body: Body, pose: Pose, lane_id: str | None, speed_mps: float) -> TrafficAgent:
    length_m, width_m = _LENGTH_WIDTH_M[body]
    return TrafficAgent(
        id="",
        type=AgentType.BUS if body is Body.BUS else AgentType.VEHICLE,
        x_m=pose.x_m,
        y_m=pose.y_m,
        heading_rad=pose.heading_rad,
        length_m=length_m,
        width_m=width_m,
        speed_mps=speed_mps,
        lane_id=lane_id,
    )


def _crash_pose(request: CrashRequest, ground: Ground, distance_m: float, index: int) -> Pose:
    place = ground.beside(ground.along(distance_m), request.spot.lane)
    pose = ground.graph.place(place.way_id, place.s_m, _CRASH_SIDES_M[index]).pose
    turn_rad = _CRASH_TURNS_RAD[index]
    if request.turn_deg is not None:
        turn_rad = _CRASH_TURNS_RAD[0] + math.radians(request.turn_deg) * (index % 2)
    return Pose(x_m=pose.x_m, y_m=pose.y_m, heading_rad=wrap(pose.heading_rad + turn_rad))


def _offset_m(
    request: VehicleRequest, ground: Ground, place: PlaceOnWay, rng: np.random.Generator
) -> float:
    """How far left of the lane's own direction (right is negative) the box stands."""
    lateral = request.spot.lateral
    if lateral.target is LateralTarget.LANE_CENTRE:
        return 0.0
    side = _side(lateral, ground)
    at_kerb = lateral.target is LateralTarget.KERB and lateral.nearness is Nearness.AT_EDGE
    if (lateral.on_shoulder or at_kerb) and ground.has_neighbour(place, side):
        raise InstructionNotUnderstood(f"On the {side} is another lane, not the edge of the road.")
    half_lane_m = ground.way(place).width_m / 2.0
    half_box_m = _LENGTH_WIDTH_M[request.body][1] / 2.0
    if lateral.offset is not None:
        size_m = float(rng.uniform(lateral.offset.low_m, lateral.offset.high_m))
        if size_m > half_lane_m + half_box_m:
            raise InstructionNotUnderstood(f"An offset of {size_m:.1f} m leaves the lane.")
    else:
        size_m = {
            Nearness.SLIGHTLY: SLIGHT_OFFSET_M,
            Nearness.AT_EDGE: max(0.0, half_lane_m - half_box_m - _EDGE_GAP_M),
            Nearness.HALF_OUT: half_lane_m,
            Nearness.OUTSIDE: half_lane_m + half_box_m + _EDGE_GAP_M,
        }[lateral.nearness]
    to_left = (side is Side.LEFT) is not (request.spot.lane is LaneChoice.ONCOMING)
    return size_m if to_left else -size_m


def _side(lateral: Lateral, ground: Ground) -> Side:
    """The side of the ego's direction that a target is on, on this map."""
    side = {
        LateralTarget.LEFT_BOUNDARY: Side.LEFT,
        LateralTarget.RIGHT_BOUNDARY: Side.RIGHT,
        LateralTarget.KERB: ground.kerb,
        LateralTarget.CENTRE_LINE: ground.kerb.other,
    }[lateral.target]
    if lateral.on_shoulder and side is not ground.kerb:
        raise InstructionNotUnderstood(
            f"People drive on the {ground.kerb} here, so there is no shoulder on the {side}."
        )
    return side
