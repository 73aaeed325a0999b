"""Agents beyond the region that the map covers."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene

TOLERANCE_M = 2.0


def outside_map(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent outside the convex region around all that the map shows."""
    ground = situation.ground.everything
    if ground.is_empty:
        return
    for agent in situation.changed:
        outside_m = ground.distance_to_hull_m(agent.x_m, agent.y_m)
        if outside_m > TOLERANCE_M:
            yield Finding(
                kind=FindingKind.OUTSIDE_MAP,
                severity=Severity.WRONG,
                agents=(agent.id,),
                measured={"outside_m": outside_m},
                template="{agents[0]} is {outside_m:.1f} m outside the mapped region.",
            )
