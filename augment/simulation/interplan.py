"""What interPlan's score adds to nuPlan's: obstacles to be passed, a goal lane, other roles."""

from __future__ import annotations

import numpy as np

from augment.scene.catalogue import ScenarioType
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.modification import Modification
from augment.simulation.drive import Drive
from augment.simulation.expert import Expert
from augment.simulation.metric import Metric
from augment.simulation.progress import progress_ratio
from augment.simulation.states import IntArray

OFF_GOAL_LANE = 0.5
NO_START = 0.2607
_DETOUR = (
    ScenarioType.CONSTRUCTION_ZONE,
    ScenarioType.ACCIDENT_SITE,
    ScenarioType.NUDGE,
    ScenarioType.OVERTAKE,
)


def allows_detour(scenario_type: ScenarioType | None) -> bool:
    """Whether the other direction's lane may be used: direction is then a weight of 1."""
    return scenario_type in _DETOUR


def passed_obstacles(drive: Drive, expert: Expert, modification: Modification | None) -> Metric:
    """1 if the ego's share of the expert's way reaches beyond the furthest obstacle's."""
    places = _obstacles(modification)
    ratio = progress_ratio(drive, expert)
    wanted = 0.0
    if places and expert.progress_m > 0.0:
        stations, _ = drive.road.centreline.beside(np.array(places))
        along = np.clip(stations - expert.start_m, 0.0, expert.progress_m)
        wanted = float(along.max()) / expert.progress_m
    return Metric(
        name="ego_passed_obstacles",
        value=float(ratio >= wanted),
        parts={"ratio": ratio, "wanted_ratio": wanted},
    )


def lane_changes_to_goal(drive: Drive, ways: IntArray) -> Metric:
    """1 if the drive ends on the route, 0.5 elsewhere; our goals never need a lane change."""
    on_start, on_end = (_on_route(drive, int(way)) for way in ways[[0, -1]])
    value = NO_START if not on_start else 1.0 if on_end else OFF_GOAL_LANE
    return Metric(name="lane_changes_to_goal", value=value, weight=4.0)


def _on_route(drive: Drive, way: int) -> bool:
    return way >= 0 and drive.road.names[way] in drive.road.route


def _obstacles(modification: Modification | None) -> list[tuple[float, float]]:
    """Standing vehicles, cones, and where walks end."""
    changed = () if modification is None else modification.changed
    made = []
    for agent in changed:
        if agent.walk_to_m is not None:
            made.append(agent.walk_to_m)
        elif _stands(agent):
            made.append((agent.x_m, agent.y_m))
    return made


def _stands(agent: TrafficAgent) -> bool:
    vehicle = agent.type in (AgentType.VEHICLE, AgentType.BUS) and agent.speed_mps <= 0.0
    return vehicle or agent.type is AgentType.TRAFFIC_CONE
