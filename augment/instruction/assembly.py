"""Groups of facts as typed requests: each has all that it needs and nothing that contradicts."""

from __future__ import annotations

from augment.errors import InstructionNotUnderstood
from augment.instruction.assembly_cones import cones
from augment.instruction.assembly_crash import crash
from augment.instruction.assembly_parts import (
    ACROSS,
    PLACE,
    check_count,
    check_meaning,
    count_of,
    sides_of,
    signed,
)
from augment.instruction.facts import (
    Apart,
    Bears,
    Crashed,
    Crosses,
    Drifts,
    Faces,
    Fact,
    Formation,
    Kind,
    Moving,
    OnRoad,
    PartlyIn,
    Reaches,
    Row,
    Sides,
    Spacing,
    Standing,
    Towards,
    Turned,
    WrongSide,
)
from augment.instruction.grouping import Group
from augment.instruction.intent import (
    Bearing,
    Body,
    Facing,
    LateralTarget,
    Length,
    Nearness,
    Relation,
    Request,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)
from augment.instruction.spots import gather, only, spot_of

_MOST_WALKERS, _MOST_IN_ROW = 6, 8
_FILE_GAP = Length(low_m=1.5, high_m=1.5)
_SIDE_OF = {LateralTarget.LEFT_BOUNDARY: Side.LEFT, LateralTarget.RIGHT_BOUNDARY: Side.RIGHT}


def requested(groups: list[Group]) -> tuple[tuple[Request, ...], tuple[str, ...]]:
    """The requests of a text, and the defaults that filled what it left open.

    Raises:
        InstructionNotUnderstood: There is none, or one lacks something or contradicts itself.
    """
    if not groups:
        raise InstructionNotUnderstood("No object is named that could be added.")
    assumed: list[str] = []
    requests = tuple(_request(group, assumed) for group in groups)
    return requests, tuple(assumed)


# Private


def _request(group: Group, assumed: list[str]) -> Request:
    if group.has(Kind.CRASH) or gather(group.facts, Crashed):
        return crash(group, assumed)
    if group.has(Kind.PEDESTRIAN):
        return _walk(group, assumed)
    if group.has(Kind.CONES) or group.has(Kind.ZONE):
        return cones(group, assumed)
    if group.has(Kind.WORKER):
        raise InstructionNotUnderstood("A worker is only placed beside cones, and none are named.")
    return _vehicle(group, assumed)


_OF_A_VEHICLE = (*PLACE, *ACROSS, Standing, Moving, Faces, Turned, Reaches, PartlyIn, WrongSide)


def _vehicle(group: Group, assumed: list[str]) -> VehicleRequest:
    check_meaning(group, "a vehicle", (*_OF_A_VEHICLE, Row, Formation, Spacing))
    count, spacing = _row_of(group, assumed)
    turned = only(gather(group.facts, Turned), "angles")
    if turned is not None and turned.side is None and turned.degrees not in (0.0, 180.0):
        raise InstructionNotUnderstood("To which side the vehicle is turned is not said.")
    faces = only(gather(group.facts, Faces), "headings")
    facing = faces.facing if faces else Facing.WITH_LANE
    if gather(group.facts, WrongSide) and facing is not Facing.AGAINST_LANE:
        raise InstructionNotUnderstood("Which side is the wrong one depends on where it faces.")
    speed_mps = _speed(group, assumed)
    return VehicleRequest(
        spot=spot_of(group.facts, assumed),
        body=next((thing.body for thing in group.things if thing.body), Body.VEHICLE),
        facing=facing,
        turn_deg=signed(turned),
        speed_mps=speed_mps,
        count=count,
        spacing=spacing,
    )


def _speed(group: Group, assumed: list[str]) -> float:
    moving, standing = gather(group.facts, Moving), gather(group.facts, Standing)
    speeds = {fact.speed_mps for fact in moving if fact.speed_mps is not None}
    if standing and (moving and speeds != {0.0}):
        raise InstructionNotUnderstood("It can't both stand and move.")
    if moving and len(speeds) != 1:
        raise InstructionNotUnderstood("A vehicle that moves needs one speed, such as 8 m/s.")
    if not moving and not standing:
        assumed.append("the vehicle stands still")
    return next(iter(speeds), 0.0)


def _row_of(group: Group, assumed: list[str]) -> tuple[int, Length | None]:
    count = count_of(group, Kind.VEHICLE)
    spacing = only(gather(group.facts, Spacing), "spacings")
    shapes = {fact.shape for fact in gather(group.facts, Formation)}
    if count == 1:
        if spacing or shapes:
            raise InstructionNotUnderstood("A spacing means nothing for a single vehicle.")
        return 1, None
    if shapes - {Shape.LINE}:
        raise InstructionNotUnderstood("Vehicles are only placed in a row along the lane.")
    if not (spacing or shapes or gather(group.facts, Row)):
        raise InstructionNotUnderstood("Several vehicles need a sentence and a place each.")
    check_count(count, _MOST_IN_ROW, "vehicles in a row")
    if spacing is None:
        assumed.append("1 m between the bumpers of neighbours")
    return count, spacing.length if spacing else None


_OF_A_WALK = (*PLACE, Crosses, Sides, Moving, Standing, Drifts, OnRoad, Row, Formation, Faces)


def _walk(group: Group, assumed: list[str]) -> WalkRequest:
    check_meaning(group, "a pedestrian", (*_OF_A_WALK, Towards, Apart, Bears))
    faces = {fact.facing for fact in gather(group.facts, Faces)}
    if faces - {Facing.ACROSS}:
        raise InstructionNotUnderstood("A pedestrian faces the way that it walks.")
    across = faces or any(fact.shape is Shape.ROW for fact in gather(group.facts, Formation))
    if not gather(group.facts, Crosses) and not across:
        raise InstructionNotUnderstood("What the pedestrian does is not said; only crossing is.")
    start = sides_of([*group.facts, *_walk_sides(group.facts)])
    if start is None:
        raise InstructionNotUnderstood("From which side the pedestrian crosses is not said.")
    count = count_of(group, Kind.PEDESTRIAN)
    check_count(count, _MOST_WALKERS, "pedestrians")
    speeds = {fact.speed_mps for fact in gather(group.facts, Moving) if fact.speed_mps}
    if len(speeds) > 1:
        raise InstructionNotUnderstood("Two speeds contradict each other.")
    behind = _behind(group.facts, count)
    shapes = {fact.shape for fact in gather(group.facts, Formation)}
    is_file = bool(behind or gather(group.facts, Row) or Shape.LINE in shapes)
    if is_file and count > 1 and not behind:
        behind = tuple(
            Length(low_m=index * _FILE_GAP.low_m, high_m=index * _FILE_GAP.high_m)
            for index in range(1, count)
        )
        assumed.append(f"{_FILE_GAP} from one to the next")
    drift = only(gather(group.facts, Drifts), "ends of the walk")
    spot = spot_of(group.facts, assumed, whole_lane=True)
    return WalkRequest(
        spot=spot,
        start=start,
        count=count,
        speed_mps=next(iter(speeds), None),
        drift_m=_drift_m(drift),
        is_file=is_file and count > 1,
        behind=behind,
        on_road=bool(gather(group.facts, OnRoad)),
    )


def _walk_sides(facts: list[Fact]) -> list[Sides]:
    """At a kerb is where a walk starts, towards one where it ends."""
    found = []
    for fact in gather(facts, Towards):
        side = _SIDE_OF.get(fact.target)
        if side is None:
            raise InstructionNotUnderstood(f"Which side the {fact.target} is on is not said.")
        found.append(Sides(side, None) if fact.nearness is Nearness.AT_EDGE else Sides(None, side))
    return found


def _behind(facts: list[Fact], count: int) -> tuple[Length, ...]:
    """How far behind the first each further one follows, where all of that is said."""
    said = gather(facts, Apart)
    if not said:
        return ()
    if any(fact.bearing is not Bearing.BEHIND for fact in said) or len(said) != count - 1:
        raise InstructionNotUnderstood("How far behind the first the others walk is not clear.")
    return tuple(fact.length for fact in said)


def _drift_m(drift: Drifts | None) -> float:
    if drift is None:
        return 0.0
    if drift.length.is_range:
        raise InstructionNotUnderstood("Where the walk ends needs one number.")
    return drift.length.low_m if drift.relation is Relation.AHEAD else -drift.length.low_m
