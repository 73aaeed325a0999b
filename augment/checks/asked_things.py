"""Counts, types, motion, headings and walks against those that were asked for."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations

from augment.checks.bodies import end_of_walk, name_type
from augment.checks.finding import Finding, FindingKind, find, side_of
from augment.checks.parties import SPEED_MPS, SPEED_SHARE, Asked, apart_m, middle_of
from augment.checks.situation import STOPPED_BELOW_MPS
from augment.geometry.frames import difference
from augment.scene.entities import TrafficAgent
from augment.scene.intent import Body, CrashRequest, Facing, Side, VehicleRequest, WalkRequest

_ON_ROAD_M = 1.0
"""Who begins so near the middle of the ego's lane comes from no side of it."""
_ALONG_SHARE = 0.2
"""Who looks less than this across the road (some 12 degrees) looks along it."""
_NO_FRONT = frozenset({Body.BARRIER, Body.CONSTRUCTION_SIGN})
_FACING_DEG = {Facing.WITH_LANE: 0.0, Facing.AGAINST_LANE: 180.0, Facing.ACROSS: 90.0}


def asked_count(asked: Asked) -> Iterator[Finding]:
    """What is missing, and what nobody asked for."""
    for party in asked.parties:
        here = party.everyone
        for role, number in party.missing:
            counted = f"{role} is" if number == 1 else f"{role.plural} are"
            yield find(
                FindingKind.ASKED_COUNT,
                False,
                here,
                f"{{missing:.0f}} {counted} asked for and not there.",
                belongs_m=None if here else middle_of(party.request.spot, asked.lanes),
                missing=float(number),
            )
    for agent in asked.surplus:
        words = f"{{agents[0]}}, {name_type(agent.type)}, is more than was asked for."
        yield find(FindingKind.ASKED_COUNT, False, [agent], words, surplus=1.0)


def asked_type(asked: Asked) -> Iterator[Finding]:
    """What stands in for something of another type."""
    for party in asked.parties:
        for agent, role in party.mistyped:
            words = f"{{agents[0]}} is {name_type(agent.type)}; a {role} is asked for."
            yield find(FindingKind.ASKED_TYPE, False, [agent], words)


def asked_motion(asked: Asked) -> Iterator[Finding]:
    """The speed of vehicles: those that are to stand do, the others drive as fast as said."""
    for party in asked.parties:
        wanted_mps = 0.0 if isinstance(party.request, CrashRequest) else None
        if isinstance(party.request, VehicleRequest):
            wanted_mps = party.request.speed_mps
        if wanted_mps is None:
            continue
        allowed_mps = max(SPEED_MPS, SPEED_SHARE * wanted_mps) if wanted_mps else STOPPED_BELOW_MPS
        words = "{asked_mps:.1f} m/s is asked for" if wanted_mps else "it is to stand"
        for agent in party.agents:
            yield find(
                FindingKind.ASKED_MOTION,
                abs(agent.speed_mps - wanted_mps) <= allowed_mps,
                [agent],
                f"{{agents[0]}} moves at {{speed_mps:.1f}} m/s; {words}.",
                speed_mps=agent.speed_mps,
                asked_mps=wanted_mps,
            )


def find_unasked(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that were moved or removed, and nobody asked for that."""
    moved = [agent.id for agent in asked.modification.moved if agent.id not in asked.to_move]
    removed = [name for name in asked.modification.removed if name not in asked.to_remove]
    for names, done in ((moved, "moved"), (removed, "removed")):
        words = f"{{agents[0]}} was in the scene and is {done}; nobody asked for that."
        yield from (find(FindingKind.UNASKED, False, [name], words) for name in names)


def asked_changes(asked: Asked) -> Iterator[Finding]:
    """Agents of the scene that are to be moved or removed, and were not."""
    moved = {agent.id for agent in asked.modification.moved}
    not_moved = sorted(asked.to_move - moved)
    not_removed = sorted(asked.to_remove.difference(asked.modification.removed))
    for names, wanted in ((not_moved, "moved"), (not_removed, "removed")):
        words = f"{{agents[0]}} is to be {wanted} and is not."
        yield from (find(FindingKind.ASKED_COUNT, False, [name], words) for name in names)


def find_attempted(asked: Asked) -> Iterator[Finding]:
    """Whatever is done about a wish that can't be met."""
    touched = [agent.id for agent in asked.modification.changed] + [*asked.modification.removed]
    if asked.unmet and touched:
        why = asked.unmet.replace("{", "{{").replace("}", "}}")
        words = f"The wish can't be met, and {{agents[0]}} is changed: {why}"
        yield find(FindingKind.UNASKED, False, touched, words)


def asked_heading(asked: Asked) -> Iterator[Finding]:
    """Vehicles against their lane; those that have crashed are told by `asked_crash`.

    As its lane leads where nothing is said: what else would say so stands in the sentence.
    """
    for party in asked.parties:
        request = party.request
        if not isinstance(request, VehicleRequest) or request.spot.lane is None:
            continue
        if request.body in _NO_FRONT and request.facing is None:
            continue
        facing = request.facing or Facing.WITH_LANE
        wanted_deg = _FACING_DEG[facing] + request.turn_deg
        words = f"facing {facing}{'' if request.facing else ', as nothing else is said,'}"
        if request.turn_deg:
            side = side_of(request.turn_deg)
            words += f", turned {abs(request.turn_deg):g} degrees to the {side}"
        for agent in party.agents:
            band = asked.lanes.band(request.spot.lane, asked.ahead_m(agent))
            if band is None:
                continue
            turn_deg = math.degrees(difference(agent.heading_rad, band.tangent_rad))
            turns = (turn_deg, turn_deg + 180.0) if facing is Facing.ACROSS else (turn_deg,)
            off_deg = min(abs(_difference_deg(turn, wanted_deg)) for turn in turns)
            yield find(
                FindingKind.ASKED_HEADING,
                off_deg <= asked.tolerances.heading_deg,
                [agent],
                f"{{agents[0]}} is turned {{turn_deg:.0f}} degrees to the {side_of(turn_deg)} of "
                f"its lane; {words} is asked for.",
                turn_deg=turn_deg,
                asked_deg=_difference_deg(wanted_deg, 0.0),
                off_deg=off_deg,
            )


def _difference_deg(one: float, other: float) -> float:
    return math.degrees(difference(math.radians(one), math.radians(other)))


def asked_walk(asked: Asked) -> Iterator[Finding]:
    """Side (a fault of logic), direction (of heading), crossing (of logic): the first one wrong.

    Of walks that cross as asked also where they end along the lane, and the gaps of a file.

    Looking or walking away from the road is a fault of the heading, as in the paper; that such a
    walk crosses nothing follows from it.
    """
    for party in asked.parties:
        request = party.request
        if not isinstance(request, WalkRequest):
            continue
        found = [_crossing(asked, agent, request.start) for agent in party.agents]
        yield from found
        for agent, finding in zip(party.agents, found, strict=True):
            if not finding.is_fault:
                yield from _drift(asked, agent, request.drift_m)
        if party.is_exact and not any(finding.is_fault for finding in found):
            yield from _in_file(asked, party.agents, request)


def _crossing(asked: Asked, agent: TrafficAgent, side: Side | None) -> Finding:
    """The first thing that is wrong about a walk; 1 is from the left, -1 from the right."""
    place, end = asked.route.locate_agent(agent), end_of_walk(agent)
    # Where the side is open it is that where the walk begins.
    start = math.copysign(1.0, place.left_m)
    if side is not None:
        start = 1.0 if side is Side.LEFT else -1.0
    across = math.sin(agent.heading_rad - place.tangent_rad)
    end_left_m = None if end is None else asked.route.locate(*end).left_m
    to_left_m = 0.0 if end_left_m is None else end_left_m - place.left_m
    goes = math.copysign(1.0, to_left_m) if abs(to_left_m) > _ON_ROAD_M else 0.0
    begins, ends = side_of(start), side_of(-start)
    measured = {"start_left_m": place.left_m, "end_left_m": end_left_m}
    looks_away = across * start > -_ALONG_SHARE
    crosses = end_left_m is not None and end_left_m * start < 0.0
    kind, fits = FindingKind.ASKED_CROSSING, False
    if place.left_m * start < -_ON_ROAD_M and goes == start:
        kind = FindingKind.ASKED_SIDE
        words = f"crosses from the {ends} to the {begins}; from the {begins} is asked for."
    elif looks_away or goes == start:
        kind = FindingKind.ASKED_HEADING
        verb = "looks" if looks_away else "walks"
        words = f"{verb} away from its way to the {ends} side of the road."
        measured["turn_deg"] = math.degrees(math.asin(across))
    elif crosses and place.left_m * start > -_ON_ROAD_M:
        fits, words = True, f"crosses the ego's way from the {begins}, as asked for."
    else:
        words = f"does not cross the ego's way from the {begins} to the {ends}."
    return find(kind, fits, [agent], f"{{agents[0]}} {words}", measured=measured)


def _drift(asked: Asked, agent: TrafficAgent, wanted_m: float | None) -> Iterator[Finding]:
    """How much further along the lane the walk ends than it begins."""
    end = end_of_walk(agent)
    if wanted_m is None or end is None:
        return
    drift_m = asked.route.locate(*end).ahead_m - asked.ahead_m(agent)
    is_, wanted = ("further" if m >= 0.0 else "back" for m in (drift_m, wanted_m))
    yield find(
        FindingKind.ASKED_DISTANCE,
        abs(drift_m - wanted_m) <= asked.tolerances.drift_m,
        [agent],
        f"The walk of {{agents[0]}} ends {{drift_m:.1f}} m {is_} along the lane; "
        f"{{asked_m:.1f}} m {wanted} is asked for.",
        drift_m=drift_m,
        asked_m=wanted_m,
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
        yield find(
            FindingKind.ASKED_SPACING,
            asked.fits_gap(gap_m, wanted),
            [other, first],
            "{agents[0]} is {gap_m:.1f} m from {agents[1]}; {asked_m:.1f} m is asked for.",
            gap_m=gap_m,
            asked_m=wanted.middle_m,
        )
