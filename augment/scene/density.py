"""Traffic spawned at a density in place of the recorded one, and boxes, after interPlan's rules.

Each lane of the ego's roadblock (its lanes of one direction, from left to right), with what leads
to it and follows it until 50 m behind the ego and ahead of it are there, but not past a traffic
light, is filled from its far end backwards, at gaps drawn from 10 m up to the density's widest;
so are the roadblocks under further places that a scenario names. The same draws from the same
random numbers in the same order as interPlan give the same vehicles. Frame: ego frame.
"""

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain, repeat

from augment.geometry.frames import Pose, overlap
from augment.geometry.polyline import Polyline
from augment.scene import entities
from augment.scene.ego_route import find_ego_lane
from augment.scene.entities import AgentType, LaneConnector, Scene, TrafficAgent, TrafficDensity
from augment.scene.lane_graph import LaneGraph

FIRST_ID = 101
"""Spawned agents are numbered from here, so that the ids of a change stay clear of them."""
# Gaps are whole metres, as interPlan draws them.
NARROWEST_M = 10
WIDEST_M = {TrafficDensity.HIGH: 33, TrafficDensity.MEDIUM: 50, TrafficDensity.LOW: 100}
"""No gap is as wide as this."""
BEYOND_M = 50.0
ACCEL_MPS2, DECEL_MPS2 = 1.0, 2.0
CLEAR_S = 2.0
"""Who would reach something of the change at a constant speed in this time is not spawned."""
BUS_LENGTH_M = 7.0
"""For interPlan, a vehicle from here on is a bus: clearly longer than any car."""
_FALLBACK_MPS = 10.0
_ROLLS_MPS, _CREEPS_MPS = 1.0, 0.01
"""Traffic around a slower ego has its own speed but in interPlan, and who has none is parked."""
_LIGHTS = (entities.TrafficLight.RED, entities.TrafficLight.YELLOW, entities.TrafficLight.GREEN)
_USUAL_M = repeat(entities.LENGTH_WIDTH_M[AgentType.VEHICLE])


@dataclass(frozen=True, slots=True, kw_only=True)
class SpawnedTraffic:
    """The vehicles, the nearest first, and the ego's speed among them; None where it keeps its."""

    agents: tuple[TrafficAgent, ...] = ()
    ego_mps: float | None = None


def spawn_traffic(
    scene: Scene,
    density: TrafficDensity,
    *,
    rng: random.Random,
    boxes_m: Iterator[tuple[float, float]] = _USUAL_M,
    roadblocks_m: Sequence[entities.Point] = (),
    extras: Sequence[tuple[float, float, float]] = (),
) -> SpawnedTraffic:
    """Return the vehicles of that density; the same for the same random numbers.

    Args:
        scene: Cleared of the recorded traffic.
        density: None of it spawns nothing.
        rng: interPlan seeds it with the base token.
        boxes_m: Length and width of one vehicle after the other; also who is not kept takes one.
        roadblocks_m: Places on further roadblocks to fill.
        extras: Place and speed of vehicles that a scenario names one by one; each is put on the
            nearest lane.
    """
    if density is TrafficDensity.NONE:
        return SpawnedTraffic()
    graph = LaneGraph(scene)
    blocks = [find_ego_lane(scene, graph), *(graph.under(*place) for place in roadblocks_m)]
    own, *others = [() if name is None else _roadblock(graph, name) for name in blocks]
    after = {_roadblock(graph, end) for name in own for end in graph.successors(name)}
    ego_mps, places = None, list[tuple[Pose, float]]()
    for name in chain(own, *others):
        widest_m, has_one_exit = WIDEST_M[density], len(after) == 1
        for pose, mps in _fill(scene, graph, name, widest_m, rng, has_one_exit=has_one_exit):
            ego_mps = mps if pose is None else ego_mps
            places += [] if pose is None else [(pose, mps)]
    for x_m, y_m, mps in extras:
        nearest = graph.nearest(x_m, y_m)
        places += [] if nearest is None else [(graph.place(nearest[0], nearest[1].s_m).pose, mps)]
    rolls = scene.ego.speed_mps >= _ROLLS_MPS or scene.options.interplan is not None
    spawned: list[TrafficAgent] = []
    for pose, mps in places:
        # Whoever has a speed gets the ego's recorded one, as interPlan's released code has it.
        speed_mps = max(scene.ego.speed_mps if mps and rolls else mps, _CREEPS_MPS)
        agent = _vehicle(graph, pose, speed_mps, next(boxes_m))
        strips = [] if agent.lane_id in own else list(map(_strip, spawned))
        if not _meets(agent, [scene.ego, *spawned]) and not _meets(_strip(agent), strips):
            spawned.append(agent)
    return SpawnedTraffic(agents=keep_clear(spawned), ego_mps=ego_mps)


def keep_clear(
    agents: Sequence[TrafficAgent], clear_of: Sequence[TrafficAgent] = ()
) -> tuple[TrafficAgent, ...]:
    """Return spawned vehicles that have 2 s at their speed to all of these, numbered anew."""
    cleared = [agent for agent in agents if not _meets(_strip(agent), clear_of)]
    cleared.sort(key=lambda agent: (math.hypot(agent.x_m, agent.y_m), agent.x_m))
    return tuple(
        replace(agent, id=f"Agent{number}") for number, agent in enumerate(cleared, start=FIRST_ID)
    )


def is_bus(agent: TrafficAgent, scene: Scene) -> bool:
    """Return whether interPlan has an agent as its bus; a long box that it gives makes none."""
    rules = scene.options.interplan
    if agent.type is not AgentType.VEHICLE or (rules and agent.size_m in (rules.boxes_m or ())):
        return agent.type is AgentType.BUS
    return agent.length_m >= BUS_LENGTH_M


def fit_boxes(scene: Scene, modification: entities.Modification) -> entities.Modification:
    """Return the change with the boxes that interPlan will use, where they are known."""
    rules, fitted = scene.options.interplan, []
    if rules is None or rules.boxes_m is None:
        return modification
    left = iter(rules.boxes_m)
    for agent in modification.added:
        size_m = agent.size_m
        if is_bus(agent, scene):
            size_m = entities.LENGTH_WIDTH_M[AgentType.BUS]
        elif agent.type is AgentType.VEHICLE:
            size_m = next(left, scene.ego.size_m)
        elif agent.type in (AgentType.PEDESTRIAN, AgentType.TRAFFIC_CONE):
            size_m = entities.LENGTH_WIDTH_M[agent.type]
        fitted.append(replace(agent, length_m=size_m[0], width_m=size_m[1]))
    return replace(modification, added=tuple(fitted))


def usual_size_m(scene: Scene, kind: AgentType) -> tuple[float, float]:
    """Return the length and width of what is added; a vehicle of interPlan's has its next box."""
    rules = scene.options.interplan
    if rules is None or rules.boxes_m is None or kind is not AgentType.VEHICLE:
        return entities.LENGTH_WIDTH_M[kind]
    return next(iter(rules.boxes_m), scene.ego.size_m)


# Private


def _strip(agent: TrafficAgent) -> TrafficAgent:
    """The agent as long as what it covers in 2 s at its speed."""
    # The box grows ahead, so its middle moves by half of that.
    ahead_m = CLEAR_S * agent.speed_mps
    return replace(
        agent,
        x_m=agent.x_m + ahead_m / 2.0 * math.cos(agent.heading_rad),
        y_m=agent.y_m + ahead_m / 2.0 * math.sin(agent.heading_rad),
        length_m=agent.length_m + ahead_m,
    )


def _meets(agent: TrafficAgent, others: Sequence[TrafficAgent]) -> bool:
    return any(overlap(agent.box, other.box).depth_m > 0.0 for other in others)


def _roadblock(graph: LaneGraph, lane_id: str) -> tuple[str, ...]:
    """The lane and its neighbours of the same direction; connectors that join such lanes alike.

    Lanes from left to right, in which order nuPlan numbers them.
    """
    way = graph.lane(lane_id)
    if isinstance(way, entities.Lane):
        # The middle of the way, seen from a lane to its left, lies to the right.
        middle = way.centerline.position(way.centerline.length_m / 2.0)
        offsets = {
            n: graph.lane(n).centerline.project(*middle).d_m for n in graph.abreast(lane_id)
        }
        return tuple(sorted(offsets, key=lambda name: offsets[name]))
    begins, ends = (
        graph.abreast(name)
        if isinstance(graph.lanes.get(name or ""), entities.Lane) and name
        else ()
        for name in (way.from_lane, way.to_lane)
    )
    return tuple(
        lane.id
        for lane in graph.lanes.values()
        if lane is way
        or (isinstance(lane, LaneConnector) and lane.from_lane in begins and lane.to_lane in ends)
    )


def _extend(scene: Scene, graph: LaneGraph, lane_id: str) -> list[str]:
    """The lane with what leads to it and follows it, 50 m from the ego or to a traffic light."""
    # interPlan's map says which connectors have no light at all; another map may not know.
    is_told = scene.options.interplan is not None
    lights = (*_LIGHTS, entities.TrafficLight.UNKNOWN) if is_told else _LIGHTS
    names, line = [lane_id], graph.lane(lane_id).centerline
    ego_m = line.project(scene.ego.x_m, scene.ego.y_m).s_m
    for forwards, reach_m in ((False, ego_m), (True, line.length_m - ego_m)):
        here = lane_id
        while reach_m < BEYOND_M:
            options = graph.successors(here) if forwards else graph.predecessors(here)
            here = next((name for name in options if name not in names), "")
            way = graph.lanes.get(here)
            if way is None or (isinstance(way, LaneConnector) and way.traffic_light in lights):
                break
            names.insert(len(names) if forwards else 0, here)
            reach_m += way.centerline.length_m
    return names


def _fill(
    scene: Scene,
    graph: LaneGraph,
    lane_id: str,
    widest_m: int,
    rng: random.Random,
    *,
    has_one_exit: bool,
) -> Iterator[tuple[Pose | None, float]]:
    """Yield places from the front to the back with a speed each; None is where the ego is.

    The first is as fast as the limit, or slow enough to stop at the end; each further one slow
    enough to stop behind the one before it.
    """
    lines = [graph.lane(name).centerline for name in _extend(scene, graph, lane_id)]
    line = Polyline([point for part in lines for point in part.points_m.tolist()])
    ego_m = line.project(scene.ego.x_m, scene.ego.y_m).s_m
    is_egos = lane_id == find_ego_lane(scene, graph)
    limit_mps = graph.lane(lane_id).speed_limit_mps
    # s^2/m: share * v^2 is three times the way to a stop, v^2 / (2 DECEL_MPS2).
    share, speed_mps, here_m = 3.0 / (2.0 * DECEL_MPS2), -1.0, line.length_m
    while True:
        gap_m = float(rng.randrange(NARROWEST_M, widest_m))
        here_m -= gap_m
        if here_m < 0.0:
            return
        # On its own lane the ego takes the place that falls within 10 m of it.
        is_ego = is_egos and abs(here_m - ego_m) < NARROWEST_M
        if is_ego:
            gap_m, here_m = gap_m + here_m - ego_m, ego_m
        if speed_mps >= 0.0:
            delay_s = max(rng.gauss(0.25, 0.05), 0.1)
            way_m = share * speed_mps**2 + gap_m
            # The speed v that solves share v^2 + delay v = way.
            root = math.sqrt(delay_s**2 + 4.0 * share * way_m)
            # The gap is at least 2 s of way.
            speed_mps = min(gap_m / 2.0, (root - delay_s) / (2.0 * share))
        elif has_one_exit:
            speed_mps = limit_mps or _FALLBACK_MPS
        else:
            # way = 3 v^2 / (2 a), solved for v.
            speed_mps = math.sqrt(2.0 / 3.0 * (line.length_m - here_m) * ACCEL_MPS2)
        speed_mps = max(min(speed_mps + rng.gauss(0.0, 1.0), limit_mps or math.inf), 0.0)
        yield None if is_ego else line.pose_at(here_m), speed_mps


def _vehicle(
    graph: LaneGraph, pose: Pose, speed_mps: float, size_m: tuple[float, float]
) -> TrafficAgent:
    lane_id = graph.under(pose.x_m, pose.y_m, pose.heading_rad)
    at = Pose(
        x_m=round(pose.x_m, 3), y_m=round(pose.y_m, 3), heading_rad=round(pose.heading_rad, 5)
    )
    speed_mps = round(speed_mps, 2)
    return TrafficAgent.at(AgentType.VEHICLE, at, size_m, speed_mps=speed_mps, lane_id=lane_id)
