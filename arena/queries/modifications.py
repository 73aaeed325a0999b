"""A stored modification as the lines of a table."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True, kw_only=True)
class ModificationLine:
    """One agent that is added, moved or removed; numbers are None for a removed one.

    Frame: ego frame, x forward and y left in metres.
    """

    change: str
    agent: str
    kind: str = ""
    x_m: float | None = None
    y_m: float | None = None
    heading_deg: float | None = None
    length_m: float | None = None
    width_m: float | None = None
    speed_mps: float | None = None
    lane: str = ""


def modification_lines(document: dict[str, Any] | None) -> list[ModificationLine]:
    """The lines of a document in the format of scenario-arena/modification; none without one."""
    if document is None:
        return []
    changed = [("added", agent) for agent in document.get("add", ())]
    changed += [("moved", agent) for agent in document.get("move", ())]
    lines = [_line(change, agent) for change, agent in changed]
    return lines + [
        ModificationLine(change="removed", agent=name) for name in document.get("remove", ())
    ]


def _line(change: str, agent: dict[str, Any]) -> ModificationLine:
    return ModificationLine(
        change=change,
        agent=agent["id"],
        kind=agent["type"].replace("_", " ").lower(),
        x_m=agent["x_m"],
        y_m=agent["y_m"],
        heading_deg=math.degrees(agent["heading_rad"]),
        length_m=agent["length_m"],
        width_m=agent["width_m"],
        speed_mps=agent.get("speed_mps"),
        lane=agent.get("lane_id", ""),
    )
