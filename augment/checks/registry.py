"""Every check that needs no intent, and the one function that runs them.

In: a `Scene` and a `Modification`. Out: `Finding`s, each a measured fact with its numbers, its
severity and the class of fault that it speaks for.

Adding a check is adding one function to `CHECKS`. Checks against an intent get their own tuple:
these here never ask what was wanted.
"""

from __future__ import annotations

from augment.checks.degrees import degrees
from augment.checks.duplicate import duplicate
from augment.checks.ego_offset import ego_offset
from augment.checks.finding import Finding
from augment.checks.ground import Ground
from augment.checks.heading import heading
from augment.checks.lane import lane
from augment.checks.lane_distance import lane_distance
from augment.checks.lane_named import lane_named
from augment.checks.off_road import off_road
from augment.checks.outside_map import outside_map
from augment.checks.overlap import overlap
from augment.checks.situation import ChangedScene, Check
from augment.checks.size import size
from augment.checks.speed import speed
from augment.checks.walk_blocked import walk_blocked
from augment.checks.walk_crossing import walk_crossing
from augment.checks.walk_heading import walk_heading
from augment.scene.entities import Scene
from augment.scene.modification import Modification

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
