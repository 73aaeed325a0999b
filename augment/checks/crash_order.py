"""Which of the crashed vehicles is which: the order that fits best what is said of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

from augment.checks.parties import Party
from augment.checks.tolerances import USUAL
from augment.geometry.angles import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TrafficAgent
from augment.scene.intent import (
    CrashedCar,
    CrashRequest,
)
from augment.scene.intent_words import (
    Bearing,
)

MOST_ORDERED = 5
_MISPLACED = 10.0
"""An order with somebody on the wrong side of the one before is only taken for want of another."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A vehicle of a crash, the one named before it, and what is asked of the two."""

    one: TrafficAgent
    other: TrafficAgent
    asked: CrashedCar

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
        if self.asked.turn_deg is None:
            return None
        if self.asked.is_signed:
            off_rad = difference(math.radians(self.turn_deg), math.radians(self.asked.turn_deg))
            return abs(math.degrees(off_rad))
        return abs(abs(self.turn_deg) - abs(self.asked.turn_deg))

    @property
    def off_m(self) -> float | None:
        """How far the gap is off what is said, None where nothing is."""
        if self.asked.gap is None:
            return None
        return max(self.asked.gap.low_m - self.gap_m, self.gap_m - self.asked.gap.high_m, 0.0)


def in_order(party: Party, request: CrashRequest, route: EgoRoute) -> tuple[TrafficAgent, ...]:
    """The vehicles of a party in the order in which the request names them."""
    agents = party.agents
    if not 2 <= len(agents) <= MOST_ORDERED:
        return agents
    return min(
        permutations(agents),
        key=lambda order: (round(_misfit(order, request, route), 6), [one.id for one in order]),
    )


def pairs(order: Sequence[TrafficAgent], request: CrashRequest) -> list[Pair]:
    """Neighbours in that order, with what is said of each further one."""
    asked = [*request.others, *[CrashedCar()] * (len(order) - 1 - len(request.others))]
    return [
        Pair(one=one, other=other, asked=about)
        for (one, other), about in zip(pairwise(order), asked, strict=False)
    ]


# Private


def _misfit(order: Sequence[TrafficAgent], request: CrashRequest, route: EgoRoute) -> float:
    misfit, span_m = 0.0, request.spot.span_m
    if span_m is not None:
        first_m = route.locate_agent(order[0]).ahead_m
        misfit = max(span_m[0] - first_m, first_m - span_m[1], 0.0) / USUAL.distance_m
    for pair in pairs(order, request):
        misfit += (pair.off_deg or 0.0) / USUAL.heading_deg + (pair.off_m or 0.0) / USUAL.spacing_m
        misfit += pair.gap_m / 100.0  # the nearest neighbours, where nothing is said
        misfit += 0.0 if _bears(pair, route) else _MISPLACED
    return misfit


def _bears(pair: Pair, route: EgoRoute) -> bool:
    """Whether the second is where it is said to be, seen from the first."""
    here, there = route.locate_agent(pair.one), route.locate_agent(pair.other)
    return {
        Bearing.AHEAD: there.ahead_m >= here.ahead_m,
        Bearing.BEHIND: there.ahead_m <= here.ahead_m,
        Bearing.LEFT: there.left_m >= here.left_m,
        Bearing.RIGHT: there.left_m <= here.left_m,
    }[pair.asked.bearing or Bearing.AHEAD]
