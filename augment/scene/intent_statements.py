"""An intent as short statements that a person can hold against the sentence, one by one.

What is open makes no statement.
"""

from collections.abc import Iterator

from augment.scene import intent as intents
from augment.scene.entities import TurnType

_ROUTES = {TurnType.LEFT: "left", TurnType.RIGHT: "right", TurnType.U_TURN: "back"}
_FACTS = {
    "shape": "in a {}",
    "spacing": "{} from one to the next",
    "reach_m": "over {:g} m along the lane",
    "drift_m": "ends {:g} m further along the lane",
    "is_file": "one behind the other",
    "on_road": "the first is on the road already",
    "ends_in_middle": "ends in the middle of the lane",
    "both_sides": "as many along each boundary of the lane",
    "has_worker": "with a worker",
    "post": "the worker stands {}",
    "post_side": "the worker is on the {} of them",
}
"""Fields that a request may have, and what a value of theirs says."""
_PURPOSES = {
    "sight": "the ego sees a pedestrian who crosses its way only from {} away",
    "passage": "the widest way past is {} wide",
    "braking_mps2": "the ego is forced to brake with {} m/s² and does not crash",
    "ttc_s": "the ego's least time to collision is {} s and it does not crash",
}
_MOTION_FACTS = {
    "speed_mps": "comes to {} m/s",
    "braking_mps2": "brakes with {} m/s²",
    "duration_s": "takes {} s",
}


def list_statements(intent: intents.Intent) -> tuple[str, ...]:
    """Return all that the intent says, in the order of its requests."""
    statements = [
        f"{_name_thing(request)}: {fact}"
        for request in intent.requests
        for fact in _list_facts(request)
    ]
    for move in intent.moves:
        where = [] if move.stays else ["goes elsewhere"]
        facts = [*where, *_list_place_facts(move.spot), *_list_pose_facts(move)]
        statements += [f"{move.who}: {fact}" for fact in facts]
    statements += [f"{removal}: goes" for removal in intent.removals]
    windows = {name: getattr(intent.purpose, name, None) for name in _PURPOSES}
    statements += [_PURPOSES[name].format(value) for name, value in windows.items() if value]
    if intent.route in _ROUTES:
        statements.append(f"distances run along the way that turns {_ROUTES[intent.route]}")
    if intent.unmet:
        statements.append(f"can't be met: {intent.unmet}")
    statements += [f"not in any field: “{words}”" for words in intent.beyond]
    return tuple(statements)


def list_motion_facts(wish: intents.MotionWish) -> Iterator[str]:
    """Yield what somebody is to do after t0."""
    yield f"then: {wish.preset.label.lower()}"
    if wish.start is not None:
        yield f"begins {wish.start}"
    if wish.side is not None:
        yield f"comes from the {wish.side}"
    for name, words in _MOTION_FACTS.items():
        if (amount := getattr(wish, name)) is not None:
            yield words.format(amount)


# Private


def _name_thing(request: intents.Request) -> str:
    body = getattr(request, "body", "")
    thing = {
        "vehicles": str(body),
        "walk": "pedestrian",
        "cones": "cones",
        "crash": f"crashed {body}",
        "door": f"door of {request.spot.anchor or request.spot.landmark}",
    }[request.kind]
    return f"{thing} “{request.name}”" if request.name else thing


def _list_facts(request: intents.Request) -> Iterator[str]:
    if request.count is not None and not isinstance(request, intents.DoorRequest):
        yield f"number {request.count}"
    yield from _list_place_facts(request.spot)
    yield from _list_pose_facts(request)
    if isinstance(request, intents.WalkRequest) and request.start is not None:
        yield f"crosses from the {request.start} to the {request.start.other}"
    if isinstance(request, intents.ConesRequest) and request.start is not None:
        yield f"begins at the {request.start} lane boundary"
    if isinstance(request, intents.WalkRequest) and request.end is not None:
        yield f"ends {_name_lateral(request.end)}"
    for name, words in _FACTS.items():
        value = getattr(request, name, None)
        if value is not None and value is not False:
            yield words.format(value)
    for number, gap in enumerate(getattr(request, "behind", ()), start=2):
        yield f"number {number} is {gap} behind the first"
    for number, car in enumerate(getattr(request, "others", ()), start=2):
        yield from (f"number {number} is {fact}" for fact in _list_car_facts(car))


def _list_car_facts(car: intents.CrashedCar) -> Iterator[str]:
    if car.bearing is not None:
        yield f"{car.bearing} the one before"
    if car.gap is not None:
        yield f"{car.gap} from the one before"
    if car.turn_deg is not None:
        yield _name_turn(car.turn_deg, is_signed=car.is_signed)


def _list_place_facts(spot: intents.Spot) -> Iterator[str]:
    if spot.relation is not None:
        anchor = f"“{spot.anchor}”" if spot.anchor else str(spot.landmark or "the ego")
        anchor = f"the {spot.mark}" if spot.mark else anchor
        length = "" if spot.distance is None else f"{spot.distance} "
        way = f" on the way to {spot.via}" if spot.via else ""
        yield f"{length}{spot.relation.words} {anchor}{way}"
    if spot.lane is not None:
        yield f"in the {spot.lane} lane"
    if spot.lateral is not None:
        yield _name_lateral(spot.lateral)
        if spot.lateral.on_shoulder:
            yield "partly on the shoulder"
    yield from (str(setting) for setting in spot.settings)


def _name_lateral(lateral: intents.Lateral) -> str:
    if isinstance(lateral.offset, intents.Length):
        return f"{lateral.offset} from the lane centre towards the {lateral.target}"
    nearness = f"{lateral.nearness}, " if lateral.nearness else ""
    return f"{nearness}towards the {lateral.target}"


def _list_pose_facts(request: intents.Request | intents.Move) -> Iterator[str]:
    facing = getattr(request, "facing", None)
    if facing is not None:
        yield f"{'stands' if facing is intents.Facing.ACROSS else 'faces'} {facing}"
    if turn_deg := getattr(request, "turn_deg", 0.0):
        yield _name_turn(turn_deg)
    speed_mps = getattr(request, "speed_mps", None)
    if speed_mps is not None:
        yield f"moves at {speed_mps:g} m/s" if speed_mps else "stands"
    wish: intents.MotionWish | None = getattr(request, "motion", None)
    if wish is not None:
        yield from list_motion_facts(wish)


def _name_turn(turn_deg: float, *, is_signed: bool = True) -> str:
    side = f"the {intents.Side.LEFT if turn_deg > 0.0 else intents.Side.RIGHT}"
    return f"turned {abs(turn_deg):g} degrees to {side if is_signed else 'a side'}"
