"""Counts, types and motion against those that were asked for."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from augment.checks.asked_places import apart_m, fits_gap
from augment.checks.bodies import end_of_walk, name_type
from augment.checks.finding import Finding, FindingKind, Severity
from augment.checks.parties import (
    SPEED_MPS,
    SPEED_SHARE,
    Asked,
    Role,
    facing_words,
    middle_of,
    severity_of,
    side_of,
)
from augment.checks.situation import STOPPED_BELOW_MPS
from augment.geometry.frames import difference
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Body, CrashRequest, Facing, Side, VehicleRequest, WalkRequest


def asked_count(asked: Asked) -> Iterator[Finding]:
    """What is missing, and what nobody asked for."""
    for party in asked.parties:
        here = tuple(one.id for one in party.everyone)
        for role, number in party.missing:
            yield Finding(
                kind=FindingKind.ASKED_COUNT,
                severity=Severity.WRONG,
                agents=here,
                belongs_m=None if here else middle_of(party.request.spot, asked.lanes),
                measured={"missing": float(number)},
                template=(
                    f"{{missing:.0f}} {_COUNTED[role][number != 1]} asked for and not there."
                ),
            )
    for agent in asked.matching.surplus:
        yield Finding(
            kind=FindingKind.ASKED_COUNT,
            severity=Severity.WRONG,
            agents=(agent.id,),
            measured={"surplus": 1.0},
            template=f"{{agents[0]}}, {name_type(agent.type)}, is more than was asked for.",
        )


def asked_type(asked: Asked) -> Iterator[Finding]:
    """What stands in for something of another type."""
    for party in asked.parties:
        for agent, role in party.mistyped:
            yield Finding(
                kind=FindingKind.ASKED_TYPE,
                severity=Severity.WRONG,
                agents=(agent.id,),
                template=f"{{agents[0]}} is {name_type(agent.type)}; {_A[role]} is asked for.",
            )


def asked_motion(asked: Asked) -> Iterator[Finding]:
    """The speed of vehicles: those that are to stand do, the others drive as fast as said."""
    for party in asked.parties:
        request = party.request
        if not isinstance(request, (VehicleRequest, CrashRequest)):
            continue
        wanted_mps = request.speed_mps if isinstance(request, VehicleRequest) else 0.0
        if wanted_mps is None:
            continue
        allowed_mps = max(SPEED_MPS, SPEED_SHARE * wanted_mps) if wanted_mps else STOPPED_BELOW_MPS
        words = _DRIVES if wanted_mps else _STANDS
        for agent in party.agents:
            off_mps = abs(agent.speed_mps - wanted_mps)
            yield Finding(
                kind=FindingKind.ASKED_MOTION,
                severity=severity_of(fits=off_mps <= allowed_mps),
                agents=(agent.id,),
                measured={"speed_mps": agent.speed_mps, "asked_mps": wanted_mps},
                template=f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s; {words}.",
            )


def find_unasked(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that were moved or removed, and nobody asked for that."""
    moved = [(agent.id, _MOVED, asked.to_move) for agent in asked.modification.moved]
    removed = [(name, _REMOVED, asked.to_remove) for name in asked.modification.removed]
    for name, done, wanted in (*moved, *removed):
        if name in wanted:
            continue
        yield Finding(
            kind=FindingKind.UNASKED,
            severity=Severity.WRONG,
            agents=(name,),
            template=f"{{agents[0]}} was in the scene and is {done}; nobody asked for that.",
        )


def asked_changes(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that are to be moved or removed, and were not."""
    moved = frozenset(agent.id for agent in asked.modification.moved)
    removed = frozenset(asked.modification.removed)
    left_alone = [(name, _MOVED) for name in sorted(asked.to_move - moved)]
    left_alone += [(name, _REMOVED) for name in sorted(asked.to_remove - removed)]
    for name, wanted in left_alone:
        yield Finding(
            kind=FindingKind.ASKED_COUNT,
            severity=Severity.WRONG,
            agents=(name,),
            template=f"{{agents[0]}} is to be {wanted} and is not.",
        )


def find_attempted(asked: Asked) -> Iterator[Finding]:
    """Whatever is done about a wish that can't be met."""
    touched = [agent.id for agent in asked.modification.changed] + [*asked.modification.removed]
    if asked.unmet and touched:
        why = asked.unmet.replace("{", "{{").replace("}", "}}")
        yield Finding(
            kind=FindingKind.UNASKED,
            severity=Severity.WRONG,
            agents=tuple(touched),
            template=f"The wish can't be met, and {{agents[0]}} is changed: {why}",
        )


_MOVED, _REMOVED = "moved", "removed"
_DRIVES, _STANDS = "{asked_mps:.1f} m/s is asked for", "it is to stand"
_A = {
    Role.VEHICLE: "a vehicle",
    Role.CAR: "a car",
    Role.BUS: "a bus",
    Role.BICYCLE: "a bicycle",
    Role.WALKER: "a pedestrian",
    Role.CONE: "a cone",
    Role.WORKER: "a worker",
    Role.BARRIER: "a barrier",
    Role.SIGN: "a construction sign",
}
_COUNTED = {
    Role.VEHICLE: ("vehicle is", "vehicles are"),
    Role.CAR: ("car is", "cars are"),
    Role.BUS: ("bus is", "buses are"),
    Role.BICYCLE: ("bicycle is", "bicycles are"),
    Role.WALKER: ("pedestrian is", "pedestrians are"),
    Role.CONE: ("cone is", "cones are"),
    Role.WORKER: ("worker is", "workers are"),
    Role.BARRIER: ("barrier is", "barriers are"),
    Role.SIGN: ("construction sign is", "construction signs are"),
}
"""One, and several or none."""


def asked_heading(asked: Asked) -> Iterator[Finding]:
    """Vehicles against their lane; those that have crashed are told by `asked_crash`."""
    for party in asked.parties:
        request = party.request
        if isinstance(request, VehicleRequest):
            for agent in party.agents:
                yield from _vehicle(asked, request, agent)


def _vehicle(asked: Asked, request: VehicleRequest, agent: TrafficAgent) -> Iterator[Finding]:
    if request.spot.lane is None or (request.body in _NO_FRONT and request.facing is None):
        return
    place = asked.route.locate_agent(agent)
    band = asked.lanes.band(request.spot.lane, place.ahead_m)
    if band is None:
        return
    turn_deg = math.degrees(difference(agent.heading_rad, band.tangent_rad))
    turns = (turn_deg, turn_deg + 180.0) if _facing(request) is Facing.ACROSS else (turn_deg,)
    wanted_deg = _FACING_DEG[_facing(request)] + request.turn_deg
    off_deg = min(abs(_difference_deg(turn, wanted_deg)) for turn in turns)
    usual = "" if request.facing else ", as nothing else is said,"
    yield Finding(
        kind=FindingKind.ASKED_HEADING,
        severity=severity_of(fits=off_deg <= asked.tolerances.heading_deg),
        agents=(agent.id,),
        measured={
            "turn_deg": turn_deg,
            "asked_deg": _difference_deg(wanted_deg, 0.0),
            "off_deg": off_deg,
        },
        template=(
            f"{{agents[0]}} is turned {{turn_deg:.0f}} degrees to the {side_of(turn_deg)} of its "
            f"lane; {facing_words(request.facing)}{usual}{_turn(request)} is asked for."
        ),
    )


def _turn(request: VehicleRequest) -> str:
    if not request.turn_deg:
        return ""
    return f", turned {abs(request.turn_deg):g} degrees to the {side_of(request.turn_deg)}"


def _facing(request: VehicleRequest) -> Facing:
    """As its lane leads where nothing is said: what else would say so stands in the sentence."""
    return request.facing or Facing.WITH_LANE


def _difference_deg(one: float, other: float) -> float:
    return math.degrees(difference(math.radians(one), math.radians(other)))


_NO_FRONT = frozenset({Body.BARRIER, Body.CONSTRUCTION_SIGN})
_FACING_DEG = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: 180.0, Facing.ACROSS: 90.0}


_ON_ROAD_M = 1.0
"""Who begins so near the middle of the ego's lane comes from no side of it."""
_ALONG_SHARE = 0.2
"""Who looks less than this across the road (some 12 degrees) looks along it."""


def asked_walk(asked: Asked) -> Iterator[Finding]:
    """Side (a fault of logic), direction (of heading), crossing (of logic): the first one wrong.

    Of walks that cross as asked also where they end along the lane, and the gaps of a file.

    Looking or walking away from the road is a fault of the heading, as in the paper; that such a
    walk crosses nothing follows from it.
    """
    for party in asked.parties:
        if isinstance(party.request, WalkRequest):
            found = [
                (agent, _finding(asked, agent, _start_side(asked, agent, party.request.start)))
                for agent in party.agents
            ]
            yield from (finding for _, finding in found)
            for agent, finding in found:
                if not finding.is_fault:
                    yield from _drift(asked, agent, party.request.drift_m)
            if party.is_exact and not any(finding.is_fault for _, finding in found):
                yield from _in_file(asked, party.agents, party.request)


def _start_side(asked: Asked, agent: TrafficAgent, side: Side | None) -> float:
    """1 from the left, -1 from the right; where that is open, from where it begins."""
    if side is None:
        return math.copysign(1.0, asked.left_m(agent))
    return 1.0 if side is Side.LEFT else -1.0


def _drift(asked: Asked, agent: TrafficAgent, wanted_m: float | None) -> Iterator[Finding]:
    """How much further along the lane the walk ends than it begins."""
    end = end_of_walk(agent)
    if wanted_m is None or end is None:
        return
    drift_m = asked.route.locate(*end).ahead_m - asked.ahead_m(agent)
    yield Finding(
        kind=FindingKind.ASKED_DISTANCE,
        severity=severity_of(fits=abs(drift_m - wanted_m) <= asked.tolerances.drift_m),
        agents=(agent.id,),
        measured={"drift_m": drift_m, "asked_m": wanted_m},
        template=(
            f"The walk of {{agents[0]}} ends {{drift_m:.1f}} m {_along(drift_m)} along the lane; "
            f"{{asked_m:.1f}} m {_along(wanted_m)} is asked for."
        ),
    )


def _in_file(
    asked: Asked, walkers: Sequence[TrafficAgent], request: WalkRequest
) -> Iterator[Finding]:
    """How far behind the first one, who is furthest across, each of the others walks."""
    if not request.behind or request.start is None:
        return
    sign = 1.0 if request.start is Side.LEFT else -1.0
    first, *others = sorted(walkers, key=lambda one: sign * asked.left_m(one))
    if any(apart_m(*pair) < first.length_m for pair in combinations(walkers, 2)):
        return  # who stands in another is a fault of its own
    for other, wanted in zip(others, request.behind, strict=False):
        gap_m = apart_m(first, other)
        yield Finding(
            kind=FindingKind.ASKED_SPACING,
            severity=severity_of(fits=fits_gap(asked, gap_m, wanted)),
            agents=(other.id, first.id),
            measured={"gap_m": gap_m, "asked_m": wanted.middle_m},
            template=_BEHIND,
        )


def _along(drift_m: float) -> str:
    return "further" if drift_m >= 0.0 else "back"


def _finding(asked: Asked, agent: TrafficAgent, start: float) -> Finding:
    place = asked.route.locate_agent(agent)
    across = math.sin(agent.heading_rad - place.tangent_rad)
    end = end_of_walk(agent)
    end_left_m = None if end is None else asked.route.locate(*end).left_m
    to_left_m = 0.0 if end_left_m is None else end_left_m - place.left_m
    goes = math.copysign(1.0, to_left_m) if abs(to_left_m) > _ON_ROAD_M else 0.0
    is_other_side = place.left_m * start < -_ON_ROAD_M and goes == start
    measured = {"start_left_m": place.left_m, "end_left_m": end_left_m}
    begins, ends = side_of(start), side_of(-start)
    if is_other_side:
        return _fault(
            FindingKind.ASKED_SIDE, agent, measured,
            f"{{agents[0]}} crosses from the {ends} to the {begins}; from the {begins} is asked "
            "for.",
        )  # fmt: skip
    looks_away = across * start > -_ALONG_SHARE
    if looks_away or goes == start:
        measured |= {"turn_deg": math.degrees(math.asin(across))}
        return _fault(
            FindingKind.ASKED_HEADING, agent, measured,
            _away(ends, looks=looks_away),
        )  # fmt: skip
    crosses = end_left_m is not None and place.left_m * start > -_ON_ROAD_M
    if crosses and end_left_m is not None and end_left_m * start < 0.0:
        return Finding(
            kind=FindingKind.ASKED_CROSSING,
            severity=severity_of(fits=True),
            agents=(agent.id,),
            measured=measured,
            template=f"{{agents[0]}} crosses the ego's way from the {begins}, as asked for.",
        )
    return _fault(
        FindingKind.ASKED_CROSSING, agent, measured,
        f"{{agents[0]}} does not cross the ego's way from the {begins} to the {ends}.",
    )  # fmt: skip


def _away(side: str, *, looks: bool) -> str:
    if looks:
        return f"{{agents[0]}} looks away from its way to the {side} side of the road."
    return f"{{agents[0]}} walks away from its way to the {side} side of the road."


def _fault(
    kind: FindingKind, agent: TrafficAgent, measured: dict[str, float | None], words: str
) -> Finding:
    return Finding(
        kind=kind,
        severity=severity_of(fits=False),
        agents=(agent.id,),
        measured=measured,
        template=words,
    )


_BEHIND = "{agents[0]} is {gap_m:.1f} m from {agents[1]}; {asked_m:.1f} m is asked for."
