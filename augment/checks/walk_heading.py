"""Whether a pedestrian faces the way that it walks."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene
from augment.geometry.angles import difference
from augment.scene.entities import TrafficAgent

ALONG_BELOW_DEG = 30.0
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
            yield _finding(agent, *agent.walk_to_m)


def _finding(agent: TrafficAgent, to_x_m: float, to_y_m: float) -> Finding:
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
    if walk_m > SHORT_M and abs(turn_deg) > ALONG_BELOW_DEG:
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
