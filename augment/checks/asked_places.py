"""How cones, their worker and vehicles in a row stand to each other, against what is asked."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise, permutations
from statistics import median

from augment.checks.finding import Finding, FindingKind
from augment.checks.lanes_across import Band
from augment.checks.parties import (
    CRASH_M,
    USUAL,
    WORKER_M,
    Asked,
    Party,
    Tolerances,
    distance_outside,
    facing_words,
    severity_of,
    side_of,
)
from augment.geometry.frames import difference
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import (
    Bearing,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    Nearness,
    Relation,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)


def asked_spacing(asked: Asked) -> Iterator[Finding]:
    """The median gap between neighbours in a row, and from a worker to the cones."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, ConesRequest):
            yield from _around_cones(asked, party, request)
        elif isinstance(request, VehicleRequest):
            yield from _in_row(asked, party, request.spacing, _VEHICLES)


def fits_gap(asked: Asked, gap_m: float, wanted: Length) -> bool:
    """Whether two things are as far apart as is asked for."""
    allowed_m = max(asked.tolerances.spacing_m, asked.tolerances.spacing_share * wanted.high_m)
    return distance_outside(gap_m, wanted.low_m, wanted.high_m) <= allowed_m


def apart_m(one: TrafficAgent, other: TrafficAgent) -> float:
    """From centre to centre."""
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m)


def _around_cones(asked: Asked, party: Party, request: ConesRequest) -> Iterator[Finding]:
    wanted = request.spacing if request.reach_m is None else None
    yield from _in_row(asked, party, wanted, _CONES)
    for worker in party.workers:
        if party.agents:
            yield _worker(worker, party)
            if request.post_side is not None:
                yield _worker_side(asked, worker, party, request.post_side)


def _are_apart(cones: Sequence[TrafficAgent]) -> bool:
    """Whether none stands in another, which is a fault of its own and leaves gaps elsewhere."""
    pairs = combinations(cones, 2)
    return all(apart_m(one, other) > one.width_m for one, other in pairs)


def _in_row(asked: Asked, party: Party, wanted: Length | None, template: str) -> Iterator[Finding]:
    """From centre to centre, straight or along the ego's lane: whichever is nearer to the wish."""
    things = party.agents
    if wanted is None or not party.is_exact or len(things) < 2 or not _are_apart(things):
        return
    straight_m = median(
        min(apart_m(one, other) for other in things if other is not one) for one in things
    )
    stations_m = sorted(asked.ahead_m(one) for one in things)
    along_m = median(after - before for before, after in pairwise(stations_m))
    gap_m = min(
        straight_m, along_m, key=lambda m: distance_outside(m, wanted.low_m, wanted.high_m)
    )
    yield Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=fits_gap(asked, gap_m, wanted)),
        agents=tuple(one.id for one in things),
        measured={"gap_m": gap_m, "asked_m": wanted.middle_m},
        template=template,
    )


def _worker(worker: TrafficAgent, party: Party) -> Finding:
    nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
    return Finding(
        kind=FindingKind.ASKED_SPACING,
        severity=severity_of(fits=apart_m(worker, nearest) <= WORKER_M),
        agents=(worker.id, nearest.id),
        measured={"gap_m": apart_m(worker, nearest)},
        template="The worker {agents[0]} is {gap_m:.1f} m from the nearest cone, {agents[1]}.",
    )


def _worker_side(asked: Asked, worker: TrafficAgent, party: Party, side: Side) -> Finding:
    nearest = min(party.agents, key=lambda cone: (apart_m(worker, cone), cone.id))
    left_m = asked.left_m(worker) - asked.left_m(nearest)
    return Finding(
        kind=FindingKind.ASKED_SIDE,
        severity=severity_of(fits=side_of(left_m) == side.value),
        agents=(worker.id, nearest.id),
        measured={"left_m": left_m},
        template=(
            f"The worker {{agents[0]}} stands to the {side_of(left_m)} of {{agents[1]}}; the "
            f"{side.value} is asked for."
        ),
    )


_CONES = "The cones stand {gap_m:.1f} m apart; {asked_m:.1f} m are asked for."
_VEHICLES = "The vehicles stand {gap_m:.1f} m apart; {asked_m:.1f} m are asked for."


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


_SLIGHT_M = 1.5
"""The end of the paper's range for a slight offset."""
_FAR_OUT_M = 3.0
"""How far beside the road something may stand that is to stand beside it."""
_TAPER_M = 1.0
"""Cones of which the last is this far across from the first run from one side to the other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Wanted:
    """Where across its lane something belongs, left positive, and how far off it may be."""

    low_m: float
    high_m: float
    allowed_m: float

    def off_m(self, left_m: float) -> float:
        return distance_outside(left_m, self.low_m, self.high_m)

    @property
    def mirrored(self) -> _Wanted:
        return _Wanted(low_m=-self.high_m, high_m=-self.low_m, allowed_m=self.allowed_m)


def asked_across(asked: Asked) -> Iterator[Finding]:
    """Vehicles by their offset, crashes and cones by the lane that they are in."""
    for party in asked.parties:
        request = party.request
        lane = request.spot.lane
        if isinstance(request, WalkRequest) or not party.placed or lane is None:
            continue
        first = min(party.placed, key=lambda one: (abs(asked.ahead_m(one)), one.id))
        band = asked.lanes.band(lane, asked.ahead_m(first))
        if band is None:
            continue
        if isinstance(request, VehicleRequest):
            for agent in party.placed:
                yield _vehicle(asked, request.spot.lateral, lane, agent, band)
        elif isinstance(request, CrashRequest) and party.missing:
            continue  # it may be the nearest that is missing, and the others lie anywhere
        elif isinstance(request, CrashRequest):
            if party.is_exact:
                first = in_order(party, request, asked.route)[0]
            left_m = asked.left_m(first) - band.left_m
            others = (one for one in party.everyone if one is not first)
            yield _in_lane(
                asked, (first, *others), left_m, band, "The first of the crashed vehicles"
            )
        elif isinstance(request, ConesRequest):
            yield from _cones(asked, party, request, band)


def side_sign(lateral: Lateral | None, *, kerb: float) -> float:
    """1 to the left of the ego's direction, -1 to the right, 0 for the lane's centre.

    Args:
        lateral: Where across the lane something is to be.
        kerb: On which side the kerb is, 1 left and -1 right.
    """
    if lateral is None:
        return 0.0
    return _SIGNS[lateral.target] or kerb * _KERB_SIGNS[lateral.target]


def _vehicle(
    asked: Asked, lateral: Lateral | None, choice: LaneChoice, agent: TrafficAgent, band: Band
) -> Finding:
    left_m = asked.left_m(agent) - band.left_m
    if lateral is None:
        return _in_lane(asked, (agent,), left_m, band, "{agents[0]}")
    wanted = _wanted(asked, lateral, band, agent.width_m / 2.0)
    is_other_side = (
        wanted.off_m(left_m) > wanted.allowed_m
        and wanted.mirrored.off_m(left_m) <= wanted.allowed_m
    )
    if is_other_side:
        return _other_side((agent,), left_m, wanted)
    belongs_m = band.left_m + min(max(left_m, wanted.low_m), wanted.high_m)
    lane = _LANES[choice]
    if wanted.low_m == wanted.high_m == 0.0:
        words = "the lane centre is asked for"
    elif wanted.low_m == wanted.high_m:
        words = f"{{asked_low_m:.2g}} m to the {side_of(wanted.low_m)} is asked for"
    else:
        low, high = ("low", "high") if wanted.low_m >= 0.0 else ("high", "low")
        side = side_of(wanted.low_m + wanted.high_m)
        words = f"{{asked_{low}_m:.2g}} to {{asked_{high}_m:.2g}} m to the {side} is asked for"
    return Finding(
        kind=FindingKind.ASKED_ACROSS,
        severity=severity_of(fits=wanted.off_m(left_m) <= wanted.allowed_m),
        agents=(agent.id,),
        belongs_m=asked.route.position(asked.ahead_m(agent), belongs_m),
        measured={"left_m": left_m, "asked_low_m": wanted.low_m, "asked_high_m": wanted.high_m},
        template=(
            f"{{agents[0]}} is {{left_m:.2f}} m to the {side_of(left_m)} of the centre of "
            f"{lane}; {words}."
        ),
    )


def _wanted(asked: Asked, lateral: Lateral, band: Band, half_box_m: float) -> _Wanted:
    """Where a vehicle belongs; sides are those of the ego's direction."""
    sign, tolerances = side_sign(lateral, kerb=asked.kerb), asked.tolerances
    if sign == 0.0:
        return _Wanted(low_m=0.0, high_m=0.0, allowed_m=tolerances.middle_m)
    half_lane_m = band.width_m / 2.0
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
    return _Wanted(low_m=low_m, high_m=high_m, allowed_m=tolerances.across_m)


def _cones(asked: Asked, party: Party, request: ConesRequest, band: Band) -> Iterator[Finding]:
    """A line by its side of the lane, all other shapes by their middle and their first cone."""
    cones = sorted(party.placed, key=asked.ahead_m)
    everyone = (*cones, *party.workers)
    lefts = [asked.left_m(cone) - band.left_m for cone in cones]
    middle_m = sum(lefts) / len(lefts)
    sign = side_sign(request.spot.lateral, kerb=asked.kerb)
    if request.shape is Shape.LINE and sign and not request.both_sides:
        edge_m = sign * band.width_m / 2.0
        across_m = _line_m(asked.tolerances)
        wanted = _Wanted(low_m=edge_m, high_m=edge_m, allowed_m=across_m)
        if wanted.off_m(middle_m) > across_m >= wanted.mirrored.off_m(middle_m):
            yield _other_side(cones, middle_m, wanted)
            return
        yield Finding(
            kind=FindingKind.ASKED_ACROSS,
            severity=severity_of(fits=wanted.off_m(middle_m) <= across_m),
            agents=tuple(agent.id for agent in everyone),
            measured={"left_m": middle_m, "asked_low_m": edge_m, "asked_high_m": edge_m},
            template=(
                f"The line of cones is {{left_m:.2f}} m to the {side_of(middle_m)} of the lane "
                f"centre; the {side_of(edge_m)} boundary, {{asked_low_m:.2f}} m off, is asked "
                "for."
            ),
        )
        return
    yield _in_lane(asked, everyone, middle_m, band, "The middle of the cones")
    if request.ends_in_middle and party.is_exact:
        yield _last_in_middle(asked, cones, lefts[-1])
    if request.shape is Shape.TAPER and abs(lefts[0] - lefts[-1]) > _TAPER_M:
        start = asked.kerb if request.start is None else _HANDS[request.start]
        yield _taper_side(cones, lefts, start)


def _last_in_middle(asked: Asked, cones: Sequence[TrafficAgent], left_m: float) -> Finding:
    return Finding(
        kind=FindingKind.ASKED_ACROSS,
        severity=severity_of(fits=abs(left_m) <= asked.tolerances.middle_m),
        agents=(cones[-1].id,),
        measured={"left_m": left_m},
        template=(
            f"The last cone, {{agents[0]}}, is {{left_m:.2f}} m to the {side_of(left_m)} of the "
            "lane centre, where the taper is to end."
        ),
    )


def _taper_side(cones: Sequence[TrafficAgent], lefts: Sequence[float], start: float) -> Finding:
    begins = lefts[0] - lefts[-1]
    return Finding(
        kind=FindingKind.ASKED_SIDE,
        severity=severity_of(fits=begins * start > 0.0),
        agents=tuple(cone.id for cone in cones),
        measured={"first_left_m": lefts[0], "last_left_m": lefts[-1]},
        template=(
            f"The taper begins at the {side_of(begins)} of the lane with {{agents[0]}}; the "
            f"{side_of(start)} is asked for."
        ),
    )


def _in_lane(
    asked: Asked, agents: Sequence[TrafficAgent], left_m: float, band: Band, what: str
) -> Finding:
    beyond_m = abs(left_m) - band.width_m / 2.0
    return Finding(
        kind=FindingKind.ASKED_ACROSS,
        severity=severity_of(fits=beyond_m <= asked.tolerances.edge_m),
        agents=tuple(agent.id for agent in agents),
        measured={"left_m": left_m, "lane_width_m": band.width_m},
        template=(
            f"{what} is {{left_m:.2f}} m to the {side_of(left_m)} of the centre of the lane that "
            "is asked for, which is {lane_width_m:.1f} m wide."
        ),
    )


def _other_side(agents: Sequence[TrafficAgent], left_m: float, wanted: _Wanted) -> Finding:
    asked = side_of(wanted.low_m + wanted.high_m)
    return Finding(
        kind=FindingKind.ASKED_SIDE,
        severity=severity_of(fits=False),
        agents=tuple(agent.id for agent in agents),
        measured={"left_m": left_m, "asked_low_m": wanted.low_m, "asked_high_m": wanted.high_m},
        template=(
            f"{{agents[0]}} is {{left_m:.2f}} m to the {side_of(left_m)} of the lane centre; the "
            f"same to the {asked} is asked for: left and right are exchanged."
        ),
    )


def _line_m(tolerances: Tolerances) -> float:
    """A cone at a boundary stands inside of it or outside: half a cone to either side."""
    return max(tolerances.across_m, _CONE_M)


_CONE_M = LENGTH_WIDTH_M[AgentType.TRAFFIC_CONE][1]
_HANDS = {Side.LEFT: 1.0, Side.RIGHT: -1.0}
_SIGNS = {
    LateralTarget.LEFT_BOUNDARY: 1.0,
    LateralTarget.RIGHT_BOUNDARY: -1.0,
    LateralTarget.KERB: 0.0,
    LateralTarget.CENTRE_LINE: 0.0,
    LateralTarget.LANE_CENTRE: 0.0,
}
_KERB_SIGNS = {
    LateralTarget.LEFT_BOUNDARY: 0.0,
    LateralTarget.RIGHT_BOUNDARY: 0.0,
    LateralTarget.KERB: 1.0,
    LateralTarget.CENTRE_LINE: -1.0,
    LateralTarget.LANE_CENTRE: 0.0,
}
_LANES = {
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
        if party.placed and span_m is not None:
            yield _finding(asked, party, span_m)


def _finding(asked: Asked, party: Party, span_m: tuple[float, float]) -> Finding:
    sign = -1.0 if party.request.spot.relation is Relation.BEHIND else 1.0
    low_m, high_m = sorted(sign * one for one in span_m)
    first, measured_m = _measured(asked, party, sign, (low_m, high_m))
    off_m = distance_outside(measured_m, low_m, high_m)
    allowed_m = asked.tolerances.distance_m
    if math.isfinite(high_m):
        allowed_m = max(allowed_m, asked.tolerances.distance_share * high_m) + _to_next_m(party)
    side = "ahead of" if measured_m * sign >= 0.0 else "behind"
    what, place = _words(party, low_m, high_m)
    belongs_m = sign * min(max(measured_m, low_m), high_m)
    words = f"{place} ahead is asked for" if sign > 0.0 else f"{place} behind is asked for"
    return Finding(
        kind=FindingKind.ASKED_DISTANCE,
        severity=severity_of(fits=off_m <= allowed_m),
        agents=(first.id, *(agent.id for agent in party.everyone if agent is not first)),
        belongs_m=asked.route.position(belongs_m, asked.left_m(first)),
        measured={
            "along_m": measured_m,
            "asked_low_m": low_m,
            "asked_high_m": high_m if math.isfinite(high_m) else None,
            "off_m": off_m,
        },
        template=f"{what} is {{along_m:.1f}} m {side} the ego along its lane; {words}.",
    )


def _measured(
    asked: Asked, party: Party, sign: float, wanted_m: tuple[float, float]
) -> tuple[TrafficAgent, float]:
    """Who tells the distance, and the distance in the direction asked for."""
    request = party.request
    along = [(sign * asked.ahead_m(one), one) for one in (*party.placed, *party.spare)]
    if isinstance(request, WalkRequest):
        along += [
            (sign * asked.route.locate(*point).ahead_m, one)
            for one in party.placed
            for point in _ends_on_road(asked, one)
        ]
    elif isinstance(request, ConesRequest) and request.shape is Shape.RING:
        middle_m = sum(value for value, _ in along) / len(along)
        return min(along, key=lambda item: (item[0], item[1].id))[1], middle_m
    elif isinstance(request, CrashRequest) and party.is_exact:
        first = in_order(party, request, asked.route)[0]
        return first, sign * asked.ahead_m(first)
    elif isinstance(request, (ConesRequest, VehicleRequest)) and party.is_exact:
        value, agent = min(along, key=lambda item: (item[0], item[1].id))
        return agent, value
    value, agent = min(along, key=lambda item: (distance_outside(item[0], *wanted_m), item[1].id))
    return agent, value


def _to_next_m(party: Party) -> float:
    """How much further the next one stands where one is missing."""
    if not party.missing:
        return 0.0
    if isinstance(party.request, CrashRequest):
        return CRASH_M
    spacing = party.request.spacing if isinstance(party.request, ConesRequest) else None
    return 0.0 if spacing is None else spacing.high_m


def _ends_on_road(asked: Asked, agent: TrafficAgent) -> Iterator[tuple[float, float]]:
    """Where a walk is level with the middle of the ego's route, if it gets there."""
    if agent.walk_to_m is None:
        return
    start, end = asked.left_m(agent), asked.route.locate(*agent.walk_to_m).left_m
    if start * end < 0.0:
        share = start / (start - end)
        yield (
            agent.x_m + share * (agent.walk_to_m[0] - agent.x_m),
            agent.y_m + share * (agent.walk_to_m[1] - agent.y_m),
        )


def _words(party: Party, low_m: float, high_m: float) -> tuple[str, str]:
    request = party.request
    what: str
    if isinstance(request, CrashRequest):
        what = "The first of the crashed vehicles, {agents[0]},"
    elif isinstance(request, ConesRequest):
        is_ring = request.shape is Shape.RING
        first = "The first cone, {agents[0]},"
        what = "The middle of the cones" if is_ring else first
    elif isinstance(request, WalkRequest):
        what = "The walk of {agents[0]}"
    else:
        what = "{agents[0]}"
    if not math.isfinite(high_m):
        return what, "a place"
    if high_m > low_m:
        return what, "{asked_low_m:.4g} to {asked_high_m:.4g} m"
    return what, "{asked_low_m:.4g} m"
