"""Traffic spawned at a density in place of the recorded one, after interPlan's rules.

Each lane of the ego's roadblock (its lanes of one direction), 50 m longer both ways but not past
a traffic light, is filled from its far end backwards, at gaps drawn from 10 m up to the density's
widest; so are the roadblocks under further places that a scenario names. Frame: ego frame.
"""

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from augment.geometry.frames import Pose, overlap
from augment.geometry.polyline import Polyline
from augment.scene.ego_route import find_ego_lane
from augment.scene.entities import (
    LENGTH_WIDTH_M,
    AgentType,
    Lane,
    LaneConnector,
    Point,
    Scene,
    TrafficAgent,
    TrafficDensity,
    TrafficLight,
)
from augment.scene.lane_graph import LaneGraph

FIRST_ID = 101
"""Spawned agents are numbered from here, so that the ids of a change stay clear of them."""
NARROWEST_M = 10
WIDEST_M = {TrafficDensity.HIGH: 33, TrafficDensity.MEDIUM: 50, TrafficDensity.LOW: 100}
BEYOND_M = 50.0
DECEL_MPS2 = 2.0
CLEAR_S = 2.0
"""Who would reach something of the change at a constant speed in this time is not spawned."""
_FALLBACK_MPS = 10.0
_ROLLS_MPS = 1.0
_LIGHTS = (TrafficLight.RED, TrafficLight.YELLOW, TrafficLight.GREEN)


@dataclass(frozen=True, slots=True, kw_only=True)
class ExtraAgent:
    """One vehicle that a scenario names by itself; it is put on the nearest lane."""

    x_m: float
    y_m: float
    speed_mps: float


def spawn_traffic(
    scene: Scene,
    density: TrafficDensity,
    *,
    seed: str,
    roadblocks_m: Sequence[Point] = (),
    extras: Sequence[ExtraAgent] = (),
    clear_of: Sequence[TrafficAgent] = (),
) -> tuple[TrafficAgent, ...]:
    """Return the vehicles of that density, the nearest first; the same for the same seed.

    Args:
        scene: Cleared of the recorded traffic.
        density: None of it spawns nothing.
        seed: A text; interPlan takes the base token.
        roadblocks_m: Places on further roadblocks to fill.
        extras: Vehicles that stand in the scenario one by one.
        clear_of: Who is spawned has 2 s at its speed to all of these.
    """
    if density is TrafficDensity.NONE:
        return ()
    graph = LaneGraph(scene)
    blocks = [find_ego_lane(scene, graph), *(graph.under(*place) for place in roadblocks_m)]
    lanes = dict.fromkeys(
        name for block in blocks if block is not None for name in _roadblock(graph, block)
    )
    rng = random.Random(seed)
    wished = [
        agent for name in lanes for agent in _on_lane(scene, graph, name, WIDEST_M[density], rng)
    ]
    for extra in extras:
        nearest = graph.nearest(extra.x_m, extra.y_m)
        if nearest is not None:
            pose = graph.place(nearest[0], nearest[1].s_m).pose
            wished.append(_vehicle(graph, pose, extra.speed_mps))
    kept: list[TrafficAgent] = []
    for agent in wished:
        ahead_m = CLEAR_S * agent.speed_mps
        way = replace(
            agent,
            x_m=agent.x_m + ahead_m / 2.0 * math.cos(agent.heading_rad),
            y_m=agent.y_m + ahead_m / 2.0 * math.sin(agent.heading_rad),
            length_m=agent.length_m + ahead_m,
        )
        if not _meets(agent, scene.everyone + tuple(kept)) and not _meets(way, clear_of):
            kept.append(agent)
    kept.sort(key=lambda agent: (math.hypot(agent.x_m, agent.y_m), agent.x_m))
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(kept, start=FIRST_ID)
    )


# Private


def _meets(agent: TrafficAgent, others: Sequence[TrafficAgent]) -> bool:
    return any(overlap(agent.box, other.box).depth_m > 0.0 for other in others)


def _roadblock(graph: LaneGraph, lane_id: str) -> tuple[str, ...]:
    """The lane and its neighbours of the same direction; connectors that join such lanes alike."""
    way = graph.lane(lane_id)
    if isinstance(way, Lane):
        return graph.abreast(lane_id)
    begins, ends = (
        graph.abreast(name) if isinstance(graph.lanes.get(name or ""), Lane) and name else ()
        for name in (way.from_lane, way.to_lane)
    )
    return tuple(
        one.id
        for one in graph.lanes.values()
        if one is way
        or (isinstance(one, LaneConnector) and one.from_lane in begins and one.to_lane in ends)
    )


def _extended(graph: LaneGraph, lane_id: str) -> list[str]:
    """The lane with what leads to it and follows it, 50 m each way or to a traffic light."""
    names = [lane_id]
    for forwards in (False, True):
        missing_m, here = BEYOND_M, lane_id
        while missing_m > 0.0:
            options = graph.successors(here) if forwards else graph.predecessors(here)
            here = next((name for name in options if name not in names), "")
            way = graph.lanes.get(here)
            if way is None or (isinstance(way, LaneConnector) and way.traffic_light in _LIGHTS):
                break
            names.insert(len(names) if forwards else 0, here)
            missing_m -= way.centerline.length_m
    return names


def _on_lane(
    scene: Scene, graph: LaneGraph, lane_id: str, widest_m: int, rng: random.Random
) -> Iterator[TrafficAgent]:
    """Vehicles as fast as the ego, as interPlan's released code has it.

    Behind a gap, where the ego stands.
    """
    names = _extended(graph, lane_id)
    lines = [graph.lane(name).centerline for name in names]
    line = Polyline([point for one in lines for point in one.points_m.tolist()])
    first = names.index(lane_id)
    begins_m = sum(one.length_m for one in lines[:first])
    from_m = max(0.0, begins_m - BEYOND_M)
    here_m = min(line.length_m, begins_m + lines[first].length_m + BEYOND_M)
    ego = line.project(scene.ego.x_m, scene.ego.y_m)
    is_egos = lane_id == find_ego_lane(scene, graph)
    limit_mps = graph.lane(lane_id).speed_limit_mps or _FALLBACK_MPS
    while True:
        gap_m = rng.randint(NARROWEST_M, widest_m)
        here_m -= gap_m
        if here_m < from_m:
            return
        if is_egos and abs(here_m - ego.s_m) < NARROWEST_M:
            here_m = ego.s_m  # the slot is the ego's
            continue
        speed_mps = scene.ego.speed_mps
        if speed_mps < _ROLLS_MPS:
            speed_mps = math.sqrt(2.0 * DECEL_MPS2 * gap_m)
        yield _vehicle(graph, line.pose_at(here_m), min(limit_mps, speed_mps))


def _vehicle(graph: LaneGraph, pose: Pose, speed_mps: float) -> TrafficAgent:
    length_m, width_m = LENGTH_WIDTH_M[AgentType.VEHICLE]
    return TrafficAgent(
        id="",
        type=AgentType.VEHICLE,
        x_m=round(pose.x_m, 3),
        y_m=round(pose.y_m, 3),
        heading_rad=round(pose.heading_rad, 5),
        length_m=length_m,
        width_m=width_m,
        speed_mps=round(max(speed_mps, 0.0), 2),
        lane_id=graph.under(pose.x_m, pose.y_m, pose.heading_rad),
    )
