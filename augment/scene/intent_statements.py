"""An intent as short statements that a person can hold against the sentence, one by one.

What is open makes no statement.
"""

from collections.abc import Iterable, Iterator

from augment.scene.entities import TurnType
from augment.scene.intent import (
    ConesRequest,
    CrashRequest,
    Facing,
    Intent,
    LaneChoice,
    Lateral,
    Length,
    Nearness,
    Pick,
    Relation,
    Request,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)

_ROUTES = {TurnType.LEFT: "left", TurnType.RIGHT: "right", TurnType.U_TURN: "back"}
_RELATIONS = {Relation.AHEAD: "ahead of", Relation.BEHIND: "behind"}
_LANES = {
    LaneChoice.OWN: "in the ego's lane",
    LaneChoice.LEFT: "in the lane on the left",
    LaneChoice.RIGHT: "in the lane on the right",
    LaneChoice.ONCOMING: "in the oncoming lane",
}
_NEARNESSES = {
    Nearness.SLIGHTLY: "slightly",
    Nearness.AT_EDGE: "at the edge of the lane",
    Nearness.HALF_OUT: "half outside the lane",
    Nearness.OUTSIDE: "outside the lane",
}

Rules = Iterable[tuple[object, str]]
"""Statements, each with what must hold for it."""


def list_statements(intent: Intent) -> tuple[str, ...]:
    """Return all that the intent says, in the order of its requests."""
    made = [
        f"{_thing(request)}: {fact}" for request in intent.requests for fact in _facts(request)
    ]
    for move in intent.moves:
        facts = ["goes elsewhere", *_place_facts(move.spot)]
        facts += _facing_facts(move.facing, move.turn_deg)
        facts += _motion(move.speed_mps)
        made += [f"{_picked(move.who)}: {fact}" for fact in facts]
    made += [f"{_picked(removal)}: goes" for removal in intent.removals]
    if intent.route in _ROUTES:
        made.append(f"distances run along the way that turns {_ROUTES[intent.route]}")
    if intent.unmet:
        made.append(f"can't be met: {intent.unmet}")
    made += [f"not in any field: “{words}”" for words in intent.beyond]
    return tuple(made)


# Private


def _holding(rules: Rules) -> list[str]:
    return [words for holds, words in rules if holds]


def _picked(pick: Pick) -> str:
    """Who is meant: "parked vehicle 2 ahead of the ego, on its left"."""
    kind = f"every {pick.kind}" if pick.every else f"{pick.kind} {pick.ordinal}"
    words = [f"{kind} {_RELATIONS[pick.relation]} the ego"]
    words += [f"on its {pick.side}"] if pick.side else []
    words += [_LANES[pick.lane]] if pick.lane else []
    return ", ".join(words)


def _thing(request: Request) -> str:
    match request:
        case VehicleRequest():
            thing = str(request.body)
        case WalkRequest():
            thing = "pedestrian"
        case ConesRequest():
            thing = "cones"
        case CrashRequest():
            thing = f"crashed {request.body}"
    return f"{thing} “{request.name}”" if request.name else thing


def _facts(request: Request) -> Iterator[str]:
    if request.count is not None:
        yield f"number {request.count}"
    yield from _place_facts(request.spot)
    match request:
        case VehicleRequest():
            yield from _facing_facts(request.facing, request.turn_deg)
            yield from _motion(request.speed_mps)
            if request.spacing is not None:
                yield f"{_length(request.spacing)} from one to the next"
        case WalkRequest():
            yield from _walk_facts(request)
        case ConesRequest():
            yield from _holding(_cone_rules(request))
        case CrashRequest():
            yield from _facing_facts(request.facing, 0.0)
            yield from _crash_facts(request)


def _place_facts(spot: Spot) -> Iterator[str]:
    anchor = "the ego" if spot.anchor is None else f"“{spot.anchor}”"
    if spot.landmark is not None:
        anchor = _picked(spot.landmark)
    elif spot.mark is not None:
        anchor = f"the {spot.mark}"
    if spot.relation is not None:
        length = "" if spot.distance is None else f"{_length(spot.distance)} "
        yield f"{length}{_RELATIONS[spot.relation]} {anchor}"
    if spot.lane is not None:
        yield _LANES[spot.lane]
    if spot.lateral is not None:
        yield _lateral(spot.lateral)
        if spot.lateral.on_shoulder:
            yield "partly on the shoulder"
    yield from (str(setting) for setting in spot.settings)


def _lateral(lateral: Lateral) -> str:
    if lateral.offset is not None:
        return f"{_length(lateral.offset)} from the lane centre towards the {lateral.target}"
    if lateral.nearness is not None:
        return f"{_NEARNESSES[lateral.nearness]}, towards the {lateral.target}"
    return f"at the {lateral.target}"


def _walk_facts(request: WalkRequest) -> Iterator[str]:
    if request.start is not None:
        yield f"crosses from the {request.start} to the {request.start.other}"
    yield from _motion(request.speed_mps)
    if request.drift_m is not None:
        where = "further" if request.drift_m >= 0.0 else "back"
        yield f"ends {abs(request.drift_m):g} m {where} along the lane"
    if request.is_file:
        yield "one behind the other"
    for number, gap in enumerate(request.behind, start=2):
        yield f"number {number} is {_length(gap)} behind the first"
    if request.on_road:
        yield "the first is on the road already"


def _cone_rules(request: ConesRequest) -> Rules:
    yield request.shape, f"in a {request.shape}"
    if request.spacing is not None:
        yield True, f"{_length(request.spacing)} from one to the next"
    if request.reach_m is not None:
        yield True, f"over {request.reach_m:g} m along the lane"
    yield request.start, f"begins at the {request.start} lane boundary"
    yield request.ends_in_middle, "ends in the middle of the lane"
    yield request.both_sides, "as many along each boundary of the lane"
    yield request.has_worker, "with a worker"
    yield request.post, f"the worker stands {request.post}"
    yield request.post_side, f"the worker is on the {request.post_side} of them"


def _crash_facts(request: CrashRequest) -> Iterator[str]:
    for number, car in enumerate(request.others, start=2):
        if car.bearing is not None:
            yield f"number {number} is {car.bearing} the one before"
        if car.gap is not None:
            yield f"number {number} is {_length(car.gap)} from the one before"
        if car.turn_deg is not None:
            either = f"turned {abs(car.turn_deg):g} degrees, to either side"
            yield f"number {number} is {_turn(car.turn_deg) if car.is_signed else either}"


def _facing_facts(facing: Facing | None, turn_deg: float) -> list[str]:
    verb = "stands" if facing is Facing.ACROSS else "faces"
    return _holding([(facing, f"{verb} {facing}"), (turn_deg, _turn(turn_deg))])


def _turn(turn_deg: float) -> str:
    return f"turned {abs(turn_deg):g} degrees to the {Side.LEFT if turn_deg > 0.0 else Side.RIGHT}"


def _motion(speed_mps: float | None) -> list[str]:
    if speed_mps is None:
        return []
    return [f"moves at {speed_mps:g} m/s" if speed_mps else "stands"]


def _length(length: Length) -> str:
    """The length, "about" only where it is one."""
    return f"{length.low_m:g} to {length.high_m:g} m" if length.is_range else str(length)
