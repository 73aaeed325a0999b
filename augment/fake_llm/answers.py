"""What the stand-in says: the paper's five sections around a modification, with its numbers.

Frame: ego frame.
"""

from __future__ import annotations

import json
import math
from dataclasses import replace

from augment.fake_llm.sight import Task
from augment.prompts.vectors import compass
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.lane_graph import LaneGraph

SEES_NOTHING = "I can't find a scene and an instruction in what I was given."


def write_answer(task: Task, modification: Modification, summary: str) -> str:
    """A whole answer: the modification, and how its numbers come about."""
    return _sections(
        insights=_road(task.scene),
        summary=summary,
        changes=_change_list(modification),
        calculations="\n".join(_steps(task.scene, modification)) or "Nothing is to be computed.",
        block=block_of(modification),
    )


def write_refusal(task: Task, reason: str) -> str:
    """An honest answer to what was not understood: readable, and nothing changes."""
    return _sections(
        insights=f"{_road(task.scene)} I did not understand the instruction: {reason}",
        summary="The instruction is not clear to me, so I leave the scene as it is.",
        changes="none",
        calculations="none",
        block=block_of(Modification()),
    )


def renumber_added(modification: Modification, first_new: int) -> Modification:
    """The added agents numbered on from the first new id of the task."""
    added = (replace(a, id=f"Agent{first_new + n}") for n, a in enumerate(modification.added))
    return replace(modification, added=tuple(added))


def block_of(modification: Modification) -> dict[str, object]:
    """The machine-read block of a modification."""
    return {
        "add": [_fields(agent) for agent in modification.added],
        "move": [_fields(agent) for agent in modification.moved],
        "remove": list(modification.removed),
    }


def _sections(
    *, insights: str, summary: str, changes: str, calculations: str, block: dict[str, object]
) -> str:
    return (
        f"Insights: {insights}\n\nSummary: {summary}\n\nModification Dict: {changes}\n\n"
        f"Modification Calculations:\n{calculations}\n\n"
        f"Modified Vectors:\n```json\n{json.dumps(block, indent=1)}\n```\n"
    )


def _road(scene: Scene) -> str:
    lanes = len(scene.connectors)
    ego_lane = LaneGraph(scene).under(0.0, 0.0, 0.0) or "no lane"
    crossing = f" and {lanes} lane connectors" if lanes else ", no intersection"
    return (
        f"The scene has {len(scene.lanes)} lanes{crossing}; the ego is on {ego_lane} and drives "
        f"eastwards. Traffic keeps {scene.traffic_side.value}. "
        f"Besides the ego there are {len(scene.agents)} agents."
    )


def _change_list(modification: Modification) -> str:
    named = [("add", agent.id) for agent in modification.added]
    named += [("move", agent.id) for agent in modification.moved]
    named += [("remove", name) for name in modification.removed]
    return json.dumps([{"Action": action, "Modified_Agent": name} for action, name in named])


def _steps(scene: Scene, modification: Modification) -> list[str]:
    graph = LaneGraph(scene)
    route = EgoRoute.of(scene, graph)
    steps: list[str] = []
    for agent in modification.changed:
        nearest = graph.nearest(agent.x_m, agent.y_m)
        if nearest is None:
            continue
        lane_id, place = nearest
        line = graph.lanes[lane_id].centerline
        x_m, y_m = line.position(place.s_m)
        where = _ahead(graph, route, lane_id, place.s_m)
        steps.append(
            f"Step {len(steps) + 1}: {agent.id} lies {where}. The "
            f"centreline of {lane_id} is at ({x_m:.2f}, {y_m:.2f}) there and leads "
            f"{compass(line.heading_at(place.s_m))} ({line.heading_at(place.s_m):.3f} rad). "
            f"{abs(place.d_m):.2f} m to its {'left' if place.d_m >= 0.0 else 'right'} is "
            f"({agent.x_m:.2f}, {agent.y_m:.2f}); the heading is {agent.heading_rad:.3f} rad."
        )
    return steps


def _ahead(graph: LaneGraph, route: EgoRoute | None, lane_id: str, s_m: float) -> str:
    """Where a place on a way lies, along the lanes where the ego's own lead there."""
    line = graph.lane(lane_id).centerline
    if route is not None and lane_id in route.lane_ids:
        end_m = route.ends_m[route.lane_ids.index(lane_id)]
        along_m = end_m - line.length_m + s_m
        return f"{along_m:.2f} m along the lanes from the ego, on {lane_id}"
    x_m, y_m = line.position(s_m)
    return f"{math.hypot(x_m, y_m):.2f} m from the ego, on {lane_id}"


def _fields(agent: TrafficAgent) -> dict[str, object]:
    fields: dict[str, object] = {
        "id": agent.id,
        "type": agent.type.value,
        "x_m": round(agent.x_m, 3),
        "y_m": round(agent.y_m, 3),
        "heading_rad": round(agent.heading_rad, 4),
        "width_m": round(agent.width_m, 3),
        "length_m": round(agent.length_m, 3),
        "speed_mps": round(agent.speed_mps, 3),
        "lane": agent.lane_id,
    }
    if agent.type is AgentType.PEDESTRIAN and agent.walk_to_m is not None:
        fields["walk_to"] = [round(value, 3) for value in agent.walk_to_m]
    return fields
