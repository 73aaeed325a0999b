"""The place across the road against the lane, the side and the offset that were asked for.

Right lane and distance, but left and right exchanged: that is no wrong place but a wrong side,
a fault of reasoning.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from augment.checks.asked.crash import in_order
from augment.checks.asked.parties import Party
from augment.checks.asked.question import Asked, distance_outside, severity_of, side_of
from augment.checks.finding import Finding, FindingKind
from augment.checks.lanes_across import Band
from augment.checks.tolerances import Tolerances
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, TrafficAgent
from augment.scene.intent import (
    ConesRequest,
    CrashRequest,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
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
