"""Vehicles of the rule placer: one that stands or drives in a lane, or a row of them."""

from __future__ import annotations

import math

import numpy as np

from augment.baselines.rule_placer_ground import PlacingGround
from augment.errors import CannotPlace
from augment.geometry.frames import Pose, wrap
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import (
    Body,
    Facing,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
    Side,
    VehicleRequest,
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
