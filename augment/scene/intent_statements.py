"""An intent as short statements that a person can hold against the sentence, one by one.

What is open makes no statement.
"""

from __future__ import annotations

from collections.abc import Iterator

from augment.scene.entities import TurnType
from augment.scene.intent import (
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Intent,
    Lateral,
    Length,
    Move,
    Relation,
    Request,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from augment.scene.intent_words import (
    Bearing,
    Body,
    Facing,
    LateralTarget,
    Nearness,
    Post,
    Setting,
    Shape,
)
from augment.scene.landmark_statements import LANES, MARKS, state_pick
from augment.sentences import Sentence, sentence


def list_statements(intent: Intent) -> tuple[Sentence, ...]:
    """All that the intent says, in the order of its requests."""
    made = [
        sentence("%(what)s: %(fact)s", what=_thing(request), fact=fact)
        for request in intent.requests
        for fact in _facts(request)
    ]
    for move in intent.moves:
        who = state_pick(move.who)
        made += [sentence("%(what)s: %(fact)s", what=who, fact=one) for one in _move_facts(move)]
    made += [sentence("%(who)s: goes", who=state_pick(removal)) for removal in intent.removals]
    if intent.route in _ROUTES:
        made.append(_ROUTES[intent.route])
    if intent.unmet:
        made.append(sentence("can't be met: %(why)s", why=intent.unmet))
    made += [sentence("not in any field: “%(words)s”", words=words) for words in intent.beyond]
    return tuple(made)


# Private


def _thing(request: Request) -> Sentence:
    match request:
        case VehicleRequest():
            thing = _BODIES[request.body]
        case WalkRequest():
            thing = sentence("pedestrian")
        case ConesRequest():
            thing = sentence("cones")
        case CrashRequest():
            thing = sentence("crashed %(body)s", body=_BODIES[request.body])
    if not request.name:
        return thing
    return sentence("%(thing)s “%(name)s”", thing=thing, name=request.name)


def _facts(request: Request) -> Iterator[Sentence]:
    if request.count is not None:
        yield sentence("number %(count)s", count=request.count)
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


def _place_facts(spot: Spot) -> Iterator[Sentence]:
    anchor = _counted_from(spot)
    if spot.relation is not None:
        end = {Relation.AHEAD: sentence("ahead of"), Relation.BEHIND: sentence("behind")}
        where = end[spot.relation]
        if spot.distance is None:
            yield sentence("%(where)s %(anchor)s", where=where, anchor=anchor)
        else:
            yield sentence(
                "%(distance)s %(where)s %(anchor)s",
                distance=_length(spot.distance), where=where, anchor=anchor,
            )  # fmt: skip
    if spot.lane is not None:
        yield LANES[spot.lane]
    if spot.lateral is not None:
        yield from _lateral_facts(spot.lateral)
    for setting in spot.settings:
        yield _SETTINGS[setting]


def _counted_from(spot: Spot) -> Sentence:
    if spot.landmark is not None:
        return state_pick(spot.landmark)
    if spot.mark is not None:
        return MARKS[spot.mark]
    return sentence("the ego") if spot.anchor is None else sentence("“%(name)s”", name=spot.anchor)


def _move_facts(move: Move) -> Iterator[Sentence]:
    yield sentence("goes elsewhere")
    yield from _place_facts(move.spot)
    yield from _facing_facts(move.facing, move.turn_deg)
    if move.speed_mps is not None:
        yield _motion(move.speed_mps)


def _lateral_facts(lateral: Lateral) -> Iterator[Sentence]:
    target = _TARGETS[lateral.target]
    if lateral.offset is not None:
        yield sentence(
            "%(offset)s from the lane centre towards the %(target)s",
            offset=_length(lateral.offset), target=target,
        )  # fmt: skip
    elif lateral.nearness is not None:
        how = _NEARNESSES[lateral.nearness]
        yield sentence("%(how)s, towards the %(target)s", how=how, target=target)
    else:
        yield sentence("at the %(target)s", target=target)
    if lateral.on_shoulder:
        yield sentence("partly on the shoulder")


def _vehicle_facts(request: VehicleRequest) -> Iterator[Sentence]:
    yield from _facing_facts(request.facing, request.turn_deg)
    if request.speed_mps is not None:
        yield _motion(request.speed_mps)
    if request.spacing is not None:
        yield sentence("%(gap)s from one to the next", gap=_length(request.spacing))


def _walk_facts(request: WalkRequest) -> Iterator[Sentence]:
    if request.start is Side.LEFT:
        yield sentence("crosses from the left to the right")
    elif request.start is Side.RIGHT:
        yield sentence("crosses from the right to the left")
    if request.speed_mps is not None:
        yield _motion(request.speed_mps)
    if request.drift_m is not None:
        drift = f"{abs(request.drift_m):g}"
        if request.drift_m >= 0.0:
            yield sentence("ends %(drift)s m further along the lane", drift=drift)
        else:
            yield sentence("ends %(drift)s m back along the lane", drift=drift)
    if request.is_file:
        yield sentence("one behind the other")
    for number, gap in enumerate(request.behind, start=2):
        yield sentence(
            "number %(number)s is %(gap)s behind the first", number=number, gap=_length(gap)
        )
    if request.on_road:
        yield sentence("the first is on the road already")


def _cone_facts(request: ConesRequest) -> Iterator[Sentence]:
    if request.shape is not None:
        yield _SHAPES[request.shape]
    if request.spacing is not None:
        yield sentence("%(gap)s from one to the next", gap=_length(request.spacing))
    if request.reach_m is not None:
        yield sentence("over %(reach)s m along the lane", reach=f"{request.reach_m:g}")
    if request.start is not None:
        yield sentence("begins at the %(side)s lane boundary", side=_SIDES[request.start])
    if request.ends_in_middle:
        yield sentence("ends in the middle of the lane")
    if request.both_sides:
        yield sentence("as many along each boundary of the lane")
    if request.has_worker:
        yield sentence("with a worker")
    if request.post is not None:
        yield sentence("the worker stands %(post)s", post=_POSTS[request.post])
    if request.post_side is not None:
        yield sentence("the worker is on the %(side)s of them", side=_SIDES[request.post_side])


def _crashed_facts(number: int, car: CrashedCar) -> Iterator[Sentence]:
    if car.bearing is not None:
        yield sentence(
            "number %(number)s is %(bearing)s the one before",
            number=number, bearing=_BEARINGS[car.bearing],
        )  # fmt: skip
    if car.gap is not None:
        yield sentence(
            "number %(number)s is %(gap)s from the one before", number=number, gap=_length(car.gap)
        )
    if car.turn_deg is not None:
        turn = _turn(car.turn_deg) if car.is_signed else _angle(car.turn_deg)
        yield sentence("number %(number)s is %(turn)s", number=number, turn=turn)


def _facing_facts(facing: Facing | None, turn_deg: float) -> Iterator[Sentence]:
    if facing is not None:
        yield _FACINGS[facing]
    if turn_deg:
        yield _turn(turn_deg)


def _turn(turn_deg: float) -> Sentence:
    side = _SIDES[Side.LEFT if turn_deg > 0.0 else Side.RIGHT]
    return sentence("turned %(angle)s degrees to the %(side)s", angle=_number(turn_deg), side=side)


def _angle(turn_deg: float) -> Sentence:
    return sentence("turned %(angle)s degrees, to either side", angle=_number(turn_deg))


def _motion(speed_mps: float) -> Sentence:
    if speed_mps == 0.0:
        return sentence("stands")
    return sentence("moves at %(speed)s m/s", speed=f"{speed_mps:g}")


def _number(value: float) -> str:
    return f"{abs(value):g}"


def _length(length: Length) -> Sentence:
    low, high = f"{length.low_m:g}", f"{length.high_m:g}"
    if length.is_range:
        return sentence("%(low)s to %(high)s m", low=low, high=high)
    if length.is_approximate:
        return sentence("about %(low)s m", low=low)
    return sentence("%(low)s m", low=low)


_BODIES = {
    Body.VEHICLE: sentence("vehicle"),
    Body.CAR: sentence("car"),
    Body.VAN: sentence("van"),
    Body.TRUCK: sentence("truck"),
    Body.BUS: sentence("bus"),
    Body.BICYCLE: sentence("bicycle"),
    Body.BARRIER: sentence("barrier"),
    Body.CONSTRUCTION_SIGN: sentence("construction sign"),
}
_ROUTES = {
    TurnType.LEFT: sentence("distances run along the way that turns left"),
    TurnType.RIGHT: sentence("distances run along the way that turns right"),
    TurnType.U_TURN: sentence("distances run along the way that turns back"),
}
_SIDES = {Side.LEFT: sentence("left"), Side.RIGHT: sentence("right")}
_TARGETS = {
    LateralTarget.LANE_CENTRE: sentence("lane centre"),
    LateralTarget.LEFT_BOUNDARY: sentence("left lane boundary"),
    LateralTarget.RIGHT_BOUNDARY: sentence("right lane boundary"),
    LateralTarget.KERB: sentence("kerb"),
    LateralTarget.CENTRE_LINE: sentence("centre line of the road"),
}
_NEARNESSES = {
    Nearness.SLIGHTLY: sentence("slightly"),
    Nearness.AT_EDGE: sentence("at the edge of the lane"),
    Nearness.HALF_OUT: sentence("half outside the lane"),
    Nearness.OUTSIDE: sentence("outside the lane"),
}
_SETTINGS = {
    Setting.BEFORE_INTERSECTION: sentence("before the intersection"),
    Setting.IN_INTERSECTION: sentence("in the intersection"),
    Setting.AT_INTERSECTION: sentence("at the intersection"),
    Setting.AFTER_INTERSECTION: sentence("past the intersection"),
    Setting.IN_BEND: sentence("in the bend"),
    Setting.ON_CROSSWALK: sentence("on the crosswalk"),
    Setting.OFF_CROSSWALK: sentence("away from the crosswalk"),
    Setting.BY_PARKED: sentence("beside parked vehicles"),
    Setting.BY_PARKED_LEFT: sentence("between parked vehicles on the left"),
    Setting.BY_PARKED_RIGHT: sentence("between parked vehicles on the right"),
}
_FACINGS = {
    Facing.WITH_LANE: sentence("faces with the lane"),
    Facing.AGAINST_LANE: sentence("faces against the lane"),
    Facing.ACROSS: sentence("stands across the lane"),
}
_SHAPES = {
    Shape.TAPER: sentence("in a taper"),
    Shape.LINE: sentence("in a line"),
    Shape.RING: sentence("in a ring"),
    Shape.ROW: sentence("in a row across the lane"),
}
_POSTS = {
    Post.BEHIND: sentence("behind the cones"),
    Post.BESIDE: sentence("beside the cones"),
    Post.AT_LAST: sentence("beside the last cones"),
}
_BEARINGS = {
    Bearing.AHEAD: sentence("in front of"),
    Bearing.BEHIND: sentence("behind"),
    Bearing.LEFT: sentence("left of"),
    Bearing.RIGHT: sentence("right of"),
}
