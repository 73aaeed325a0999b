"""Where changed agents look: against their lane or walk, and whether degrees were meant."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.lane_index import Beside
from augment.checks.situation import ChangedScene, is_stopped
from augment.geometry.frames import difference
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
            yield _heading_finding(agent, place, situation)


def _heading_finding(agent: TrafficAgent, place: Beside, situation: ChangedScene) -> Finding:
    turn_deg = math.degrees(difference(agent.heading_rad, place.tangent_rad))
    if abs(turn_deg) > OPPOSITE_ABOVE_DEG:
        words = "against the direction of {lanes[0]} (turned by {turn_deg:.0f} degrees)"
    elif abs(turn_deg) < 0.5:
        words = "along {lanes[0]}"
    else:
        side = "left" if turn_deg >= 0.0 else "right"
        words = f"{{turn_deg:.0f}} degrees to the {side} of the direction of {{lanes[0]}}"
    severity = _heading_severity(agent, abs(turn_deg), situation)
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


def _heading_severity(agent: TrafficAgent, turn_deg: float, situation: ChangedScene) -> Severity:
    if turn_deg <= ALONG_BELOW_DEG or agent.id in situation.crashed:
        return Severity.FACT
    if is_stopped(agent) and _may_stand_askew(agent, situation):
        return Severity.FACT
    against = turn_deg > OPPOSITE_ABOVE_DEG and agent.type is not AgentType.BICYCLE
    return Severity.WRONG if against and not is_stopped(agent) else Severity.DOUBTFUL


def _may_stand_askew(agent: TrafficAgent, situation: ChangedScene) -> bool:
    in_carpark = situation.ground.carparks.distance_m(agent.x_m, agent.y_m) == 0.0
    return agent.type is AgentType.BICYCLE or in_carpark


WALKS_ALONG_BELOW_DEG = 30.0
BACKWARDS_ABOVE_DEG = 90.0
SHORT_M = 1.5
"""A step of a worker who stands has no direction that anybody would have to face."""

NOWHERE_M = 0.001
"""Below a millimetre the direction of a walk is rounding."""


def walk_heading(situation: ChangedScene) -> Iterator[Finding]:
    """The turn of every changed agent with a walk against it: doubtful above 30 degrees.

    Above 90 degrees, walking backwards, it is wrong.
    """
    for agent in situation.changed:
        if agent.walk_to_m is not None:
            yield _walk_finding(agent, *agent.walk_to_m)


def _walk_finding(agent: TrafficAgent, to_x_m: float, to_y_m: float) -> Finding:
    dx, dy = to_x_m - agent.x_m, to_y_m - agent.y_m
    walk_m = math.hypot(dx, dy)
    if walk_m < NOWHERE_M:
        return Finding(
            kind=FindingKind.WALK_HEADING,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={"turn_deg": None, "walk_m": walk_m},
            template="{agents[0]} has a walk that ends where it starts.",
        )
    turn_deg = math.degrees(difference(agent.heading_rad, math.atan2(dy, dx)))
    severity = Severity.FACT
    if walk_m > SHORT_M and abs(turn_deg) > WALKS_ALONG_BELOW_DEG:
        backwards = abs(turn_deg) > BACKWARDS_ABOVE_DEG
        severity = Severity.WRONG if backwards else Severity.DOUBTFUL
    side = "left" if turn_deg >= 0.0 else "right"
    turned = f"{{turn_deg:.0f}} degrees to the {side} of it"
    words = "along it" if abs(turn_deg) < 0.5 else turned
    return Finding(
        kind=FindingKind.WALK_HEADING,
        severity=severity,
        agents=(agent.id,),
        measured={"turn_deg": turn_deg, "walk_m": walk_m},
        template=f"{{agents[0]}} has a walk of {{walk_m:.1f}} m and faces {words}.",
    )


ROUND_DEG = 5
EXACT_RAD = 6e-4
"""How well a heading with three decimals meets the one that a wrapped number of degrees gives."""

_DIRECTED = frozenset({AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE, AgentType.PEDESTRIAN})
_ROUND = tuple(
    deg for deg in range(-360 + ROUND_DEG, 361, ROUND_DEG) if abs(math.sin(deg)) > EXACT_RAD
)
"""Without 355: as radians that is 113 half turns, and half a turn is what facing back means."""


def degrees(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong beyond a full turn; doubtful where round degrees, wrapped as radians, fit exactly.

    The second asks for more than the number: read as degrees the heading must follow the lane or
    the walk, read as radians it must not. What has no direction of its own is left alone.
    """
    for agent in situation.changed:
        if abs(agent.heading_rad) > 2.0 * math.pi + 1e-3:
            yield _beyond(agent)
        elif agent.type in _DIRECTED:
            meant = [deg for deg in _ROUND if _is(agent.heading_rad, deg)]
            fitting = [deg for deg in meant if _fits_better(agent, deg, situation)]
            if fitting:
                yield _suspicious(agent, min(fitting, key=abs))


def _is(heading_rad: float, degrees: int) -> bool:
    return degrees != 0 and abs(difference(heading_rad, float(degrees))) < EXACT_RAD


def _fits_better(agent: TrafficAgent, degrees: int, situation: ChangedScene) -> bool:
    wanted = _wanted_rad(agent, situation)
    return any(
        abs(difference(math.radians(degrees), one)) < math.radians(10.0)
        and abs(difference(agent.heading_rad, one)) > math.radians(20.0)
        for one in wanted
    )


def _wanted_rad(agent: TrafficAgent, situation: ChangedScene) -> list[float]:
    """The directions that an agent would have: of its walk, or of the lanes under it."""
    if agent.type is AgentType.PEDESTRIAN:
        if agent.walk_to_m is None:
            return []
        x_m, y_m = agent.walk_to_m
        return [math.atan2(y_m - agent.y_m, x_m - agent.x_m)]
    return [one.tangent_rad for one in situation.beside[agent.id] if one.covers]


def _beyond(agent: TrafficAgent) -> Finding:
    minus = "" if agent.heading_rad >= 0.0 else "-"
    return Finding(
        kind=FindingKind.DEGREES,
        severity=Severity.WRONG,
        agents=(agent.id,),
        measured={"heading_rad": agent.heading_rad},
        template=(
            f"{{agents[0]}} has a heading of {minus}{{heading_rad:.3g}}, more than a full turn: "
            "it looks like degrees, radians are meant."
        ),
    )


def _suspicious(agent: TrafficAgent, degrees: int) -> Finding:
    minus = "-" if degrees < 0 else ""
    return Finding(
        kind=FindingKind.DEGREES,
        severity=Severity.DOUBTFUL,
        agents=(agent.id,),
        measured={"heading_rad": agent.heading_rad, "read_as_deg": float(degrees)},
        template=(
            f"The heading of {{agents[0]}} looks like {minus}{{read_as_deg:.0f}} degrees that "
            "were given as radians: read as degrees it would fit."
        ),
    )
