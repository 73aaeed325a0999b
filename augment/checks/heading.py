"""How a vehicle's heading turns away from the lane that it is on."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.lane_index import Beside
from augment.checks.situation import ChangedScene, is_stopped
from augment.geometry.angles import difference
from augment.scene.entities import AgentType, TrafficAgent

ALONG_BELOW_DEG = 30.0
OPPOSITE_ABOVE_DEG = 150.0
ROADSIDE_M = 3.0
"""Up to here off a lane a vehicle is parked beside it; further out no lane gives a direction."""

_STEERED = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE})


def heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed vehicle and bicycle against its lane, left positive.

    A fact up to 30 degrees, within an accident, on a car park and for a bicycle that stands;
    doubtful above. Against the traffic it is wrong for a vehicle that moves.
    """
    for agent in situation.changed:
        place = situation.under(agent) or situation.nearest(agent)
        if agent.type in _STEERED and place is not None and place.off_m <= ROADSIDE_M:
            yield _finding(agent, place, situation)


def _finding(agent: TrafficAgent, place: Beside, situation: ChangedScene) -> Finding:
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    if abs(turn_deg) > OPPOSITE_ABOVE_DEG:
        words = "against the direction of {lanes[0]} (turned by {turn_deg:.0f} degrees)"
    elif abs(turn_deg) < 0.5:
        words = "along {lanes[0]}"
    else:
        side = "left" if turn_deg >= 0.0 else "right"
        words = f"{{turn_deg:.0f}} degrees to the {side} of the direction of {{lanes[0]}}"
    severity = _severity(agent, abs(turn_deg), situation)
    there = ""
    if severity is not Severity.FACT:
        minus = "-" if place.tangent_rad < 0.0 else ""
        there = f", which is {minus}{{lane_heading_rad:.3f}} rad there"
    return Finding(
        kind=FindingKind.HEADING,
        severity=severity,
        agents=(agent.id,),
        lanes=(place.lane_id,),
        measured={"turn_deg": turn_deg, "lane_heading_rad": place.tangent_rad},
        template=f"{{agents[0]}} faces {words}{there}.",
    )


def _severity(agent: TrafficAgent, turn_deg: float, situation: ChangedScene) -> Severity:
    if turn_deg <= ALONG_BELOW_DEG or agent.id in situation.crashed:
        return Severity.FACT
    if is_stopped(agent) and _may_stand_askew(agent, situation):
        return Severity.FACT
    against = turn_deg > OPPOSITE_ABOVE_DEG and agent.type is not AgentType.BICYCLE
    return Severity.WRONG if against and not is_stopped(agent) else Severity.DOUBTFUL


def _may_stand_askew(agent: TrafficAgent, situation: ChangedScene) -> bool:
    in_carpark = situation.ground.carparks.distance_m(agent.x_m, agent.y_m) == 0.0
    return agent.type is AgentType.BICYCLE or in_carpark
