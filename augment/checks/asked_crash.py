"""Crashed vehicles: assignment to the sentence, and their poses relative to each other."""

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise, permutations

from augment.checks.finding import Finding, FindingKind
from augment.checks.parties import CRASH_M, USUAL, Bounds, Case, Party, apart_m, hold
from augment.checks.wish_patterns import MOST_ORDERED
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Bearing, CrashedCar, CrashRequest, Facing, LaneChoice

_MISPLACED = 10.0
"""An order with somebody on the wrong side of the one before is only taken for want of another."""
_ROUGHLY_DEG = 2.0 * USUAL.heading_deg
"""A car that has spun stands "crosswise" only roughly."""

_Pair = tuple[TrafficAgent, TrafficAgent, CrashedCar]
"""A vehicle of a crash, the one named after it, and what is said of that one."""


def in_order(party: Party, request: CrashRequest, route: EgoRoute) -> tuple[TrafficAgent, ...]:
    """Return the vehicles of a party in the order in which the request names them."""
    if not 2 <= len(party.agents) <= MOST_ORDERED:
        return party.agents
    return min(
        permutations(party.agents),
        key=lambda order: (
            round(_misfit(order, request, route), 6),
            [agent.id for agent in order],
        ),
    )


def _pairs(order: Sequence[TrafficAgent], request: CrashRequest) -> list[_Pair]:
    """Neighbours in that order, with what is said of each further one."""
    cars = [*request.others, *[CrashedCar()] * (len(order) - 1 - len(request.others))]
    return [(*two, car) for two, car in zip(pairwise(order), cars, strict=False)]


def _turn_deg(agent: TrafficAgent, other: TrafficAgent, car: CrashedCar) -> float:
    """The turn of the second against the first, to the side that is asked for if it is open."""
    turn_deg = math.degrees(difference(other.heading_rad, agent.heading_rad))
    if car.turn_deg is None:
        return turn_deg
    if not car.is_signed:
        return math.copysign(turn_deg, car.turn_deg)
    # The same turn, as the number nearest to the one that is said.
    return car.turn_deg + math.remainder(turn_deg - car.turn_deg, 360.0)


def _misfit(order: Sequence[TrafficAgent], request: CrashRequest, route: EgoRoute) -> float:
    places = {agent.id: route.locate_agent(agent) for agent in order}
    # Each part is divided by its tolerance, so that metres and degrees add up.
    misfit, span_m = 0.0, request.spot.span_m
    if span_m is not None:
        misfit = Bounds(*span_m, 0.0).off(places[order[0].id].ahead_m) / USUAL.distance_m
    for leader, other, car in _pairs(order, request):
        gap_m = apart_m(leader, other)
        misfit += gap_m / 100.0  # the nearest neighbours, where nothing is said
        if car.gap is not None:
            misfit += Bounds(car.gap.low_m, car.gap.high_m, 0.0).off(gap_m) / USUAL.spacing_m
        if car.turn_deg is not None:
            misfit += abs(_turn_deg(leader, other, car) - car.turn_deg) / USUAL.heading_deg
        here, there = places[leader.id], places[other.id]
        further_m = {
            Bearing.AHEAD: there.ahead_m - here.ahead_m,
            Bearing.BEHIND: here.ahead_m - there.ahead_m,
            Bearing.LEFT: there.left_m - here.left_m,
            Bearing.RIGHT: here.left_m - there.left_m,
        }[car.bearing or Bearing.AHEAD]
        misfit += _MISPLACED if further_m < 0.0 else 0.0
    return misfit


def check_crash(case: Case) -> Iterator[Finding]:
    """Angles (heading) and gaps (position) between neighbours, and a first one that lies across.

    Nothing is found where the number of vehicles is wrong or where they lie on each other, which
    are faults of their own: then nobody knows which of them is which.
    """
    for party in case.parties:
        request = party.request
        if not isinstance(request, CrashRequest) or not party.is_exact:
            continue
        order = in_order(party, request, case.route)
        pairs = _pairs(order, request)
        if any(apart_m(agent, other) < agent.width_m for agent, other, _ in pairs):
            continue
        yield from _facing(case, request, order[0])
        for pair in pairs:
            yield from _neighbours(case, *pair)


def _neighbours(
    case: Case, agent: TrafficAgent, other: TrafficAgent, car: CrashedCar
) -> Iterator[Finding]:
    """As far apart as said, else near enough to have run into each other; turned as said."""
    wanted = Bounds(0.0, max(CRASH_M, agent.length_m, other.length_m), 0.0)
    if car.gap is not None:
        wanted = case.gap(car.gap)
    what, pair = "The distance of {agents[0]} from {agents[1]}", [other, agent]
    yield hold(FindingKind.ASKED_SPACING, pair, what, apart_m(agent, other), wanted)
    if car.turn_deg is None:
        return
    yield hold(
        FindingKind.ASKED_HEADING,
        pair,
        "The turn of {agents[0]} to the left of the heading of {agents[1]}",
        _turn_deg(agent, other, car),
        Bounds(car.turn_deg, car.turn_deg, case.tolerances.heading_deg),
        unit="degrees",
    )


def _facing(case: Case, request: CrashRequest, first: TrafficAgent) -> Iterator[Finding]:
    band = case.lanes.band(request.spot.lane or LaneChoice.OWN, case.ahead_m(first))
    if band is None or request.facing in (None, Facing.WITH_LANE):
        return
    wanted_deg = 90.0 if request.facing is Facing.ACROSS else 180.0
    yield hold(
        FindingKind.ASKED_HEADING,
        [first],
        "The turn of {agents[0]} from its lane's direction, to either side,",
        abs(math.degrees(difference(first.heading_rad, band.tangent_rad))),
        Bounds(wanted_deg, wanted_deg, _ROUGHLY_DEG),
        unit="degrees",
    )
