"""A heading that looks like degrees where radians are meant."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene
from augment.geometry.angles import difference
from augment.scene.entities import AgentType, TrafficAgent

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
