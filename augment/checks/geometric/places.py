"""Where changed agents are: seen from the ego, along the lanes, and on which lane."""

from __future__ import annotations

import math
from collections.abc import Iterator

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.ground import Beside
from augment.checks.situation import ChangedScene
from augment.scene.entities import TrafficAgent


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


def lane(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent: the lane under it, or how far it is off the nearest."""
    for agent in situation.changed:
        under = situation.under(agent)
        nearest = situation.nearest(agent)
        if under is not None:
            yield _on_lane(agent.id, under)
        elif nearest is not None:
            yield _off_lane(agent.id, nearest)


def _on_lane(agent_id: str, place: Beside) -> Finding:
    if abs(place.d_m) < 0.005:
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and on its centre line; the "
            "lane is {lane_width_m:.1f} m wide."
        )
    else:
        side = "left" if place.d_m >= 0.0 else "right"
        words = (
            "{agents[0]} is on {lanes[0]}, {along_m:.1f} m along it and {left_m:.2f} m to the "
            f"{side} of its centre line; the lane is {{lane_width_m:.1f}} m wide."
        )
    return _lane_fact(agent_id, place, 0.0, words)


def _off_lane(agent_id: str, place: Beside) -> Finding:
    return _lane_fact(
        agent_id,
        place,
        place.off_m,
        (
            "{agents[0]} is {off_m:.1f} m off every lane; the nearest lane is {lanes[0]} at "
            "{along_m:.1f} m along it."
        ),
    )


def _lane_fact(agent_id: str, place: Beside, off_m: float, template: str) -> Finding:
    return Finding(
        kind=FindingKind.LANE,
        severity=Severity.FACT,
        agents=(agent_id,),
        lanes=(place.lane_id,),
        measured={
            "along_m": place.s_m,
            "left_m": place.d_m,
            "lane_width_m": place.width_m,
            "off_m": off_m,
        },
        template=template,
    )


FAR_M = 15.0
"""Further than this beside the ego's lanes a distance along them says nothing."""


def lane_distance(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed agent on a map that has a lane for the ego.

    `along_lanes_m` is None where no chain of successors leads from the ego to the agent's lane
    or back (then it would be negative); `level_m` and `beside_m` then tell where the agent is
    beside the lanes that can be reached, on the oncoming lane for example.
    """
    if situation.ground.route is None:
        return
    for agent in situation.changed:
        yield _distance_finding(agent, situation)


def _distance_finding(agent: TrafficAgent, situation: ChangedScene) -> Finding:
    reached = _reached(agent, situation)
    if reached is None:
        return Finding(
            kind=FindingKind.LANE_DISTANCE,
            severity=Severity.FACT,
            agents=(agent.id,),
            measured={"along_lanes_m": None, "level_m": None, "beside_m": None},
            template="No lane leads from the ego to the place of {agents[0]}.",
        )
    place, along_m = reached
    side = "ahead of" if along_m >= 0.0 else "behind"
    if place.covers:
        words = f"{{agents[0]}} is {{along_lanes_m:.1f}} m {side} the ego along the lanes."
    else:
        hand = "left" if place.d_m >= 0.0 else "right"
        words = (
            "No lane leads from the ego to the place of {agents[0]}: it is level with a point "
            f"{{level_m:.1f}} m {side} the ego along the lanes, {{beside_m:.1f}} m to the {hand} "
            "of the centre of {lanes[0]}."
        )
    return Finding(
        kind=FindingKind.LANE_DISTANCE,
        severity=Severity.FACT,
        agents=(agent.id,),
        lanes=(place.lane_id,),
        measured={
            "along_lanes_m": along_m if place.covers else None,
            "level_m": along_m,
            "beside_m": place.d_m,
        },
        template=words,
    )


def _reached(agent: TrafficAgent, situation: ChangedScene) -> tuple[Beside, float] | None:
    """The nearest lane that the ego reaches or came from, and how far along it the agent is."""
    places = {place.lane_id: place for place in situation.beside[agent.id]}
    candidates = [
        (place, start_m + place.s_m)
        for lane_id, start_m in situation.ground.starts_m
        if (place := places.get(lane_id)) and (place.covers or place.distance_m <= FAR_M)
    ]
    return min(
        candidates,
        key=lambda one: (round(one[0].distance_m, 4), round(abs(one[1]), 4)),
        default=None,
    )


NAMED_WITHIN_M = 0.5
"""Beyond the lane's edge: whoever stands on the line may name either side."""


def lane_named(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful where an agent names a lane that it is not on, wrong where there is none such."""
    for agent in situation.changed:
        if agent.lane_id is not None:
            yield from _named_finding(agent, agent.lane_id, situation)


def _named_finding(agent: TrafficAgent, named: str, situation: ChangedScene) -> Iterator[Finding]:
    lane = situation.ground.graph.lanes.get(named)
    if lane is None:
        yield Finding(
            kind=FindingKind.LANE_NAMED,
            severity=Severity.WRONG,
            agents=(agent.id,),
            lanes=(named,),
            template="{agents[0]} names {lanes[0]} as its lane, which the map does not have.",
        )
        return
    near = [one.off_m for one in situation.beside[agent.id] if one.lane_id == named]
    far_m = lane.centerline.project(agent.x_m, agent.y_m).distance_m - lane.width_m / 2.0
    off_m = near[0] if near else far_m
    if off_m <= NAMED_WITHIN_M:
        return
    under = situation.under(agent)
    really = "on no lane" if under is None else "on {lanes[1]}"
    yield Finding(
        kind=FindingKind.LANE_NAMED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id,),
        lanes=(named,) if under is None else (named, under.lane_id),
        measured={"off_named_lane_m": off_m},
        template=(
            "{agents[0]} names {lanes[0]} as its lane but is {off_named_lane_m:.1f} m off it, "
            f"{really}."
        ),
    )
