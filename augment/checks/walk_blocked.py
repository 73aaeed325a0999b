"""Whether something stands where a pedestrian is to walk."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.situation import ChangedScene, is_stopped
from augment.checks.walk_crossing import end_of_walk
from augment.geometry.boxes import Box
from augment.scene.entities import AgentType, Point, TrafficAgent

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
                    yield _finding(agent, other, inside_m)


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


def _finding(agent: TrafficAgent, other: TrafficAgent, inside_m: float) -> Finding:
    return Finding(
        kind=FindingKind.WALK_BLOCKED,
        severity=Severity.DOUBTFUL,
        agents=(agent.id, other.id),
        measured={"inside_m": inside_m},
        template="The walk of {agents[0]} leads {inside_m:.1f} m through {agents[1]}.",
    )
