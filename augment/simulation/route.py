"""Which ways the ego is to take: given by where a recording went, else the straightest."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from augment.errors import CannotDrive
from augment.geometry.angles import difference
from augment.scene.ego_route import find_ego_lane
from augment.scene.entities import Lane, Scene, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Recording

ROUTE_M = 600.0
"""Collected ahead of the ego, as far as the map goes: 15 s at 20 m/s, and what a planner sees."""
_NEAR_M = 3.0
_ALIGNED_RAD = math.radians(60.0)


def find_route(scene: Scene, graph: LaneGraph, recording: Recording | None) -> tuple[str, ...]:
    """Ids of the ways from the one under the ego on; one way before it where the map has one.

    A scenario's goal comes before what was recorded: the way to the lane nearest to its place,
    or its turn where the lanes first part that way. Where neither can be reached without a lane
    change, the way is as without a goal.

    Raises:
        CannotDrive: There is no way under the ego or within 3 m of it.
    """
    start = _start(scene, graph)
    goal = _ways_to_goal(scene, graph)
    seen = Counter[str]() if recording is None else _driven(graph, recording)
    route = [start]
    length_m = graph.lane(start).centerline.length_m
    while length_m < ROUTE_M:
        options = [name for name in graph.successors(route[-1]) if name not in route]
        if not options:
            break
        # Of equally driven ones the first: successors come straightest first.
        route.append(max(options, key=lambda name: (name in goal, _support(graph, seen, name))))
        length_m += graph.lane(route[-1]).centerline.length_m
    before = [name for name in graph.predecessors(start) if name not in route]
    return (*before[:1], *route)


def beside_route(scene: Scene, graph: LaneGraph, route: tuple[str, ...]) -> frozenset[str]:
    """Ids of the route's ways, their neighbours of the same direction, and what joins these."""
    lanes = {lane.id: lane for lane in scene.lanes}
    names = set(route)
    waiting = [lanes[name] for name in route if name in lanes]
    while waiting:
        for name in _neighbours(waiting.pop()):
            if name in lanes and name not in names:
                names.add(name)
                waiting.append(lanes[name])
    joining = {
        connector.id
        for connector in scene.connectors
        if connector.from_lane in names and connector.to_lane in names
    }
    return frozenset(names | joining)


# Private


def _ways_to_goal(scene: Scene, graph: LaneGraph) -> frozenset[str]:
    """Ids of all ways from which the goal's lane or turn can be reached."""
    options = scene.options
    if options.goal_m is not None:
        nearest = graph.nearest(*options.goal_m)
        ends = [] if nearest is None else [nearest[0]]
    elif options.goal is not None:
        ends = _first_turns(scene, graph, options.goal)
    else:
        return frozenset()
    reaching = set(ends)
    while ends:
        ends = [name for end in ends for name in graph.predecessors(end) if name not in reaching]
        reaching.update(ends)
    return frozenset(reaching)


def _first_turns(scene: Scene, graph: LaneGraph, turn: TurnType) -> list[str]:
    """The first connector of that turn on the ways from the ego on, the fewest ways ahead."""
    connectors = {one.id: one for one in scene.connectors}
    ahead, seen = [_start(scene, graph)], set[str]()
    while ahead:
        fitting = [
            name for name in ahead if name in connectors and connectors[name].turn_type is turn
        ]
        if fitting:
            return fitting[:1]
        seen.update(ahead)
        ahead = [name for way in ahead for name in graph.successors(way) if name not in seen]
    return []


def _start(scene: Scene, graph: LaneGraph) -> str:
    ego = scene.ego
    own = find_ego_lane(scene, graph)
    if own is not None:
        beside = graph.lane(own).centerline.project(ego.x_m, ego.y_m)
        # A lane that the ego names but does not stand on leads it nowhere.
        if beside.distance_m <= max(_NEAR_M, graph.lane(own).width_m / 2.0):
            return own
    aligned = [
        name
        for name, way in graph.lanes.items()
        for place in [way.centerline.project(ego.x_m, ego.y_m)]
        if place.distance_m <= _NEAR_M
        and abs(difference(way.centerline.heading_at(place.s_m), ego.heading_rad)) < _ALIGNED_RAD
    ]
    nearest = graph.nearest(ego.x_m, ego.y_m, among=aligned)
    if nearest is None:
        raise CannotDrive(
            f"Scene {scene.name} can't be driven: no lane leads the ego's way within "
            f"{_NEAR_M:g} m of it."
        )
    return nearest[0]


def _driven(graph: LaneGraph, recording: Recording) -> Counter[str]:
    """How many moments of the recorded ego lie on each way, in its direction."""
    counts = Counter[str]()
    states = recording.ego[~np.isnan(recording.ego).any(axis=1)]
    for lane_id, way in graph.lanes.items():
        for x_m, y_m, heading_rad, _ in states:
            place = way.centerline.project(float(x_m), float(y_m))
            turn = difference(way.centerline.heading_at(place.s_m), float(heading_rad))
            if place.distance_m <= way.width_m / 2.0 and abs(turn) < _ALIGNED_RAD:
                counts[lane_id] += 1
    return counts


def _support(graph: LaneGraph, seen: Counter[str], lane_id: str) -> int:
    """How much of the recorded drive lies on a way and, at best, on one that follows it."""
    after = graph.successors(lane_id)
    return seen[lane_id] + max((seen[name] for name in after), default=0)


def _neighbours(lane: Lane) -> list[str]:
    return [name for name in (lane.left_neighbor, lane.right_neighbor) if name is not None]
