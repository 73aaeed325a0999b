"""Which of the crashed vehicles is which: the order that fits best what is said of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

from augment.checks.own_way import OwnWay
from augment.checks.parties import Party
from augment.checks.tolerances import DISTANCE_M, HEADING_DEG, SPACING_M
from augment.geometry.angles import difference
from augment.instruction.intent import Bearing, CrashedCar, CrashRequest, Relation
from augment.scene.entities import TrafficAgent

MOST_ORDERED = 5
_MISPLACED = 10.0
"""An order with somebody on the wrong side of the one before is only taken for want of another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A vehicle of a crash, the one named before it, and what is said of the two."""

    one: TrafficAgent
    other: TrafficAgent
    said: CrashedCar

    @property
    def gap_m(self) -> float:
        """Between the centres."""
        return math.hypot(self.other.x_m - self.one.x_m, self.other.y_m - self.one.y_m)

    @property
    def turn_deg(self) -> float:
        """Of the second against the first, positive to the left."""
        return math.degrees(difference(self.other.heading_rad, self.one.heading_rad))

    @property
    def off_deg(self) -> float | None:
        """How far the turn is off what is said, None where nothing is."""
        if self.said.turn_deg is None:
            return None
        if self.said.is_signed:
            off_rad = difference(math.radians(self.turn_deg), math.radians(self.said.turn_deg))
            return abs(math.degrees(off_rad))
        return abs(abs(self.turn_deg) - abs(self.said.turn_deg))

    @property
    def off_m(self) -> float | None:
        """How far the gap is off what is said, None where nothing is."""
        if self.said.gap is None:
            return None
        return max(self.said.gap.low_m - self.gap_m, self.gap_m - self.said.gap.high_m, 0.0)


def in_order(party: Party, request: CrashRequest, way: OwnWay) -> tuple[TrafficAgent, ...]:
    """The vehicles of a party in the order in which the request names them."""
    agents = party.agents
    if not 2 <= len(agents) <= MOST_ORDERED:
        return agents
    return min(
        permutations(agents),
        key=lambda order: (round(_misfit(order, request, way), 6), [one.id for one in order]),
    )


def pairs(order: Sequence[TrafficAgent], request: CrashRequest) -> list[Pair]:
    """Neighbours in that order, with what is said of each further one."""
    said = list(request.others)
    said += [CrashedCar(turn_deg=request.turn_deg)] * (len(order) - 1 - len(said))
    return [
        Pair(one=one, other=other, said=_with_turn(about, request))
        for (one, other), about in zip(pairwise(order), said, strict=False)
    ]


# Private


def _with_turn(said: CrashedCar, request: CrashRequest) -> CrashedCar:
    """An angle that is said of all of them holds where none is said of this one."""
    if said.turn_deg is not None or request.turn_deg is None:
        return said
    return CrashedCar(gap=said.gap, bearing=said.bearing, turn_deg=request.turn_deg)


def _misfit(order: Sequence[TrafficAgent], request: CrashRequest, way: OwnWay) -> float:
    sign = 1.0 if request.spot.relation is Relation.AHEAD else -1.0
    first_m = sign * way.of_agent(order[0]).ahead_m
    wanted = request.spot.distance
    misfit = max(wanted.low_m - first_m, first_m - wanted.high_m, 0.0) / DISTANCE_M
    for pair in pairs(order, request):
        misfit += (pair.off_deg or 0.0) / HEADING_DEG + (pair.off_m or 0.0) / SPACING_M
        misfit += pair.gap_m / 100.0  # the nearest neighbours, where nothing is said
        misfit += 0.0 if _bears(pair, way) else _MISPLACED
    return misfit


def _bears(pair: Pair, way: OwnWay) -> bool:
    """Whether the second is where it is said to be, seen from the first."""
    here, there = way.of_agent(pair.one), way.of_agent(pair.other)
    return {
        Bearing.AHEAD: there.ahead_m >= here.ahead_m,
        Bearing.BEHIND: there.ahead_m <= here.ahead_m,
        Bearing.LEFT: there.left_m >= here.left_m,
        Bearing.RIGHT: there.left_m <= here.left_m,
    }[pair.said.bearing]
