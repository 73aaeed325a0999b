"""Holds what an instruction says, claim by claim, against a modification's geometry.

The checks of the registry never ask what was wanted; this one asks nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

from augment.checks.ground import Ground
from augment.geometry.angles import difference
from augment.geometry.polyline import Polyline
from augment.scene.claims import TOLERANCES, Claim, ClaimKind
from augment.scene.entities import Point, TrafficAgent
from augment.scene.modification import Modification


@dataclass(frozen=True, slots=True, kw_only=True)
class Broken:
    """A claim that does not hold.

    Attributes:
        measured: In the claim's unit; None where there is nothing to measure.
    """

    claim: Claim
    measured: float | None

    def __str__(self) -> str:
        about = " and ".join(self.claim.agents) or str(self.claim.type)
        found = "nothing" if self.measured is None else f"{self.measured:.4g}"
        return f"{self.claim.kind} of {about}: {self.claim.value:g} is said, {found} is measured"


def broken(
    ground: Ground, modification: Modification, claims: Sequence[Claim]
) -> tuple[Broken, ...]:
    """The claims that the modification does not keep to the stated tolerance.

    Args:
        ground: The ground of the scene before the change.
        modification: What is measured.
        claims: About its added agents.
    """
    found = []
    for claim in claims:
        off = _off(ground, modification, claim)
        if off is None or abs(off[1]) > TOLERANCES[claim.kind] + 1e-9:
            found.append(Broken(claim=claim, measured=None if off is None else off[0]))
    return tuple(found)


def _off(ground: Ground, modification: Modification, claim: Claim) -> tuple[float, float] | None:
    """What is measured and how far it is off; a spacing by its worst gap."""
    if claim.kind is ClaimKind.COUNT:
        number = sum(one.type is claim.type for one in modification.added)
        return float(number), number - claim.value
    by_id = {one.id: one for one in modification.added}
    agents = [by_id[name] for name in claim.agents if name in by_id]
    if ground.route is None or not agents or len(agents) < len(claim.agents):
        return None
    measured = _MEASURES[claim.kind](ground.route[0], agents)
    if not measured:
        return None
    is_angle = claim.kind in (ClaimKind.TURN, ClaimKind.TURNED_APART)
    offs = [
        _degrees_off(value, claim.value) if is_angle else value - claim.value for value in measured
    ]
    worst = max(range(len(offs)), key=lambda index: abs(offs[index]))
    return measured[worst], offs[worst]


def _degrees_off(measured_deg: float, said_deg: float) -> float:
    return math.degrees(difference(math.radians(measured_deg), math.radians(said_deg)))


# Private: each measures along the ego's way; empty where there is nothing to measure.


def _ahead(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    x_m = sum(one.x_m for one in agents) / len(agents)
    y_m = sum(one.y_m for one in agents) / len(agents)
    return [way.project(x_m, y_m).s_m]


def _left(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    return [way.project(one.x_m, one.y_m).d_m for one in agents]


def _side(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    return [math.copysign(1.0, d_m) for d_m in _left(way, agents)]


def _crosses_from(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    sides = [
        (math.copysign(1.0, start), math.copysign(1.0, way.project(*end).d_m))
        for start, end in zip(_left(way, agents), _ends(agents), strict=False)
    ]
    return [0.0 if start == end else start for start, end in sides]


def _walks_on(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    starts = [way.project(one.x_m, one.y_m).s_m for one in agents]
    ends = [way.project(*end).s_m for end in _ends(agents)]
    return [end - start for start, end in zip(starts, ends, strict=False)]


def _ends(agents: Sequence[TrafficAgent]) -> list[Point]:
    return [one.walk_to_m for one in agents if one.walk_to_m is not None]


def _turn(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    return [
        math.degrees(
            difference(one.heading_rad, way.heading_at(way.project(one.x_m, one.y_m).s_m))
        )
        for one in agents
    ]


def _turned_apart(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    return [
        abs(math.degrees(difference(other.heading_rad, one.heading_rad)))
        for one, other in pairwise(agents)
    ]


def _gaps(way: Polyline, agents: Sequence[TrafficAgent]) -> list[float]:
    return [
        math.hypot(other.x_m - one.x_m, other.y_m - one.y_m) for one, other in pairwise(agents)
    ]


_Measure = Callable[[Polyline, Sequence[TrafficAgent]], list[float]]
_MEASURES: dict[ClaimKind, _Measure] = {
    ClaimKind.AHEAD: _ahead,
    ClaimKind.LEFT: _left,
    ClaimKind.SIDE: _side,
    ClaimKind.CROSSES_FROM: _crosses_from,
    ClaimKind.WALKS_ON: _walks_on,
    ClaimKind.TURN: _turn,
    ClaimKind.TURNED_APART: _turned_apart,
    ClaimKind.GAP: _gaps,
    ClaimKind.SPACING: _gaps,
}
