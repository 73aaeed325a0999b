"""Counts, types, motion, headings and walks against those that were asked for."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from augment.checks.bodies import end_of_walk, name_type
from augment.checks.finding import Finding, FindingKind, find
from augment.checks.lanes_across import Band, LanePlace, find_place
from augment.checks.parties import SPEED_MPS, SPEED_SHARE, Bounds, Case, apart_m, hold
from augment.geometry.frames import difference
from augment.scene.entities import STOPPED_BELOW_MPS, TrafficAgent
from augment.scene.intent import Body, CrashRequest, Facing, Side, VehicleRequest, WalkRequest

_ON_ROAD_M = 1.0
"""Who begins so near the middle of the ego's lane comes from no side of it."""
_ALONG_SHARE = 0.2
"""Who looks less than this across the road (some 12 degrees) looks along it."""
_NO_FRONT = frozenset({Body.BARRIER, Body.CONSTRUCTION_SIGN, Body.TRAFFIC_CONE, Body.PEDESTRIAN})


def check_count(case: Case) -> Iterator[Finding]:
    """Find missing objects and objects that nobody asked for."""
    for party in case.parties:
        for role, number in party.missing:
            words = f"Asked for and not there: {role}, {number} of them."
            yield find(FindingKind.ASKED_COUNT, False, party.everyone, words)
    for agent in case.surplus:
        words = f"{{agents[0]}}, {name_type(agent.type)}, is more than was asked for."
        yield find(FindingKind.ASKED_COUNT, False, [agent], words)


def check_type(case: Case) -> Iterator[Finding]:
    """Find objects of another type than the requested one."""
    for party in case.parties:
        for agent, role in party.mistyped:
            words = f"{{agents[0]}} is {name_type(agent.type)}; a {role} is asked for."
            yield find(FindingKind.ASKED_TYPE, False, [agent], words)


def check_motion(case: Case) -> Iterator[Finding]:
    """The speed of vehicles: those that are to stand do, the others drive as fast as said."""
    for party in case.parties:
        wanted_mps = 0.0 if isinstance(party.request, CrashRequest) else None
        if isinstance(party.request, VehicleRequest):
            wanted_mps = party.request.speed_mps
        if wanted_mps is None:
            continue
        # Who is to stand stands: the tolerance of speeds would let it creep.
        allowed_mps = max(SPEED_MPS, SPEED_SHARE * wanted_mps) if wanted_mps else STOPPED_BELOW_MPS
        wanted = Bounds(wanted_mps, wanted_mps, allowed_mps)
        for agent in party.agents:
            what, kind = "The speed of {agents[0]}", FindingKind.ASKED_MOTION
            yield hold(kind, [agent], what, agent.speed_mps, wanted, unit="m/s")


def check_changes(case: Case) -> Iterator[Finding]:
    """Agents of the scene that are to be moved or removed and were not, or the reverse.

    What is done about a wish that can't be met is not asked for either.
    """
    change = case.modification
    moved, removed = {agent.id for agent in change.moved}, set(change.removed)
    for names, kind, words in (
        (case.to_move - moved, FindingKind.ASKED_COUNT, "is to be moved and is not"),
        (case.to_remove - removed, FindingKind.ASKED_COUNT, "is to be removed and is not"),
        (moved - case.to_move, FindingKind.UNASKED, "is moved; nobody asked for that"),
        (removed - case.to_remove, FindingKind.UNASKED, "is removed; nobody asked for that"),
    ):
        for name in sorted(names):
            yield find(kind, False, [name], f"{{agents[0]}} {words}.")
    touched = [agent.id for agent in change.changed] + sorted(removed)
    if case.unmet and touched:
        why = case.unmet.replace("{", "{{").replace("}", "}}")
        words = f"The wish can't be met, and {{agents[0]}} is changed: {why}"
        yield find(FindingKind.UNASKED, False, touched, words)


def check_heading(case: Case) -> Iterator[Finding]:
    """Vehicles against their lane; those that have crashed are told by `check_crash`.

    As its lane leads where nothing is said: what else would say so stands in the sentence.
    """
    for party in case.parties:
        request = party.request
        if not isinstance(request, VehicleRequest):
            continue
        if request.body in _NO_FRONT and request.facing is None:
            continue
        facing = request.facing or Facing.WITH_LANE
        wanted_deg = facing.turn_deg + request.turn_deg
        wanted = Bounds(wanted_deg, wanted_deg, case.tolerances.heading_deg)
        for agent in party.agents:
            band: Band | LanePlace | None = None
            if request.spot.lane is not None:
                band = case.lanes.band(request.spot.lane, case.ahead_m(agent))
            elif request.facing and agent in case.modification.moved:
                band = find_place(case.lanes, (agent.x_m, agent.y_m))
            if band is None:
                continue
            turn_rad = agent.heading_rad - band.tangent_rad
            if request.body is Body.BARRIER and agent.width_m > agent.length_m:
                turn_rad += math.pi / 2.0  # its longer side is what leads across
            # Across is either way, and what has no front may be turned round.
            is_round = facing is Facing.ACROSS or request.body in _NO_FRONT
            turns_rad = (turn_rad, turn_rad + math.pi) if is_round else (turn_rad,)
            yield hold(
                FindingKind.ASKED_HEADING,
                [agent],
                "The turn of {agents[0]} to the left of its lane's direction",
                min((unwrap_deg(turn, wanted_deg) for turn in turns_rad), key=wanted.off),
                wanted,
                unit="degrees",
            )


def unwrap_deg(turn_rad: float, near_deg: float) -> float:
    """Return a turn in degrees, as the number of it that is nearest to another."""
    turn_deg = math.degrees(difference(turn_rad, 0.0))
    # Of equally near ones the smallest turn.
    turns_deg = (turn_deg, turn_deg + 360.0, turn_deg - 360.0)
    return min(turns_deg, key=lambda turn: (round(abs(turn - near_deg), 6), abs(turn)))


def check_walk(case: Case) -> Iterator[Finding]:
    """Side (a fault of logic), direction (of heading), crossing (of logic): the first one wrong.

    Of walks that cross as asked also where they end along the lane, and the gaps of a file.

    Looking or walking away from the road is a fault of the heading, as in the paper; that such a
    walk crosses nothing follows from it.
    """
    for party in case.parties:
        request = party.request
        if not isinstance(request, WalkRequest):
            continue
        crossings = [_crossing(case, agent, request) for agent in party.agents]
        yield from crossings
        for agent, crossing in zip(party.agents, crossings, strict=True):
            end = end_of_walk(agent)
            if request.drift_m is None or end is None or crossing.is_fault:
                continue
            drift_m = case.route.locate(*end).ahead_m - case.ahead_m(agent)
            wanted = Bounds(request.drift_m, request.drift_m, case.tolerances.drift_m)
            what = "The way of {agents[0]} along the ego's lane while it crosses"
            yield hold(FindingKind.ASKED_DISTANCE, [agent], what, drift_m, wanted)
        if party.is_exact and not any(crossing.is_fault for crossing in crossings):
            yield from _in_file(case, party.agents, request)


def _crossing(case: Case, agent: TrafficAgent, request: WalkRequest) -> Finding:
    """The first thing that is wrong about a walk; where the side is open it is its own."""
    place, end = case.route.locate_agent(agent), end_of_walk(agent)
    side = request.start or (Side.LEFT if place.left_m >= 0.0 else Side.RIGHT)
    # From here on, numbers to the side of the start are positive.
    from_m = place.left_m * side.sign
    to_m = math.nan if end is None else case.route.locate(*end).left_m * side.sign
    # Negative towards the other side of the road, 0 along it.
    looks = math.sin(agent.heading_rad - place.tangent_rad) * side.sign
    goes_back = to_m - from_m > _ON_ROAD_M
    if from_m < -_ON_ROAD_M and goes_back:
        kind, reason = FindingKind.ASKED_SIDE, "it crosses from the other side"
    elif looks > -_ALONG_SHARE or goes_back:
        kind, reason = FindingKind.ASKED_HEADING, "it looks or walks away from there"
    else:
        kind, reason = FindingKind.ASKED_CROSSING, "its walk ends elsewhere"
    # Where it ends is checked by itself where that is said.
    ends = to_m < 0.0 or request.end is not None
    fits = kind is FindingKind.ASKED_CROSSING and ends and from_m > -_ON_ROAD_M
    if fits and end and request.end is None and (agent.walk_to_m or agent.motion):
        # Over the lanes side by side, metre by metre, up to a step past where the walk ends.
        ahead_m, past_m = case.route.locate(*end).ahead_m, _ON_ROAD_M - to_m
        steps = (*range(math.ceil(past_m)), past_m)
        points = [case.route.position(ahead_m, -side.sign * step) for step in steps]
        fits = not all(any(lane.covers for lane in case.route.graph.beside(*p)) for p in points)
    words = f"{{agents[0]}} is to cross the ego's way from the {side}"
    return find(kind, fits, [agent], f"{words}, as it does." if fits else f"{words}: {reason}.")


def _in_file(
    case: Case, walkers: Sequence[TrafficAgent], request: WalkRequest
) -> Iterator[Finding]:
    """Check each walker's distance behind the first one, who is furthest across."""
    if not request.behind or request.start is None:
        return
    sign = request.start.sign
    # Who is furthest from the side of the start is the first of the file.
    first, *others = sorted(walkers, key=lambda agent: sign * case.left_m(agent))
    if any(apart_m(*pair) < first.length_m for pair in combinations(walkers, 2)):
        return  # who stands in another is a fault of its own
    for other, gap in zip(others, request.behind, strict=False):
        what, pair = "The distance of {agents[0]} from {agents[1]}", [other, first]
        yield hold(FindingKind.ASKED_SPACING, pair, what, apart_m(first, other), case.gap(gap))
