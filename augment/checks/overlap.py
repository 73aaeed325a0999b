"""Boxes that share ground."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import VEHICLES, ChangedScene, is_stopped
from augment.geometry import boxes
from augment.scene.entities import AgentType, TrafficAgent

TOUCH_M = 0.01
"""Depths below this are rounding."""
CRASH_SHARE = 0.10
"""Crashed cars that people placed for interPlan overlap by up to 5.6 % of a box."""
GROSS_CRASH_SHARE = 0.20
CROWD_SHARE = 0.5
"""People stand close, and a pedestrian's box is wider than a pedestrian."""
SLIGHT_SHARE = 0.05

_RIDER = frozenset({AgentType.PEDESTRIAN, AgentType.BICYCLE})


def overlap(situation: ChangedScene) -> Iterator[Finding]:
    """Every pair with a changed agent in it whose boxes overlap, by the share of the smaller one.

    With the ego always wrong. Two stopped vehicles: contact up to 10 % is a fact, up to 20 %
    doubtful. People among themselves, also on bicycles: doubtful up to half. All others:
    doubtful up to 5 %. Above, wrong.
    """
    done: set[str] = set()
    for agent in situation.changed:
        done.add(agent.id)
        for other in situation.everyone:
            if other.id not in done and _may_meet(agent, other):
                yield from _pair(agent, other, situation)


def _may_meet(one: TrafficAgent, other: TrafficAgent) -> bool:
    reach_m = math.hypot(one.length_m, one.width_m) + math.hypot(other.length_m, other.width_m)
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) <= reach_m / 2.0 + TOUCH_M


def _pair(agent: TrafficAgent, other: TrafficAgent, situation: ChangedScene) -> Iterator[Finding]:
    shared = boxes.overlap(situation.boxes[agent.id], situation.boxes[other.id])
    if shared.depth_m <= TOUCH_M:
        return
    share = max(shared.share_of_first, shared.share_of_second)
    is_ego = other.id == situation.ground.scene.ego.id
    yield Finding(
        kind=FindingKind.OVERLAP,
        severity=Severity.WRONG if is_ego else _severity(agent, other, share),
        agents=(agent.id, other.id),
        measured={"share_of_smaller": share, "area_m2": shared.area_m2, "depth_m": shared.depth_m},
        template=_WITH_EGO if is_ego else _WITH_OTHER,
    )


def _severity(one: TrafficAgent, other: TrafficAgent, share: float) -> Severity:
    fine, doubtful = 0.0, SLIGHT_SHARE
    if one.type in VEHICLES and other.type in VEHICLES and is_stopped(one) and is_stopped(other):
        fine, doubtful = CRASH_SHARE, GROSS_CRASH_SHARE
    elif one.type in _RIDER and other.type in _RIDER:
        doubtful = CROWD_SHARE
    if share <= fine:
        return Severity.FACT
    return Severity.DOUBTFUL if share <= doubtful else Severity.WRONG


_WITH_EGO = (
    "{agents[0]} and the ego overlap by {share_of_smaller:.0%} of the smaller box, {depth_m:.2f} "
    "m deep."
)
_WITH_OTHER = (
    "{agents[0]} and {agents[1]} overlap by {share_of_smaller:.0%} of the smaller box, "
    "{depth_m:.2f} m deep."
)
