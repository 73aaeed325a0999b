"""The distance from the ego to an agent along the lanes, the way instructions count it."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.lane_index import Beside
from augment.checks.situation import ChangedScene
from augment.scene.entities import TrafficAgent

FAR_M = 15.0
"""Further than this beside the ego's lanes a distance along them says nothing."""


def lane_distance(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent on a map that has a lane for the ego.

    `along_lanes_m` is None where no chain of successors leads from the ego to the agent's lane
    or back (then it would be negative); `level_m` and `beside_m` then tell where the agent is
    beside the lanes that can be reached, on the oncoming lane for example.
    """
    if situation.ground.route is None:
        return
    for agent in situation.changed:
        yield _finding(agent, situation)


def _finding(agent: TrafficAgent, situation: ChangedScene) -> Finding:
    reached = _reached(agent, situation)
    if reached is None:
        return Finding(
            kind=FindingKind.LANE_DISTANCE,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={"along_lanes_m": None, "level_m": None, "beside_m": None},
            template="No lane leads from the ego to the place of {agents[0]}.",
        )
    place, along_m = reached
    side = "ahead of" if along_m >= 0.0 else "behind"
    if place.covers:
        words = f"{{agents[0]}} is {{along_lanes_m:.1f}} m {side} the ego along the lanes."
    else:
        hand = "left" if place.d_m >= 0.0 else "right"
        words = (
            "No lane leads from the ego to the place of {agents[0]}: it is level with a point "
            f"{{level_m:.1f}} m {side} the ego along the lanes, {{beside_m:.1f}} m to the {hand} "
            "of the centre of {lanes[0]}."
        )
    return Finding(
        kind=FindingKind.LANE_DISTANCE,
        severity=Severity.FACT,
        agents=(agent.id,),
        lanes=(place.lane_id,),
        measured={
            "along_lanes_m": along_m if place.covers else None,
            "level_m": along_m,
            "beside_m": place.d_m,
        },
        template=words,
    )


def _reached(agent: TrafficAgent, situation: ChangedScene) -> tuple[Beside, float] | None:
    """The nearest lane that the ego reaches or came from, and how far along it the agent is."""
    places = {place.lane_id: place for place in situation.beside[agent.id]}
    candidates = [
        (place, start_m + place.s_m)
        for lane_id, start_m in situation.ground.starts_m
        if (place := places.get(lane_id)) and (place.covers or place.distance_m <= FAR_M)
    ]
    return min(
        candidates,
        key=lambda one: (round(one[0].distance_m, 4), round(abs(one[1]), 4)),
        default=None,
    )
