"""The lane that an agent's own record names, against where the agent is."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene
from augment.scene.entities import TrafficAgent

TOLERANCE_M = 0.5
"""Beyond the lane's edge: whoever stands on the line may name either side."""


def lane_named(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful where an agent names a lane that it is not on, wrong where there is none such."""
    for agent in situation.changed:
        if agent.lane_id is not None and (finding := _finding(agent, agent.lane_id, situation)):
            yield finding


def _finding(agent: TrafficAgent, named: str, situation: ChangedScene) -> Finding | None:
    lane = situation.ground.graph.lanes.get(named)
    if lane is None:
        return Finding(
            kind=FindingKind.LANE_NAMED,
            severity=Severity.WRONG,
            agents=(agent.id,),
            lanes=(named,),
            template="{agents[0]} names {lanes[0]} as its lane, which the map does not have.",
        )
    near = [one.off_m for one in situation.beside[agent.id] if one.lane_id == named]
    far_m = lane.centerline.project(agent.x_m, agent.y_m).distance_m - lane.width_m / 2.0
    off_m = near[0] if near else far_m
    if off_m <= TOLERANCE_M:
        return None
    under = situation.under(agent)
    really = "on no lane" if under is None else "on {lanes[1]}"
    return Finding(
        kind=FindingKind.LANE_NAMED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id,),
        lanes=(named,) if under is None else (named, under.lane_id),
        measured={"off_named_lane_m": off_m},
        template=(
            "{agents[0]} names {lanes[0]} as its lane but is {off_named_lane_m:.1f} m off it, "
            f"{really}."
        ),
    )
