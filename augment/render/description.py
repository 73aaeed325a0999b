"""What a picture of a change shows, as a short list of values: the text description.

It tells what the picture tells, and of what lies outside of it as well. Whatever is drawn in the
changed colour is "changed", be it added or moved; whatever stood there before and no longer does
is "gone". Ids, sizes and the order of a modification leave no trace, and numbers are rounded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from augment.geometry.frames import wrap
from augment.render.marks import is_walking, stands
from augment.scene.entities import AgentType, Modification, Point, Scene, TrafficAgent

CHANGED, GONE = "changed", "gone"

STEP_DEG = 5
"""Headings are told in these steps: finer ones can't be seen, and would be a handwriting."""

_UPRIGHT = {AgentType.TRAFFIC_CONE, AgentType.CONSTRUCTION_SIGN}
"""Drawn upright whatever their heading."""

_SYMMETRIC = {AgentType.BARRIER, AgentType.GENERIC_OBJECT}
"""Drawn alike from either end."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DescribedAgent:
    """One agent of the list.

    Frame: ego frame, metres ahead of the ego's centre and to its left.

    Attributes:
        change: `CHANGED` or `GONE`.
        kind: The value of an `AgentType`.
        heading_deg: To the left of the ego's, in (-180, 180]; None where its mark shows none.
        along_deg: How a thing without a front lies, in (-90, 90]; None for all others.
        speed_mps: 0 for a road user that stands; None for things that do, and for who walks.
        walk_to_m: Where a walk ends, ahead and left; None without a walk.
    """

    change: str
    kind: str
    ahead_m: float
    left_m: float
    heading_deg: int | None = None
    along_deg: int | None = None
    speed_mps: float | None = None
    walk_to_m: Point | None = None


def describe(scene: Scene, modification: Modification) -> list[DescribedAgent]:
    """What was changed, then what is gone, each the nearest first, then by kind.

    Args:
        scene: The scene before the change; ids that it does not have are passed over.
        modification: The change; the list of an empty one is empty.
    """
    left = {agent.id for agent in modification.moved} | set(modification.removed)
    lines = [_line(CHANGED, agent) for agent in modification.changed]
    lines += [_line(GONE, agent) for agent in scene.agents if agent.id in left]
    return sorted(lines, key=_place)


# Private


def _line(change: str, agent: TrafficAgent) -> DescribedAgent:
    walks, moves = is_walking(agent), not stands(agent)
    is_thing = agent.type in _UPRIGHT | _SYMMETRIC
    heading, along = None, None
    if moves or not is_thing:
        heading = _turn(agent.heading_rad)
    elif agent.type in _SYMMETRIC:
        along = _turn(math.remainder(agent.heading_rad, math.pi))
        along = 90 if along == -90 else along
    return DescribedAgent(
        change=change,
        kind=agent.type.value,
        ahead_m=_metres(agent.x_m),
        left_m=_metres(agent.y_m),
        heading_deg=heading,
        along_deg=along,
        speed_mps=None if walks or (is_thing and not moves) else _speed(agent),
        walk_to_m=_end(agent.walk_to_m) if walks else None,
    )


def _place(line: DescribedAgent) -> tuple[object, ...]:
    """Everything that a line says, so that two which differ never stand as they came."""
    distance_m = round(math.hypot(line.ahead_m, line.left_m), 3)
    walk = line.walk_to_m or ()
    rest = (line.heading_deg, line.along_deg, line.speed_mps)
    known = tuple((value is not None, value or 0) for value in rest)
    return (line.change, distance_m, line.kind, line.ahead_m, line.left_m, *known, walk)


def _end(point: Point | None) -> Point | None:
    return None if point is None else (_metres(point[0]), _metres(point[1]))


def _metres(value: float) -> float:
    return round(value, 1) + 0.0  # no minus before a zero


def _speed(agent: TrafficAgent) -> float:
    return 0.0 if stands(agent) else _metres(agent.speed_mps)


def _turn(angle_rad: float) -> int:
    degrees = STEP_DEG * round(math.degrees(wrap(angle_rad)) / STEP_DEG)
    return 180 if degrees == -180 else degrees
