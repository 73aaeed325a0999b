"""An intent as short statements that a person can hold against the sentence, one by one.

What is open makes no statement.
"""

from __future__ import annotations

from collections.abc import Iterator

from augment.scene.entities import TurnType
from augment.scene.intent import (
    Bearing,
    Body,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    MapPlace,
    Move,
    Nearness,
    Pick,
    Post,
    Relation,
    Request,
    Setting,
    Shape,
    Side,
    Sight,
    Spot,
    VehicleRequest,
    WalkRequest,
)

MARKS = {
    MapPlace.JUNCTION_START: "the start of the junction",
    MapPlace.JUNCTION_END: "the end of the junction",
    MapPlace.CROSSWALK: "the crosswalk",
}


def state_pick(pick: Pick) -> str:
    """Who is meant: "parked vehicle 2 ahead of the ego, on its left"."""
    kind, where = _KINDS[pick.kind], _RELATIONS[pick.relation]
    if pick.every:
        words = f"every {kind} {where} the ego"
    else:
        words = f"{kind} {pick.ordinal} {where} the ego"  # fmt: skip
    if pick.side is not None:
        words = f"{words}, {_SIDES[pick.side]}"
    if pick.lane is not None:
        words = f"{words}, {LANES[pick.lane]}"
    return words


LANES = {
    LaneChoice.OWN: "in the ego's lane",
    LaneChoice.LEFT: "in the lane on the left",
    LaneChoice.RIGHT: "in the lane on the right",
    LaneChoice.ONCOMING: "in the oncoming lane",
}
_KINDS = {
    Sight.VEHICLE: "vehicle",
    Sight.PARKED: "parked vehicle",
    Sight.MOVING: "moving vehicle",
    Sight.BUS: "bus",
    Sight.BICYCLE: "bicycle",
    Sight.PEDESTRIAN: "pedestrian",
}
_RELATIONS = {Relation.AHEAD: "ahead of", Relation.BEHIND: "behind"}
_SIDES = {Side.LEFT: "on its left", Side.RIGHT: "on its right"}


def list_statements(intent: Intent) -> tuple[str, ...]:
    """All that the intent says, in the order of its requests."""
    made = [
        f"{_thing(request)}: {fact}" for request in intent.requests for fact in _facts(request)
    ]
    for move in intent.moves:
        who = state_pick(move.who)
        made += [f"{who}: {one}" for one in _move_facts(move)]
    made += [f"{state_pick(removal)}: goes" for removal in intent.removals]
    if intent.route in _ROUTES:
        made.append(_ROUTES[intent.route])
    if intent.unmet:
        made.append(f"can't be met: {intent.unmet}")
    made += [f"not in any field: “{words}”" for words in intent.beyond]
    return tuple(made)


# Private


def _thing(request: Request) -> str:
    match request:
        case VehicleRequest():
            thing = _BODIES[request.body]
        case WalkRequest():
            thing = "pedestrian"
        case ConesRequest():
            thing = "cones"
        case CrashRequest():
            thing = f"crashed {_BODIES[request.body]}"
    if not request.name:
        return thing
    return f"{thing} “{request.name}”"


def _facts(request: Request) -> Iterator[str]:
    if request.count is not None:
        yield f"number {request.count}"
    yield from _place_facts(request.spot)
    match request:
        case VehicleRequest():
            yield from _vehicle_facts(request)
        case WalkRequest():
            yield from _walk_facts(request)
        case ConesRequest():
            yield from _cone_facts(request)
        case CrashRequest():
            yield from _facing_facts(request.facing, 0.0)
            for number, other in enumerate(request.others, start=2):
                yield from _crashed_facts(number, other)


def _place_facts(spot: Spot) -> Iterator[str]:
    anchor = _counted_from(spot)
    if spot.relation is not None:
        end = {Relation.AHEAD: "ahead of", Relation.BEHIND: "behind"}
        where = end[spot.relation]
        if spot.distance is None:
            yield f"{where} {anchor}"
        else:
            yield f"{_length(spot.distance)} {where} {anchor}"  # fmt: skip
    if spot.lane is not None:
        yield LANES[spot.lane]
    if spot.lateral is not None:
        yield from _lateral_facts(spot.lateral)
    for setting in spot.settings:
        yield _SETTINGS[setting]


def _counted_from(spot: Spot) -> str:
    if spot.landmark is not None:
        return state_pick(spot.landmark)
    if spot.mark is not None:
        return MARKS[spot.mark]
    return "the ego" if spot.anchor is None else f"“{spot.anchor}”"


def _move_facts(move: Move) -> Iterator[str]:
    yield "goes elsewhere"
    yield from _place_facts(move.spot)
    yield from _facing_facts(move.facing, move.turn_deg)
    if move.speed_mps is not None:
        yield _motion(move.speed_mps)


def _lateral_facts(lateral: Lateral) -> Iterator[str]:
    target = _TARGETS[lateral.target]
    if lateral.offset is not None:
        yield f"{_length(lateral.offset)} from the lane centre towards the {target}"  # fmt: skip
    elif lateral.nearness is not None:
        how = _NEARNESSES[lateral.nearness]
        yield f"{how}, towards the {target}"
    else:
        yield f"at the {target}"
    if lateral.on_shoulder:
        yield "partly on the shoulder"


def _vehicle_facts(request: VehicleRequest) -> Iterator[str]:
    yield from _facing_facts(request.facing, request.turn_deg)
    if request.speed_mps is not None:
        yield _motion(request.speed_mps)
    if request.spacing is not None:
        yield f"{_length(request.spacing)} from one to the next"


def _walk_facts(request: WalkRequest) -> Iterator[str]:
    if request.start is Side.LEFT:
        yield "crosses from the left to the right"
    elif request.start is Side.RIGHT:
        yield "crosses from the right to the left"
    if request.speed_mps is not None:
        yield _motion(request.speed_mps)
    if request.drift_m is not None:
        drift = f"{abs(request.drift_m):g}"
        if request.drift_m >= 0.0:
            yield f"ends {drift} m further along the lane"
        else:
            yield f"ends {drift} m back along the lane"
    if request.is_file:
        yield "one behind the other"
    for number, gap in enumerate(request.behind, start=2):
        yield f"number {number} is {_length(gap)} behind the first"
    if request.on_road:
        yield "the first is on the road already"


def _cone_facts(request: ConesRequest) -> Iterator[str]:
    if request.shape is not None:
        yield _SHAPES[request.shape]
    if request.spacing is not None:
        yield f"{_length(request.spacing)} from one to the next"
    if request.reach_m is not None:
        yield f"over {request.reach_m:g} m along the lane"
    if request.start is not None:
        yield f"begins at the {_SIDES_intent_statements[request.start]} lane boundary"
    if request.ends_in_middle:
        yield "ends in the middle of the lane"
    if request.both_sides:
        yield "as many along each boundary of the lane"
    if request.has_worker:
        yield "with a worker"
    if request.post is not None:
        yield f"the worker stands {_POSTS[request.post]}"
    if request.post_side is not None:
        yield f"the worker is on the {_SIDES_intent_statements[request.post_side]} of them"


def _crashed_facts(number: int, car: CrashedCar) -> Iterator[str]:
    if car.bearing is not None:
        yield f"number {number} is {_BEARINGS[car.bearing]} the one before"  # fmt: skip
    if car.gap is not None:
        yield f"number {number} is {_length(car.gap)} from the one before"
    if car.turn_deg is not None:
        turn = _turn(car.turn_deg) if car.is_signed else _angle(car.turn_deg)
        yield f"number {number} is {turn}"


def _facing_facts(facing: Facing | None, turn_deg: float) -> Iterator[str]:
    if facing is not None:
        yield _FACINGS[facing]
    if turn_deg:
        yield _turn(turn_deg)


def _turn(turn_deg: float) -> str:
    side = _SIDES_intent_statements[Side.LEFT if turn_deg > 0.0 else Side.RIGHT]
    return f"turned {_number(turn_deg)} degrees to the {side}"


def _angle(turn_deg: float) -> str:
    return f"turned {_number(turn_deg)} degrees, to either side"


def _motion(speed_mps: float) -> str:
    if speed_mps == 0.0:
        return "stands"
    return f"moves at {speed_mps:g} m/s"


def _number(value: float) -> str:
    return f"{abs(value):g}"


def _length(length: Length) -> str:
    low, high = f"{length.low_m:g}", f"{length.high_m:g}"
    if length.is_range:
        return f"{low} to {high} m"
    if length.is_approximate:
        return f"about {low} m"
    return f"{low} m"


_BODIES = {
    Body.VEHICLE: "vehicle",
    Body.CAR: "car",
    Body.VAN: "van",
    Body.TRUCK: "truck",
    Body.BUS: "bus",
    Body.BICYCLE: "bicycle",
    Body.BARRIER: "barrier",
    Body.CONSTRUCTION_SIGN: "construction sign",
}
_ROUTES = {
    TurnType.LEFT: "distances run along the way that turns left",
    TurnType.RIGHT: "distances run along the way that turns right",
    TurnType.U_TURN: "distances run along the way that turns back",
}
_SIDES_intent_statements = {Side.LEFT: "left", Side.RIGHT: "right"}
_TARGETS = {
    LateralTarget.LANE_CENTRE: "lane centre",
    LateralTarget.LEFT_BOUNDARY: "left lane boundary",
    LateralTarget.RIGHT_BOUNDARY: "right lane boundary",
    LateralTarget.KERB: "kerb",
    LateralTarget.CENTRE_LINE: "centre line of the road",
}
_NEARNESSES = {
    Nearness.SLIGHTLY: "slightly",
    Nearness.AT_EDGE: "at the edge of the lane",
    Nearness.HALF_OUT: "half outside the lane",
    Nearness.OUTSIDE: "outside the lane",
}
_SETTINGS = {
    Setting.BEFORE_INTERSECTION: "before the intersection",
    Setting.IN_INTERSECTION: "in the intersection",
    Setting.AT_INTERSECTION: "at the intersection",
    Setting.AFTER_INTERSECTION: "past the intersection",
    Setting.IN_BEND: "in the bend",
    Setting.ON_CROSSWALK: "on the crosswalk",
    Setting.OFF_CROSSWALK: "away from the crosswalk",
    Setting.BY_PARKED: "beside parked vehicles",
    Setting.BY_PARKED_LEFT: "between parked vehicles on the left",
    Setting.BY_PARKED_RIGHT: "between parked vehicles on the right",
}
_FACINGS = {
    Facing.WITH_LANE: "faces with the lane",
    Facing.AGAINST_LANE: "faces against the lane",
    Facing.ACROSS: "stands across the lane",
}
_SHAPES = {
    Shape.TAPER: "in a taper",
    Shape.LINE: "in a line",
    Shape.RING: "in a ring",
    Shape.ROW: "in a row across the lane",
}
_POSTS = {
    Post.BEHIND: "behind the cones",
    Post.BESIDE: "beside the cones",
    Post.AT_LAST: "beside the last cones",
}
_BEARINGS = {
    Bearing.AHEAD: "in front of",
    Bearing.BEHIND: "behind",
    Bearing.LEFT: "left of",
    Bearing.RIGHT: "right of",
}
