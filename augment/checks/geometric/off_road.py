"""How much of an agent stands where its kind does not belong, or beyond what the map covers."""

from __future__ import annotations

from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import VEHICLES, ChangedScene
from augment.scene.entities import AgentType, TrafficAgent

SEEN_SHARE = 0.02
KERB_SHARE = 0.15
"""A third of a metre of a car's width: maps and placements are no better."""
MOST_SHARE = 0.5
EDGE_M = 1.0
"""Cones stand on the road or as far beside it as this."""
NEAR_ROAD_M = 3.0
VERGE_M = 2.0
"""Beside everything that a map shows people stand on verges that it does not show."""
FAR_FROM_PATHS_M = 10.0

_EDGE = frozenset({AgentType.TRAFFIC_CONE, AgentType.BARRIER})


def off_road(situation: ChangedScene) -> Iterator[Finding]:
    """Changed agents off their ground; nothing for who stands where its kind belongs.

    Vehicles belong on the road: a fact up to a share that no map resolves, doubtful up to half
    of the box (half on the kerb), wrong above. Cones and barriers belong on the road or within a
    metre of it. All others may also be on walkways and crosswalks and on a verge beside them; on
    a map without walkways it is unknown whether they are, so off it is a fact.
    """
    if situation.ground.road.is_empty:
        return
    for agent in situation.changed:
        if agent.type in VEHICLES:
            finding = _vehicle(agent, situation)
        elif agent.type in _EDGE:
            finding = _cone(agent, situation)
        else:
            finding = _on_foot(agent, situation)
        if finding is not None:
            yield finding


def _vehicle(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    share = situation.ground.road.share_outside(situation.boxes[agent.id].corners_m)
    if share <= SEEN_SHARE:
        return None
    severity = Severity.FACT
    if share > KERB_SHARE:
        severity = Severity.DOUBTFUL if share <= MOST_SHARE else Severity.WRONG
    gap_m = situation.ground.road.distance_m(agent.x_m, agent.y_m)
    place = "{gap_m:.1f} m off it" if gap_m > 0.0 else "on it"
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=severity,
        agents=(agent.id,),
        measured={"outside_share": share, "gap_m": gap_m},
        template=(
            "{outside_share:.0%} of {agents[0]} is outside the drivable area; its centre is "
            f"{place}."
        ),
    )


def _cone(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    gap_m = situation.ground.road.distance_m(agent.x_m, agent.y_m)
    if gap_m <= EDGE_M:
        return None
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=Severity.DOUBTFUL if gap_m <= NEAR_ROAD_M else Severity.WRONG,
        agents=(agent.id,),
        measured={"outside_share": 1.0, "gap_m": gap_m},
        template="{agents[0]} is {gap_m:.1f} m off the road and its edge.",
    )


def _on_foot(agent: TrafficAgent, situation: ChangedScene) -> Finding | None:
    ground = situation.ground.everything
    gap_m = ground.distance_m(agent.x_m, agent.y_m)
    if gap_m == 0.0:
        return None
    severity = Severity.FACT
    if not situation.ground.walkways.is_empty and gap_m > VERGE_M:
        severity = Severity.DOUBTFUL if gap_m <= FAR_FROM_PATHS_M else Severity.WRONG
    share = ground.share_outside(situation.boxes[agent.id].corners_m)
    return Finding(
        kind=FindingKind.OFF_ROAD,
        severity=severity,
        agents=(agent.id,),
        measured={"outside_share": share, "gap_m": gap_m},
        template="{agents[0]} is {gap_m:.1f} m off everything that the map shows.",
    )


OUTSIDE_M = 2.0


def outside_map(situation: ChangedScene) -> Iterator[Finding]:
    """Wrong for a changed agent outside the convex region around all that the map shows."""
    ground = situation.ground.everything
    if ground.is_empty:
        return
    for agent in situation.changed:
        outside_m = ground.distance_to_hull_m(agent.x_m, agent.y_m)
        if outside_m > OUTSIDE_M:
            yield Finding(
                kind=FindingKind.OUTSIDE_MAP,
                severity=Severity.WRONG,
                agents=(agent.id,),
                measured={"outside_m": outside_m},
                template="{agents[0]} is {outside_m:.1f} m outside the mapped region.",
            )
