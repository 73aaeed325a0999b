"""How the stand-in uses its function: it asks where a place on a lane is, and takes the answer.

Frame: ego frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from augment.geometry.frames import difference, wrap
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph

TOOL = "pose_on_lane"
_MOST_CALLS = 8
_LANE = "lane"


def calls_for(scene: Scene, modification: Modification) -> list[dict[str, object]]:
    """The arguments of one call for each of the first added agents, in their order."""
    graph = LaneGraph(scene)
    return [_arguments(graph, scene.ego, agent) for agent in modification.added[:_MOST_CALLS]]


def with_results(
    scene: Scene, modification: Modification, results: Sequence[dict[str, object] | None]
) -> Modification:
    """The added agents where the function says; those without a result stay where they are."""
    graph = LaneGraph(scene)
    pairs = zip(modification.added, results, strict=False)
    placed = [agent if one is None else _placed(graph, agent, one) for agent, one in pairs]
    return replace(modification, added=(*placed, *modification.added[len(placed) :]))


def _arguments(graph: LaneGraph, ego: TrafficAgent, agent: TrafficAgent) -> dict[str, object]:
    nearest = graph.nearest(agent.x_m, agent.y_m)
    if nearest is None:
        return {"lane": "Lane1", "start": _LANE, "distance_m": 0.0}
    lane_id, place = nearest
    start, distance_m = _LANE, place.s_m
    if lane_id == ego.lane_id:
        start = ego.id
        distance_m -= graph.lane(lane_id).centerline.project(ego.x_m, ego.y_m).s_m
    return {
        "lane": lane_id,
        "start": start,
        "distance_m": round(distance_m, 3),
        "lateral_m": round(max(-30.0, min(30.0, place.d_m)), 3),
        "object": agent.type.value,
    }


def _placed(graph: LaneGraph, agent: TrafficAgent, result: dict[str, object]) -> TrafficAgent:
    """The agent at the pose, turned against the lane as before; its walk goes along."""
    nearest = graph.nearest(agent.x_m, agent.y_m)
    if nearest is None:
        return agent
    x_m, y_m, heading_rad = (float(str(result[n])) for n in ("x_m", "y_m", "heading_rad"))
    lane_rad = graph.lane(nearest[0]).centerline.heading_at(nearest[1].s_m)
    walk = agent.walk_to_m
    if walk is not None:
        walk = (walk[0] + x_m - agent.x_m, walk[1] + y_m - agent.y_m)
    return replace(
        agent,
        x_m=x_m,
        y_m=y_m,
        heading_rad=wrap(heading_rad + difference(agent.heading_rad, lane_rad)),
        walk_to_m=walk,
    )
