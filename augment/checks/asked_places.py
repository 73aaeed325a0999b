"""Distances, places across the road and gaps against those that were asked for."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, pairwise
from statistics import median

from augment.checks.asked_crash import in_order
from augment.checks.bodies import end_of_walk
from augment.checks.finding import Finding, FindingKind, find
from augment.checks.lanes_across import Band
from augment.checks.parties import CRASH_M, Bounds, Case, Party, apart_m, hold, meets_route
from augment.checks.wish_places import EVERYWHERE, find_across, find_off, list_stations
from augment.checks.wish_shapes import CONE_M, WORKER_M
from augment.scene import intent as wish
from augment.scene.entities import TrafficAgent

_TAPER_M = 1.0
"""Cones of which the last is this far across from the first run from one side to the other."""


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
    agents = [*party.placed, *party.spare]
    ahead = [(case.ahead_m(agent), agent) for agent in agents]
    first_m, first = min(ahead, key=lambda item: (sign * item[0], item[1].id))
    if _is_ring(party):
        return first, sum(value for value, _ in ahead) / len(ahead)
    if isinstance(request, wish.CrashRequest) and party.is_exact:
        first = in_order(party, request, case.route)[0]
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
                wanted = _bounds(case, request.spot.lateral, band, agent.width_m / 2.0)
                left_m = case.left_m(agent) - band.left_m
                yield _across([agent], left_m, wanted)
        elif isinstance(request, wish.ConesRequest):
            yield from _cones(case, party, request, band)
        elif (
            isinstance(request, wish.CrashRequest) and not party.missing
        ):  # else the nearest may be missing, and the others lie anywhere
            if party.is_exact:
                first = in_order(party, request, case.route)[0]
            others = [agent for agent in party.everyone if agent is not first]
            left_m = case.left_m(first) - band.left_m
            yield _across([first, *others], left_m, _bounds(case, None, band, 0.0))


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
                    yield _across([agent], place.left_m, _bounds(case, lateral, band, 0.0))


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


def _bounds(case: Case, lateral: wish.Lateral | None, band: Band, half_box_m: float) -> Bounds:
    """Return the requested place across its lane, left positive; anywhere in it by default."""
    sign, allowed = case.lanes.side_sign(lateral), case.tolerances
    allowed_m = allowed.across_m if sign else allowed.middle_m
    span_m = find_across(lateral, sign, band.width_m, 2.0 * half_box_m)
    return Bounds(*span_m, allowed.edge_m if lateral is None else allowed_m)


def _cones(case: Case, party: Party, request: wish.ConesRequest, band: Band) -> Iterator[Finding]:
    """A line by its side of the lane, all other shapes by their middle and their first cone."""
    cones = sorted(party.placed, key=case.ahead_m)
    # Left of the middle of the lane that is asked for, in order along it.
    lefts = [case.left_m(cone) - band.left_m for cone in cones]
    sign, middle_m = case.lanes.side_sign(request.spot.lateral), sum(lefts) / len(lefts)
    is_line = request.shape is wish.Shape.LINE and sign != 0.0 and not request.both_sides
    wanted = _bounds(case, None, band, 0.0)
    if is_line:
        edge_m = sign * band.width_m / 2.0
        # A cone at a boundary stands inside of it or outside: half a cone to either side.
        wanted = Bounds(edge_m, edge_m, max(case.tolerances.across_m, CONE_M))
    everyone = [*cones, *party.workers]
    yield _across(everyone, middle_m, wanted, subject="the middle of the cones")
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
    things = party.agents
    if spacing is None or not party.is_exact or len(things) < 2:
        return
    # Who stands in another is a fault of its own, which leaves gaps elsewhere.
    if any(apart_m(thing, other) <= thing.width_m for thing, other in combinations(things, 2)):
        return
    # Each one's nearest neighbour, in the middle of all of them.
    straight_m = median(
        min(apart_m(thing, other) for other in things if other is not thing) for thing in things
    )
    stations_m = sorted(case.ahead_m(thing) for thing in things)
    along_m = median(after - before for before, after in pairwise(stations_m))
    wanted = case.gap(spacing)
    gap_m = min(straight_m, along_m, key=wanted.off)
    what = "The gap between neighbours in the row of {agents[0]}"
    yield hold(FindingKind.ASKED_SPACING, things, what, gap_m, wanted)
