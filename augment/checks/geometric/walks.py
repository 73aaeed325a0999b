"""Whether a walk crosses the lane that the ego drives on, and what stands in its way."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene, is_stopped
from augment.geometry.frames import Box
from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, Point, TrafficAgent

CORRIDOR_M = 150.0
"""How far ahead of the ego a walk is held against its lane."""
ASSUMED_WALK_M = 30.0
"""How far a pedestrian without an end point is followed; the longest known walk is 28.8 m."""


def walk_crossing(situation: ChangedScene) -> Iterator[Finding]:
    """A fact for every changed pedestrian who walks: where it crosses the ego's route, if it does.

    Looked at is the route from the ego on.
    """
    route = situation.ground.route
    corridor = None if route is None else route.corridor(CORRIDOR_M)
    if corridor is None:
        return
    line, width_m = corridor
    for agent in situation.changed:
        end = end_of_walk(agent)
        if agent.type is AgentType.PEDESTRIAN and end is not None:
            yield _crossing_finding(agent, end, line, width_m)


def end_of_walk(agent: TrafficAgent) -> Point | None:
    """Where a walk ends: as the agent says, else straight on; None for who stands."""
    if agent.walk_to_m is not None or is_stopped(agent):
        return agent.walk_to_m
    return (
        agent.x_m + ASSUMED_WALK_M * math.cos(agent.heading_rad),
        agent.y_m + ASSUMED_WALK_M * math.sin(agent.heading_rad),
    )


def _crossing_finding(agent: TrafficAgent, end: Point, line: Polyline, width_m: float) -> Finding:
    start = (agent.x_m, agent.y_m)
    crosses_at_m = _meeting(np.array(start), np.array(end), line)
    first, last = line.project(*start), line.project(*end)
    steps_into = min(first.distance_m, last.distance_m) <= width_m / 2.0
    assumed = "" if agent.walk_to_m is not None else ", keeping its heading,"
    if crosses_at_m is not None:
        hands = ("left", "right")
        if first.d_m <= last.d_m:
            hands = hands[::-1]
        words = (
            f"crosses the ego's lane from {hands[0]} to {hands[1]}, {{crosses_at_m:.1f}} m ahead "
            "of the ego along the lanes."
        )
    elif steps_into:
        words = "starts or ends in the ego's lane and does not cross its middle."
    else:
        words = "does not cross the ego's lane."
    return Finding(
        kind=FindingKind.WALK_CROSSING,
        severity=Severity.FACT,
        agents=(agent.id,),
        measured={"crosses_at_m": crosses_at_m, "start_left_m": first.d_m, "end_left_m": last.d_m},
        template=f"The walk of {{agents[0]}}{assumed} {words}",
    )


def _meeting(start: NDArray[np.float64], end: NDArray[np.float64], line: Polyline) -> float | None:
    """The first arc length at which the walk from start to end, each (2,), meets the line."""
    begins = line.points_m[:-1]
    steps, walk = np.diff(line.points_m, axis=0), end - start
    turn = steps[:, 0] * walk[1] - steps[:, 1] * walk[0]
    offset = start - begins
    with np.errstate(divide="ignore", invalid="ignore"):  # a walk along a segment never meets it
        along = (offset[:, 0] * walk[1] - offset[:, 1] * walk[0]) / turn
        walked = (offset[:, 0] * steps[:, 1] - offset[:, 1] * steps[:, 0]) / turn
    meets = (along >= 0.0) & (along <= 1.0) & (walked >= 0.0) & (walked <= 1.0)
    if not meets.any():
        return None
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    return float((line.stations_m[:-1] + along * lengths)[meets].min())


GRAZED_M = 0.1
"""Whoever walks through less than this of a box passes its corner."""


def walk_blocked(situation: ChangedScene) -> Iterator[Finding]:
    """Doubtful for every changed pedestrian whose walk leads through something that stands.

    People are no obstacle to each other: they step aside.
    """
    for agent in situation.changed:
        end = end_of_walk(agent)
        if agent.type is not AgentType.PEDESTRIAN or end is None:
            continue
        for other in situation.everyone:
            if _is_in_the_way(other):
                inside_m = _inside_m((agent.x_m, agent.y_m), end, situation.boxes[other.id])
                if inside_m > GRAZED_M:
                    yield _blocked_finding(agent, other, inside_m)


def _is_in_the_way(other: TrafficAgent) -> bool:
    return is_stopped(other) and other.type is not AgentType.PEDESTRIAN


def _inside_m(start: Point, end: Point, box: Box) -> float:
    """How much of the straight way from start to end lies in a box."""
    begin, stop = box.pose.to_local(np.array([start, end]))
    half = np.array([box.length_m, box.width_m]) / 2.0
    step = stop - begin
    with np.errstate(divide="ignore", invalid="ignore"):  # a way along a side never crosses it
        shares = np.sort(np.array([(-half - begin) / step, (half - begin) / step]), axis=0)
    is_still = step == 0.0
    if (is_still & (np.abs(begin) > half)).any():
        return 0.0
    first, last = shares[0][~is_still].max(initial=0.0), shares[1][~is_still].min(initial=1.0)
    return max(0.0, float(last - first)) * float(np.hypot(*step))


def _blocked_finding(agent: TrafficAgent, other: TrafficAgent, inside_m: float) -> Finding:
    return Finding(
        kind=FindingKind.WALK_BLOCKED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id, other.id),
        measured={"inside_m": inside_m},
        template="The walk of {agents[0]} leads {inside_m:.1f} m through {agents[1]}.",
    )
