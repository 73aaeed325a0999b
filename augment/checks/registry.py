"""Every check that needs no intent, and the one function that runs them.

In: a `Scene` and a `Modification`. Out: `Finding`s, each a measured fact with its numbers, its
severity and the class of fault that it speaks for.

Adding a check is adding one function to `CHECKS`. Checks against an intent get their own tuple:
these here never ask what was wanted.
"""

from __future__ import annotations

from augment.checks.finding import Finding
from augment.checks.geometric.boxes import duplicate, overlap, size, speed
from augment.checks.geometric.headings import degrees, heading, walk_heading
from augment.checks.geometric.off_road import off_road, outside_map
from augment.checks.geometric.places import ego_offset, lane, lane_distance, lane_named
from augment.checks.geometric.walks import walk_blocked, walk_crossing
from augment.checks.ground import Ground
from augment.checks.situation import ChangedScene, Check
from augment.scene.entities import Modification, Scene

CHECKS: tuple[Check, ...] = (
    ego_offset,
    lane_distance,
    lane,
    lane_named,
    heading,
    degrees,
    walk_heading,
    walk_crossing,
    walk_blocked,
    off_road,
    outside_map,
    overlap,
    duplicate,
    size,
    speed,
)


def findings(scene: Scene, modification: Modification) -> tuple[Finding, ...]:
    """What was measured about every added and moved agent, agent by agent.

    Args:
        scene: The scene before the change.
        modification: The change; of what it removes nothing is measured.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    return findings_on(Ground.of(scene), modification)


def findings_on(ground: Ground, modification: Modification) -> tuple[Finding, ...]:
    """As `findings`, for callers who ask about one scene more than once.

    Raises:
        InvalidModification: The modification does not fit the scene.
    """
    situation = ChangedScene.of(ground, modification)
    found = [finding for check in CHECKS for finding in check(situation)]
    order = {agent.id: number for number, agent in enumerate(situation.changed)}
    return tuple(sorted(found, key=lambda finding: order[finding.agents[0]]))
