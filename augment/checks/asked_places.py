"""Distances, places across the road and gaps against those that were asked for."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise
from statistics import median

from augment.checks.asked_crash import in_order
from augment.checks.finding import Finding, FindingKind, ahead_of, find, side_of
from augment.checks.lanes_across import Band
from augment.checks.parties import CRASH_M, WORKER_M, Asked, Party, apart_m, distance_outside
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, Point, TrafficAgent
from augment.scene.intent import (
    ConesRequest,
    CrashRequest,
    LaneChoice,
    Lateral,
    Length,
    Nearness,
    Relation,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)

_SLIGHT_M = 1.5
"""The end of the paper's range for a slight offset."""
_FAR_OUT_M = 3.0
"""How far beside the road something may stand that is to stand beside it."""
_TAPER_M = 1.0
"""Cones of which the last is this far across from the first run from one side to the other."""
_CONE_M = LENGTH_WIDTH_M[AgentType.TRAFFIC_CONE][1]
_HANDS = {Side.LEFT: 1.0, Side.RIGHT: -1.0}
LANES = {
    LaneChoice.OWN: "the ego's lane",
    LaneChoice.LEFT: "the lane on the left",
    LaneChoice.RIGHT: "the lane on the right",
    LaneChoice.ONCOMING: "the oncoming lane",
}


def asked_distance(asked: Asked) -> Iterator[Finding]:
    """One finding a request: wrong beyond the tolerance.

    A crash counts by its first vehicle, cones by the first, a ring by its middle, pedestrians
    by where a walk begins or meets the ego's route. Where the number is wrong, which is a fault of
    its own, any may be the first, and where the first is missing the next one is.
    """
    for party in asked.parties:
        span_m = party.request.spot.span_m
        if not party.placed or span_m is None:
            continue
        sign = -1.0 if party.request.spot.relation is Relation.BEHIND else 1.0
        low_m, high_m = sorted(sign * end for end in span_m)
        first, measured_m = _measured(asked, party, sign, (low_m, high_m))
        off_m = distance_outside(measured_m, low_m, high_m)
        allowed_m = asked.tolerances.distance_m
        words = "a place"
        if math.isfinite(high_m):
            share_m = asked.tolerances.distance_share * high_m
            allowed_m = max(allowed_m, share_m) + _to_next_m(party)
            to_high = " to {asked_high_m:.4g}" if high_m > low_m else ""
            words = f"{{asked_low_m:.4g}}{to_high} m"
        belongs_m = sign * min(max(measured_m, low_m), high_m)
        yield find(
            FindingKind.ASKED_DISTANCE,
            off_m <= allowed_m,
            [first, *(agent for agent in party.everyone if agent is not first)],
            f"{_subject(party)} is {{along_m:.1f}} m {ahead_of(measured_m * sign)} the ego along "
            f"its lane; {words} {'ahead' if sign > 0.0 else 'behind'} is asked for.",
            belongs_m=asked.route.position(belongs_m, asked.left_m(first)),
            along_m=measured_m,
            asked_low_m=low_m,
            asked_high_m=high_m if math.isfinite(high_m) else None,
            off_m=off_m,
        )


def _measured(
    asked: Asked, party: Party, sign: float, wanted_m: tuple[float, float]
) -> tuple[TrafficAgent, float]:
    """Who tells the distance, and the distance in the direction asked for."""
    request = party.request
    along = [(sign * asked.ahead_m(one), one.id, one) for one in (*party.placed, *party.spare)]
    if isinstance(request, WalkRequest):
        along += [
            (sign * asked.route.locate(*point).ahead_m, agent.id, agent)
            for agent in party.placed
            if (point := _meets_route(asked, agent))
        ]
    elif isinstance(request, ConesRequest) and request.shape is Shape.RING:
        return min(along)[2], sum(value for value, _, _ in along) / len(along)
    elif isinstance(request, CrashRequest) and party.is_exact:
        first = in_order(party, request, asked.route)[0]
        return first, sign * asked.ahead_m(first)
    elif not isinstance(request, CrashRequest) and party.is_exact:
        return min(along)[2], min(along)[0]
    value, _, agent = min(along, key=lambda item: (distance_outside(item[0], *wanted_m), item[1]))
    return agent, value


def _to_next_m(party: Party) -> float:
    """How much further the next one stands where one is missing."""
    if party.missing and isinstance(party.request, CrashRequest):
        return CRASH_M
    if party.missing and isinstance(party.request, ConesRequest) and party.request.spacing:
        return party.request.spacing.high_m
    return 0.0


def _meets_route(asked: Asked, agent: TrafficAgent) -> Point | None:
    """Where a walk is level with the middle of the ego's route, None if it never gets there."""
    if agent.walk_to_m is None:
        return None
    start, end = asked.left_m(agent), asked.route.locate(*agent.walk_to_m).left_m
    if start * end >= 0.0:
        return None
    share = start / (start - end)
    x_m, y_m = agent.walk_to_m
    return agent.x_m + share * (x_m - agent.x_m), agent.y_m + share * (y_m - agent.y_m)


def _subject(party: Party) -> str:
    match party.request:
        case CrashRequest():
            return "The first of the crashed vehicles, {agents[0]},"
        case ConesRequest(shape=Shape.RING):
            return "The middle of the cones"
        case ConesRequest():
            return "The first cone, {agents[0]},"
        case WalkRequest():
            return "The walk of {agents[0]}"
    return "{agents[0]}"


@dataclass(frozen=True, slots=True)
class _Wanted:
    """Where across its lane something belongs, left positive, and how far off it may be."""

    low_m: float
    high_m: float
    allowed_m: float

    def holds(self, left_m: float) -> bool:
        return distance_outside(left_m, self.low_m, self.high_m) <= self.allowed_m

    def is_exchanged(self, left_m: float) -> bool:
        """Whether it is right but for left and right: a fault of reasoning, not of the place."""
        return not self.holds(left_m) and self.holds(-left_m)


def asked_across(asked: Asked) -> Iterator[Finding]:
    """Vehicles by their offset, crashes and cones by the lane that they are in."""
    for party in asked.parties:
        request, lane = party.request, party.request.spot.lane
        if isinstance(request, WalkRequest) or not party.placed or lane is None:
            continue
        first = min(party.placed, key=lambda agent: (abs(asked.ahead_m(agent)), agent.id))
        band = asked.lanes.band(lane, asked.ahead_m(first))
        if band is None:
            continue
        if isinstance(request, VehicleRequest):
            for agent in party.placed:
                yield _vehicle(asked, request.spot.lateral, LANES[lane], agent, band)
        elif isinstance(request, ConesRequest):
            yield from _cones(asked, party, request, band)
        elif not party.missing:  # else the nearest may be missing, and the others lie anywhere
            if party.is_exact:
                first = in_order(party, request, asked.route)[0]
            left_m = asked.left_m(first) - band.left_m
            others = [agent for agent in party.everyone if agent is not first]
            subject = "The first of the crashed vehicles"
            yield _in_lane(asked, [first, *others], left_m, band, subject)


def _vehicle(
    asked: Asked, lateral: Lateral | None, lane: str, agent: TrafficAgent, band: Band
) -> Finding:
    left_m = asked.left_m(agent) - band.left_m
    if lateral is None:
        return _in_lane(asked, [agent], left_m, band, "{agents[0]}")
    wanted = _wanted(asked, lateral, band, agent.width_m / 2.0)
    if wanted.is_exchanged(left_m):
        return _other_side([agent], left_m, wanted)
    low, high = ("low", "high") if wanted.low_m >= 0.0 else ("high", "low")
    side = side_of(wanted.low_m + wanted.high_m)
    words = f"{{asked_{low}_m:.2g}} to {{asked_{high}_m:.2g}} m to the {side} is asked for"
    if wanted.low_m == wanted.high_m:
        words = f"{{asked_low_m:.2g}} m to the {side} is asked for"
        if wanted.low_m == 0.0:
            words = "the lane centre is asked for"
    belongs_m = band.left_m + min(max(left_m, wanted.low_m), wanted.high_m)
    return find(
        FindingKind.ASKED_ACROSS,
        wanted.holds(left_m),
        [agent],
        f"{{agents[0]}} is {{left_m:.2f}} m to the {side_of(left_m)} of the centre of {lane}; "
        f"{words}.",
        belongs_m=asked.route.position(asked.ahead_m(agent), belongs_m),
        left_m=left_m,
        asked_low_m=wanted.low_m,
        asked_high_m=wanted.high_m,
    )


def _wanted(asked: Asked, lateral: Lateral, band: Band, half_box_m: float) -> _Wanted:
    """Where a vehicle belongs; sides are those of the ego's direction."""
    sign, half_lane_m = asked.lanes.side_sign(lateral), band.width_m / 2.0
    if sign == 0.0:
        return _Wanted(0.0, 0.0, asked.tolerances.middle_m)
    if lateral.offset is not None:
        near_m, far_m = lateral.offset.low_m, lateral.offset.high_m
    else:
        near_m, far_m = {
            None: (0.0, half_lane_m),
            Nearness.SLIGHTLY: (0.0, _SLIGHT_M),
            Nearness.AT_EDGE: (half_lane_m - half_box_m, half_lane_m),
            Nearness.HALF_OUT: (half_lane_m, half_lane_m),
            Nearness.OUTSIDE: (half_lane_m + half_box_m, half_lane_m + half_box_m + _FAR_OUT_M),
        }[lateral.nearness]
    low_m, high_m = sorted((sign * near_m, sign * far_m))
    return _Wanted(low_m, high_m, asked.tolerances.across_m)


def _cones(asked: Asked, party: Party, request: ConesRequest, band: Band) -> Iterator[Finding]:
    """A line by its side of the lane, all other shapes by their middle and their first cone."""
    cones = sorted(party.placed, key=asked.ahead_m)
    everyone = [*cones, *party.workers]
    lefts = [asked.left_m(cone) - band.left_m for cone in cones]
    middle_m = sum(lefts) / len(lefts)
    sign = asked.lanes.side_sign(request.spot.lateral)
    if request.shape is Shape.LINE and sign and not request.both_sides:
        edge_m = sign * band.width_m / 2.0
        # A cone at a boundary stands inside of it or outside: half a cone to either side.
        wanted = _Wanted(edge_m, edge_m, max(asked.tolerances.across_m, _CONE_M))
        if wanted.is_exchanged(middle_m):
            yield _other_side(cones, middle_m, wanted)
            return
        yield find(
            FindingKind.ASKED_ACROSS,
            wanted.holds(middle_m),
            everyone,
            f"The line of cones is {{left_m:.2f}} m to the {side_of(middle_m)} of the lane "
            f"centre; the {side_of(edge_m)} boundary, {{asked_low_m:.2f}} m off, is asked for.",
            left_m=middle_m,
            asked_low_m=edge_m,
            asked_high_m=edge_m,
        )
        return
    yield _in_lane(asked, everyone, middle_m, band, "The middle of the cones")
    if request.ends_in_middle and party.is_exact:
        yield find(
            FindingKind.ASKED_ACROSS,
            abs(lefts[-1]) <= asked.tolerances.middle_m,
            cones[-1:],
            f"The last cone, {{agents[0]}}, is {{left_m:.2f}} m to the {side_of(lefts[-1])} of "
            "the lane centre, where the taper is to end.",
            left_m=lefts[-1],
        )
    begins = lefts[0] - lefts[-1]
    if request.shape is Shape.TAPER and abs(begins) > _TAPER_M:
        start = asked.lanes.kerb if request.start is None else _HANDS[request.start]
        yield find(
            FindingKind.ASKED_SIDE,
            begins * start > 0.0,
            cones,
            f"The taper begins at the {side_of(begins)} of the lane with {{agents[0]}}; the "
            f"{side_of(start)} is asked for.",
            first_left_m=lefts[0],
            last_left_m=lefts[-1],
        )


def _in_lane(
    asked: Asked, agents: Sequence[TrafficAgent], left_m: float, band: Band, subject: str
) -> Finding:
    return find(
        FindingKind.ASKED_ACROSS,
        abs(left_m) - band.width_m / 2.0 <= asked.tolerances.edge_m,
        agents,
        f"{subject} is {{left_m:.2f}} m to the {side_of(left_m)} of the centre of the lane that "
        "is asked for, which is {lane_width_m:.1f} m wide.",
        left_m=left_m,
        lane_width_m=band.width_m,
    )


def _other_side(agents: Sequence[TrafficAgent], left_m: float, wanted: _Wanted) -> Finding:
    return find(
        FindingKind.ASKED_SIDE,
        False,
        agents,
        f"{{agents[0]}} is {{left_m:.2f}} m to the {side_of(left_m)} of the lane centre; the same "
        f"to the {side_of(wanted.low_m + wanted.high_m)} is asked for: left and right are "
        "exchanged.",
        left_m=left_m,
        asked_low_m=wanted.low_m,
        asked_high_m=wanted.high_m,
    )


def asked_spacing(asked: Asked) -> Iterator[Finding]:
    """The median gap between neighbours in a row, and from a worker to the cones."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, VehicleRequest):
            yield from _in_row(asked, party, request.spacing, "vehicles")
        if not isinstance(request, ConesRequest):
            continue
        wanted = request.spacing if request.reach_m is None else None
        yield from _in_row(asked, party, wanted, "cones")
        for worker in party.workers if party.agents else ():
            nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
            gap_m, pair = apart_m(worker, nearest), [worker, nearest]
            words = "The worker {agents[0]} is {gap_m:.1f} m from the nearest cone, {agents[1]}."
            yield find(FindingKind.ASKED_SPACING, gap_m <= WORKER_M, pair, words, gap_m=gap_m)
            if request.post_side is None:
                continue
            left_m = asked.left_m(worker) - asked.left_m(nearest)
            words = (
                f"The worker {{agents[0]}} stands to the {side_of(left_m)} of {{agents[1]}}; the "
                f"{request.post_side} is asked for."
            )
            fits = side_of(left_m) == request.post_side
            yield find(FindingKind.ASKED_SIDE, fits, pair, words, left_m=left_m)


def _in_row(asked: Asked, party: Party, wanted: Length | None, what: str) -> Iterator[Finding]:
    """From centre to centre, straight or along the ego's lane: whichever is nearer to the wish."""
    things = party.agents
    if wanted is None or not party.is_exact or len(things) < 2:
        return
    # Who stands in another is a fault of its own, which leaves gaps elsewhere.
    if any(apart_m(one, other) <= one.width_m for one, other in combinations(things, 2)):
        return
    straight_m = median(
        min(apart_m(one, other) for other in things if other is not one) for one in things
    )
    stations_m = sorted(asked.ahead_m(one) for one in things)
    along_m = median(after - before for before, after in pairwise(stations_m))
    gap_m = min(
        straight_m, along_m, key=lambda m: distance_outside(m, wanted.low_m, wanted.high_m)
    )
    yield find(
        FindingKind.ASKED_SPACING,
        asked.fits_gap(gap_m, wanted),
        things,
        f"The {what} stand {{gap_m:.1f}} m apart; {{asked_m:.1f}} m are asked for.",
        gap_m=gap_m,
        asked_m=wanted.middle_m,
    )
