"""Where an agent is, seen from the ego: the straight line, ahead or behind, left or right."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene


def ego_offset(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent, centre to centre, along and across the ego's heading."""
    ego = situation.ground.scene.ego.pose
    for agent in situation.changed:
        seen = ego.pose_to_local(agent.pose)
        along = "ahead of" if seen.x_m >= 0.0 else "behind"
        side = "left" if seen.y_m >= 0.0 else "right"
        yield Finding(
            kind=FindingKind.EGO_OFFSET,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={
                "straight_m": math.hypot(seen.x_m, seen.y_m),
                "ahead_m": seen.x_m,
                "left_m": seen.y_m,
            },
            template=(
                "{agents[0]} is {straight_m:.1f} m from the ego in a straight line: "
                f"{{ahead_m:.1f}} m {along} it and {{left_m:.1f}} m to its {side}."
            ),
        )
