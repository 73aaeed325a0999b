"""Two agents of one kind on the same spot."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene

SAME_SPOT_SHARE = 0.1
"""Of the longer box: centres nearer than half a metre for cars, five centimetres for cones."""


def duplicate(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent whose centre is on that of another agent of its type."""
    done: set[str] = set()
    for agent in situation.changed:
        done.add(agent.id)
        for other in situation.everyone:
            if other.id in done or other.type is not agent.type:
                continue
            apart_m = math.hypot(agent.x_m - other.x_m, agent.y_m - other.y_m)
            if apart_m < SAME_SPOT_SHARE * max(agent.length_m, other.length_m):
                yield Finding(
                    kind=FindingKind.DUPLICATE,
                    severity=Severity.WRONG,
                    agents=(agent.id, other.id),
                    measured={"apart_m": apart_m},
                    template=(
                        "{agents[0]} and {agents[1]} are on the same spot, {apart_m:.2f} m apart."
                    ),
                )
