"""Distances, places across the road, gaps and crashes against those that were asked for."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise, permutations
from statistics import median

from augment.checks.bodies import end_of_walk
from augment.checks.finding import Finding, FindingKind, find
from augment.checks.lanes_across import Band
from augment.checks.parties import CRASH_M, USUAL, Bounds, Case, Party, apart_m, hold, meets_route
from augment.checks.wish_patterns import MOST_ORDERED
from augment.checks.wish_places import EVERYWHERE, find_across, find_off, is_exact, list_stations
from augment.checks.wish_shapes import CONE_M, WORKER_M
from augment.geometry.frames import difference
from augment.scene import intent as wish
from augment.scene.entities import TrafficAgent

_TAPER_M = 1.0
"""Cones of which the last is this far across from the first run from one side to the other."""
_MISPLACED = {True: 10.0, False: 0.01}
"""Of an order with somebody on the wrong side of the one before, by whether that side is known (of
the first two it is): taken only for want of another, else where all the rest is the same."""
_ROUGHLY_DEG = 2.0 * USUAL.heading_deg
"""A car that has spun stands "crosswise" only roughly."""

_Pair = tuple[TrafficAgent, TrafficAgent, wish.CrashedCar]
"""A vehicle of a crash, the one named after it, and what is said of that one."""


def check_distance(case: Case) -> Iterator[Finding]:
    """One finding a request: wrong beyond the tolerance.

    A crash counts by its first vehicle, cones by the first, a ring by its middle, pedestrians
    by where a walk begins or meets the ego's route. Where the number is wrong, which is a fault of
    its own, any may be the first, and where the first is missing the next one is.
    """
    for party in case.parties:
        spans_m = list_stations(party.request.spot, case.lanes)
        if not party.placed or spans_m == (EVERYWHERE,):
            continue
        # A spot may admit several ranges: the one that is nearest to what is there counts.
        nearest_m = case.ahead_m(party.placed[0])
        span_m = min(spans_m, key=lambda span_m: find_off(nearest_m, [span_m]))
        allowed_m, furthest_m = case.tolerances.distance_m, max(map(abs, span_m))
        if math.isfinite(furthest_m):
            share_m = case.tolerances.distance_share * furthest_m
            allowed_m = max(allowed_m, share_m) + _to_next_m(party)
        wanted = Bounds(*span_m, allowed_m)
        first, ahead_m = _measure_ahead(case, party, wanted)
        what = "the cones' middle" if _is_ring(party) else "{agents[0]}"
        yield hold(
            FindingKind.ASKED_DISTANCE,
            [first, *(agent for agent in party.everyone if agent is not first)],
            f"The distance of {what} ahead along the ego's lane",
            ahead_m,
            wanted,
        )


def _is_ring(party: Party) -> bool:
    return isinstance(party.request, wish.ConesRequest) and party.request.shape is wish.Shape.RING


def _measure_ahead(case: Case, party: Party, wanted: Bounds) -> tuple[TrafficAgent, float]:
    """Return the agent that defines a party's distance, and its distance ahead of the ego in m."""
    request = party.request
    # The first is the nearest to the ego: behind it, who is furthest ahead.
    sign = -1.0 if request.spot.relation is wish.Relation.BEHIND else 1.0
    ahead = [(case.ahead_m(agent), agent) for agent in (*party.placed, *party.spare)]
    first_m, first = min(ahead, key=lambda item: (sign * item[0], item[1].id))
    if _is_ring(party):
        return first, sum(value for value, _ in ahead) / len(ahead)
    if isinstance(request, wish.CrashRequest) and party.is_exact:
        first = in_order(case, party, request)[0]
        return first, case.ahead_m(first)
    if isinstance(request, wish.WalkRequest):
        meetings = [(meets_route(case.route, agent), agent) for agent in party.placed]
        ahead += [(case.route.locate(*at).ahead_m, agent) for at, agent in meetings if at]
    elif not isinstance(request, wish.CrashRequest) and party.is_exact:
        return first, first_m
    value, agent = min(ahead, key=lambda item: (wanted.off(item[0]), item[1].id))
    return agent, value


def _to_next_m(party: Party) -> float:
    """Return the extra distance of the next one if one is missing, in m."""
    if party.missing and isinstance(party.request, wish.CrashRequest):
        return CRASH_M
    if party.missing and isinstance(party.request, wish.ConesRequest) and party.request.spacing:
        return party.request.spacing.high_m
    return 0.0


def check_across(case: Case) -> Iterator[Finding]:
    """Vehicles by their offset, crashes and cones by the lane that they are in."""
    for party in case.parties:
        request, lane = party.request, party.request.spot.lane
        if isinstance(request, wish.WalkRequest) and not request.is_file:
            yield from _check_walk_ends(case, party, request)
        if isinstance(request, wish.WalkRequest) or not party.placed or lane is None:
            continue
        first = min(party.placed, key=lambda agent: (abs(case.ahead_m(agent)), agent.id))
        band = case.lanes.band(lane, case.ahead_m(first))
        if band is None:
            continue
        if isinstance(request, wish.VehicleRequest):
            for agent in party.placed:
                wanted = _bounds(case, request.spot, band, agent.width_m / 2.0)
                left_m = case.left_m(agent) - band.left_m
                yield _across([agent], left_m, wanted)
        elif isinstance(request, wish.ConesRequest):
            yield from _cones(case, party, request, band)
        # Where one is missing it may be the nearest, and the others lie anywhere.
        elif isinstance(request, wish.CrashRequest) and not party.missing:
            if party.is_exact:
                first = in_order(case, party, request)[0]
            others = [agent for agent in party.everyone if agent is not first]
            left_m = case.left_m(first) - band.left_m
            wanted = _bounds(case, request.spot, band, first.width_m / 2.0)
            yield _across([first, *others], left_m, wanted)


def _check_walk_ends(case: Case, party: Party, request: wish.WalkRequest) -> Iterator[Finding]:
    """The numbers across the way at which walks begin and end, where they are said."""
    for agent in party.agents:
        for lateral, point in (
            (request.spot.lateral, (agent.x_m, agent.y_m)),
            (request.end, end_of_walk(agent)),
        ):
            if lateral is not None and point is not None:
                place = case.route.locate(*point)
                band = case.lanes.band(wish.LaneChoice.OWN, place.ahead_m)
                if band is not None:
                    wanted = _bounds(case, wish.Spot(lateral=lateral), band, 0.0)
                    yield _across([agent], place.left_m, wanted)


def _across(
    agents: Sequence[TrafficAgent], left_m: float, wanted: Bounds, *, subject: str = "{agents[0]}"
) -> Finding:
    """A place across a lane; right but for left and right it is a fault of reasoning."""
    is_exchanged = not wanted.holds(left_m) and wanted.holds(-left_m)
    return hold(
        FindingKind.ASKED_SIDE if is_exchanged else FindingKind.ASKED_ACROSS,
        agents,
        f"The offset of {subject} to the left of the lane's centre",
        left_m,
        wanted,
    )


def _bounds(case: Case, spot: wish.Spot, band: Band, half_box_m: float) -> Bounds:
    """Return the requested place across its lane, left positive; anywhere in it by default."""
    lateral, allowed = spot.lateral, case.tolerances
    sign = case.lanes.side_sign(lateral, spot.lane)
    allowed_m = allowed.across_m if sign else allowed.middle_m
    span_m = find_across(lateral, sign, band.width_m, 2.0 * half_box_m)
    return Bounds(*span_m, allowed.edge_m if lateral is None else allowed_m)


def _cones(case: Case, party: Party, request: wish.ConesRequest, band: Band) -> Iterator[Finding]:
    """A line by its side of the lane, all other shapes by their middle and their first cone."""
    cones = sorted(party.placed, key=case.ahead_m)
    # Left of the middle of the lane that is asked for, in order along it.
    lefts = [case.left_m(cone) - band.left_m for cone in cones]
    spot, middle_m = request.spot, sum(lefts) / len(lefts)
    sign = case.lanes.side_sign(spot.lateral, spot.lane)
    is_line = request.shape is wish.Shape.LINE and sign != 0.0 and not request.both_sides
    leads_across = request.shape is wish.Shape.TAPER or request.both_sides
    wanted = _bounds(case, wish.Spot() if leads_across else spot, band, CONE_M / 2.0)
    if is_line and not is_exact(spot.lateral):
        edge_m = sign * band.width_m / 2.0
        # A cone at a boundary stands inside of it or outside: half a cone to either side.
        wanted = Bounds(edge_m, edge_m, max(case.tolerances.across_m, CONE_M))
    everyone = [*cones, *party.workers]
    yield _across(everyone, middle_m, wanted, subject="the middle of the cones")
    along_m = case.ahead_m(cones[-1]) - case.ahead_m(cones[0])
    leads_along, is_row = along_m > max(lefts) - min(lefts), request.shape is wish.Shape.ROW
    is_straight = is_row or (request.shape is wish.Shape.LINE and not request.both_sides)
    if is_straight and party.is_exact and len(cones) > 1 and leads_along is is_row:
        words = f"The cones are to stand {'across' if is_row else 'along'} the lane."
        yield find(FindingKind.ASKED_ACROSS, False, everyone, words)
    if is_line:
        return
    if request.ends_in_middle and party.is_exact:
        yield _across(cones[-1:], lefts[-1], Bounds(0.0, 0.0, case.tolerances.middle_m))
    begins_m = lefts[0] - lefts[-1]
    if request.shape is wish.Shape.TAPER and abs(begins_m) > _TAPER_M:
        start = case.lanes.kerb if request.start is None else request.start.sign
        side = wish.Side.LEFT if start > 0.0 else wish.Side.RIGHT
        words = f"The taper is to begin with {{agents[0]}} at the {side} of the lane."
        yield find(FindingKind.ASKED_SIDE, begins_m * start > 0.0, cones, words)


def check_spacing(case: Case) -> Iterator[Finding]:
    """The median gap between neighbours in a row, and from a worker to the cones."""
    for party in case.parties:
        request = party.request
        if isinstance(request, wish.VehicleRequest):
            yield from _in_row(case, party, request.spacing)
        elif isinstance(request, wish.ConesRequest):
            yield from _in_row(case, party, None if request.reach_m else request.spacing)
            for worker in party.workers if party.agents else ():
                nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
                yield hold(
                    FindingKind.ASKED_SPACING,
                    [worker, nearest],
                    "The distance of {agents[0]} from the nearest cone, {agents[1]},",
                    apart_m(worker, nearest),
                    Bounds(0.0, WORKER_M, 0.0),
                )


def _in_row(case: Case, party: Party, spacing: wish.Length | None) -> Iterator[Finding]:
    """From centre to centre, straight or along the ego's lane: whichever is nearer to the wish."""
    things, is_double = party.agents, getattr(party.request, "both_sides", False)
    if spacing is None or not party.is_exact or len(things) < 2 + is_double:
        return
    # Who stands in another is a fault of its own, which leaves gaps elsewhere.
    if any(apart_m(thing, other) <= thing.width_m for thing, other in combinations(things, 2)):
        return
    # Each one's nearest neighbour, in the middle of all of them.
    straight_m = median(
        min(apart_m(thing, other) for other in things if other is not thing) for thing in things
    )
    stations_m = sorted(case.ahead_m(thing) for thing in things)[:: 1 + is_double]
    along_m = median(after - before for before, after in pairwise(stations_m))
    wanted = case.gap(spacing)
    # Along both boundaries of a lane each one's neighbour stands across it.
    gap_m = along_m if is_double else min(straight_m, along_m, key=wanted.off)
    what = "The gap between neighbours in the row of {agents[0]}"
    yield hold(FindingKind.ASKED_SPACING, things, what, gap_m, wanted)


def in_order(case: Case, party: Party, request: wish.CrashRequest) -> tuple[TrafficAgent, ...]:
    """Return the vehicles of a party in the order in which the request names them."""
    if not 2 <= len(party.agents) <= MOST_ORDERED:
        return party.agents
    return min(
        permutations(party.agents),
        key=lambda order: (round(_misfit(case, order, request), 6), [agent.id for agent in order]),
    )


def _pairs(order: Sequence[TrafficAgent], request: wish.CrashRequest) -> list[_Pair]:
    """Neighbours in that order, with what is said of each further one."""
    cars = [*request.others, *[wish.CrashedCar()] * (len(order) - 1 - len(request.others))]
    return [(*two, car) for two, car in zip(pairwise(order), cars, strict=False)]


def _turn_deg(agent: TrafficAgent, other: TrafficAgent, car: wish.CrashedCar) -> float:
    """The turn of the second against the first, to the side that is asked for if it is open."""
    turn_deg = math.degrees(difference(other.heading_rad, agent.heading_rad))
    if car.turn_deg is None:
        return turn_deg
    if not car.is_signed:
        return math.copysign(turn_deg, car.turn_deg)
    # The same turn, as the number nearest to the one that is said.
    return car.turn_deg + math.remainder(turn_deg - car.turn_deg, 360.0)


def _misfit(case: Case, order: Sequence[TrafficAgent], request: wish.CrashRequest) -> float:
    places = {agent.id: case.route.locate_agent(agent) for agent in order}
    # Each part is divided by its tolerance, so that metres and degrees add up.
    misfit, span_m = 0.0, request.spot.span_m
    if span_m is not None:
        misfit = Bounds(*span_m, 0.0).off(places[order[0].id].ahead_m) / USUAL.distance_m
    for leader, other, car in _pairs(order, request):
        gap_m = apart_m(leader, other)
        misfit += gap_m / 100.0  # the nearest neighbours, where nothing is said
        if car.gap is not None:
            misfit += Bounds(*car.gap.span_m, 0.0).off(gap_m) / USUAL.spacing_m
        if car.turn_deg is not None:
            misfit += abs(_turn_deg(leader, other, car) - car.turn_deg) / USUAL.heading_deg
        here, there = places[leader.id], places[other.id]
        further_m = {
            wish.Bearing.AHEAD: there.ahead_m - here.ahead_m,
            wish.Bearing.BEHIND: here.ahead_m - there.ahead_m,
            wish.Bearing.LEFT: there.left_m - here.left_m,
            wish.Bearing.RIGHT: here.left_m - there.left_m,
        }[car.bearing or wish.Bearing.AHEAD]
        is_known = leader is order[0] or car.bearing is not None
        misfit += _MISPLACED[is_known] if further_m < 0.0 else 0.0
    return misfit


def check_crash(case: Case) -> Iterator[Finding]:
    """Angles (heading) and gaps (position) between neighbours, and a first one that lies across.

    Nothing is found where the number of vehicles is wrong or where they lie on each other, which
    are faults of their own: then nobody knows which of them is which.
    """
    for party in case.parties:
        request = party.request
        if not isinstance(request, wish.CrashRequest) or not party.is_exact:
            continue
        order = in_order(case, party, request)
        pairs = _pairs(order, request)
        if any(apart_m(agent, other) < agent.width_m for agent, other, _ in pairs):
            continue
        yield from _facing(case, request, order[0])
        for pair in pairs:
            yield from _neighbours(case, *pair)


def _neighbours(
    case: Case, agent: TrafficAgent, other: TrafficAgent, car: wish.CrashedCar
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


def _facing(case: Case, request: wish.CrashRequest, first: TrafficAgent) -> Iterator[Finding]:
    band = case.lanes.band(request.spot.lane or wish.LaneChoice.OWN, case.ahead_m(first))
    if band is None or request.facing in (None, wish.Facing.WITH_LANE):
        return
    wanted_deg = request.facing.turn_deg
    yield hold(
        FindingKind.ASKED_HEADING,
        [first],
        "The turn of {agents[0]} from its lane's direction, to either side,",
        abs(math.degrees(difference(first.heading_rad, band.tangent_rad))),
        Bounds(wanted_deg, wanted_deg, _ROUGHLY_DEG),
        unit="degrees",
    )
