"""Pedestrians of the rule placer: from one edge of the road straight across to the other."""

from __future__ import annotations

import numpy as np

from augment.baselines.rule_placer_ground import Ground
from augment.geometry.angles import wrap
from augment.instruction.intent import Side, WalkRequest
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.sizes import LENGTH_WIDTH_M

WALK_S = 15.0
"""How long a walk takes in interPlan, whatever its length: 0.5 to 1.9 m/s."""

SHORTEST_M, LONGEST_M = 7.0, 29.0
"""interPlan's walks are 7 to 29 m long."""

_BEYOND_EDGE_M = 0.5
_APART_M = 1.2


def walkers(
    request: WalkRequest, ground: Ground, distance_m: float, rng: np.random.Generator
) -> tuple[TrafficAgent, ...]:
    """The pedestrians, the first at the distance and each further one 1.2 m further on.

    Raises:
        InstructionNotUnderstood: The lanes end before.
    """
    del rng  # nothing about a walk is drawn
    return tuple(
        _walker(request.start, ground, distance_m + index * _APART_M)
        for index in range(request.count)
    )


def _walker(start: Side, ground: Ground, distance_m: float) -> TrafficAgent:
    centre = ground.along(distance_m).pose
    sign = 1.0 if start is Side.LEFT else -1.0
    from_m = ground.road_edge_m(centre, start) + _BEYOND_EDGE_M
    to_m = ground.road_edge_m(centre, start.other) + _BEYOND_EDGE_M
    length_m = min(max(from_m + to_m, SHORTEST_M), LONGEST_M)
    across_m = np.array([[0.0, sign * from_m], [0.0, sign * (from_m - length_m)]])
    begin, end = centre.to_parent(across_m)
    box_length_m, box_width_m = LENGTH_WIDTH_M[AgentType.PEDESTRIAN]
    return TrafficAgent(
        id="",
        type=AgentType.PEDESTRIAN,
        x_m=float(begin[0]),
        y_m=float(begin[1]),
        heading_rad=wrap(centre.heading_rad - sign * np.pi / 2.0),
        length_m=box_length_m,
        width_m=box_width_m,
        speed_mps=round(length_m / WALK_S, 2),
        lane_id=None,
        walk_to_m=(float(end[0]), float(end[1])),
    )
