"""How crashed vehicles lie to each other, against what is said, and which of them is which."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, permutations

from augment.checks.finding import Finding, FindingKind, find, side_of
from augment.checks.parties import CRASH_M, USUAL, Asked, Party, apart_m, distance_outside
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Bearing, CrashedCar, CrashRequest, Facing, LaneChoice

MOST_ORDERED = 5
_MISPLACED = 10.0
"""An order with somebody on the wrong side of the one before is only taken for want of another."""
_ROUGHLY_DEG = 2.0 * USUAL.heading_deg
"""A car that has spun stands "crosswise" only roughly."""


@dataclass(frozen=True, slots=True)
class Pair:
    """A vehicle of a crash, the one named before it, and what is asked of the two."""

    one: TrafficAgent
    other: TrafficAgent
    asked: CrashedCar

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


def in_order(party: Party, request: CrashRequest, route: EgoRoute) -> tuple[TrafficAgent, ...]:
    """Return the vehicles of a party in the order in which the request names them."""
    if not 2 <= len(party.agents) <= MOST_ORDERED:
        return party.agents
    return min(
        permutations(party.agents),
        key=lambda order: (round(_misfit(order, request, route), 6), [one.id for one in order]),
    )


def _pairs(order: Sequence[TrafficAgent], request: CrashRequest) -> list[Pair]:
    """Neighbours in that order, with what is said of each further one."""
    asked = [*request.others, *[CrashedCar()] * (len(order) - 1 - len(request.others))]
    return [Pair(*two, about) for two, about in zip(pairwise(order), asked, strict=False)]


def _misfit(order: Sequence[TrafficAgent], request: CrashRequest, route: EgoRoute) -> float:
    misfit, span_m = 0.0, request.spot.span_m
    if span_m is not None:
        first_m = route.locate_agent(order[0]).ahead_m
        misfit = distance_outside(first_m, *span_m) / USUAL.distance_m
    for pair in _pairs(order, request):
        gap_m, wanted = apart_m(pair.one, pair.other), pair.asked.gap
        off_m = distance_outside(gap_m, wanted.low_m, wanted.high_m) if wanted else 0.0
        misfit += (pair.off_deg or 0.0) / USUAL.heading_deg + off_m / USUAL.spacing_m
        misfit += gap_m / 100.0  # the nearest neighbours, where nothing is said
        here, there = route.locate_agent(pair.one), route.locate_agent(pair.other)
        is_where_said = {
            Bearing.AHEAD: there.ahead_m >= here.ahead_m,
            Bearing.BEHIND: there.ahead_m <= here.ahead_m,
            Bearing.LEFT: there.left_m >= here.left_m,
            Bearing.RIGHT: there.left_m <= here.left_m,
        }[pair.asked.bearing or Bearing.AHEAD]
        misfit += 0.0 if is_where_said else _MISPLACED
    return misfit


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
        pairs = _pairs(order, request)
        if any(apart_m(pair.one, pair.other) < pair.one.width_m for pair in pairs):
            continue
        if request.facing in (Facing.ACROSS, Facing.AGAINST_LANE):
            yield from _facing(asked, request, order[0])
        for pair in pairs:
            yield from _neighbours(asked, pair)


def _neighbours(asked: Asked, pair: Pair) -> Iterator[Finding]:
    """As far apart as said, else near enough to have run into each other; turned as said."""
    wanted, gap_m = pair.asked.gap, apart_m(pair.one, pair.other)
    longest_m = max(CRASH_M, pair.one.length_m, pair.other.length_m)
    words = "{asked_m:.1f} m is asked for"
    if wanted is None:
        words = "vehicles that have crashed are within {asked_m:.1f} m"
    yield find(
        FindingKind.ASKED_SPACING,
        gap_m <= longest_m if wanted is None else asked.fits_gap(gap_m, wanted),
        [pair.other, pair.one],
        f"{{agents[0]}} is {{gap_m:.1f}} m from {{agents[1]}}; {words}.",
        gap_m=gap_m,
        asked_m=longest_m if wanted is None else wanted.middle_m,
    )
    asked_deg, off_deg = pair.asked.turn_deg, pair.off_deg
    if asked_deg is None or off_deg is None:
        return
    side = f" to the {side_of(asked_deg)}" if pair.asked.is_signed else ""
    yield find(
        FindingKind.ASKED_HEADING,
        off_deg <= asked.tolerances.heading_deg,
        [pair.other, pair.one],
        "{agents[0]} is turned {turn_deg:.0f} degrees against {agents[1]}; {asked_deg:.0f} "
        f"degrees{side} are asked for.",
        turn_deg=pair.turn_deg,
        asked_deg=asked_deg,
        off_deg=off_deg,
    )


def _facing(asked: Asked, request: CrashRequest, first: TrafficAgent) -> Iterator[Finding]:
    band = asked.lanes.band(request.spot.lane or LaneChoice.OWN, asked.ahead_m(first))
    if band is None:
        return
    turn_deg = abs(math.degrees(difference(first.heading_rad, band.tangent_rad)))
    wanted_deg = 90.0 if request.facing is Facing.ACROSS else 180.0
    yield find(
        FindingKind.ASKED_HEADING,
        abs(turn_deg - wanted_deg) <= _ROUGHLY_DEG,
        [first],
        "{agents[0]} is turned {turn_deg:.0f} degrees from its lane; "
        f"facing {request.facing} is asked for.",
        turn_deg=turn_deg,
        asked_deg=wanted_deg,
    )
