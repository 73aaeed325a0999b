"""Pedestrians of the rule placer: from one edge of the road across to the other."""

from __future__ import annotations

import math

import numpy as np

from augment.baselines.rule_placer_ground import PlacingGround
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Point, TrafficAgent
from augment.scene.intent import Side, WalkRequest

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
