"""How crashed vehicles lie to each other, against what is said, and which of them is which."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

from augment.checks.asked.parties import Party
from augment.checks.asked.question import (
    Asked,
    distance_outside,
    facing_words,
    severity_of,
    side_of,
)
from augment.checks.asked.spacing import fits_gap
from augment.checks.finding import Finding, FindingKind
from augment.checks.tolerances import CRASH_M, USUAL
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Bearing, CrashedCar, CrashRequest, Facing, LaneChoice


def asked_crash(asked: Asked) -> Iterator[Finding]:
    """Angles (heading) and gaps (position) between neighbours, and a first one that lies across.

    Nothing is found where the number of vehicles is wrong or where they lie on each other, which
    are faults of their own: then nobody knows which of them is which.
    """
    for party in asked.parties:
        request = party.request
        if not isinstance(request, CrashRequest) or not party.is_exact:
            continue
        order = in_order(party, request, asked.route)
        in_pairs = pairs(order, request)
        if any(pair.gap_m < pair.one.width_m for pair in in_pairs):
            continue
        if request.facing not in (None, Facing.WITH_LANE):
            yield from _facing(asked, request, order[0])
        for pair in in_pairs:
            yield _gap(pair, asked)
            if pair.off_deg is not None:
                yield _turn(pair, asked)


def _turn(pair: Pair, asked: Asked) -> Finding:
    asked_deg, off_deg = pair.asked.turn_deg or 0.0, pair.off_deg or 0.0
    side = f" to the {side_of(asked_deg)}" if pair.asked.is_signed else ""
    return Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=off_deg <= asked.tolerances.heading_deg),
        agents=(pair.other.id, pair.one.id),
        measured={"turn_deg": pair.turn_deg, "asked_deg": asked_deg, "off_deg": off_deg},
        template=(
            "{agents[0]} is turned {turn_deg:.0f} degrees against {agents[1]}; {asked_deg:.0f} "
            f"degrees{side} are asked for."
        ),
    )


def _gap(pair: Pair, asked: Asked) -> Finding:
    """As far apart as said, else near enough to have run into each other."""
    wanted = pair.asked.gap
    longest_m = max(CRASH_M, pair.one.length_m, pair.other.length_m)
    if wanted is None:
        fits = pair.gap_m <= longest_m
        words = "vehicles that have crashed are within {asked_m:.1f} m"
        asked_m = longest_m
    else:
        fits = fits_gap(asked, pair.gap_m, wanted)
        words = "{asked_m:.1f} m is asked for"
        asked_m = wanted.middle_m
    return Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=fits),
        agents=(pair.other.id, pair.one.id),
        measured={"gap_m": pair.gap_m, "asked_m": asked_m},
        template=f"{{agents[0]}} is {{gap_m:.1f}} m from {{agents[1]}}; {words}.",
    )


def _facing(asked: Asked, request: CrashRequest, first: TrafficAgent) -> Iterator[Finding]:
    band = asked.lanes.band(request.spot.lane or LaneChoice.OWN, asked.ahead_m(first))
    if band is None:
        return
    turn_deg = abs(math.degrees(difference(first.heading_rad, band.tangent_rad)))
    wanted_deg = 90.0 if request.facing is Facing.ACROSS else 180.0
    yield Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=abs(turn_deg - wanted_deg) <= _ROUGHLY_DEG),
        agents=(first.id,),
        measured={"turn_deg": turn_deg, "asked_deg": wanted_deg},
        template=(
            "{agents[0]} is turned {turn_deg:.0f} degrees from its lane; "
            f"{facing_words(request.facing)} is asked for."
        ),
    )


_ROUGHLY_DEG = 2.0 * USUAL.heading_deg
"""A car that has spun stands "crosswise" only roughly."""


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
        return distance_outside(self.gap_m, self.asked.gap.low_m, self.asked.gap.high_m)


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
