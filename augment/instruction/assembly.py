"""Groups of facts as typed requests: each has all that it needs and nothing that contradicts."""

from __future__ import annotations

from augment.errors import InstructionNotUnderstood
from augment.instruction.facts import (
    Crashed,
    Crosses,
    Direction,
    Distance,
    Faces,
    Fact,
    Formation,
    InLane,
    Kind,
    Moving,
    Offset,
    Shoulder,
    Sides,
    Spacing,
    Standing,
    Surroundings,
    Towards,
    Turned,
)
from augment.instruction.grouping import Group
from augment.instruction.intent import (
    CONE_COUNT,
    CONE_SPACING_M,
    Body,
    ConesRequest,
    CrashRequest,
    Facing,
    LateralTarget,
    Length,
    Request,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)
from augment.instruction.spots import gather, only, spot_of

_PLACE = (Distance, Direction, InLane, Surroundings)
_ACROSS = (Towards, Offset, Shoulder)
_MOST_CONES, _MOST_CARS, _MOST_WALKERS = 40, 4, 6


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
        return _crash(group, assumed)
    if group.has(Kind.PEDESTRIAN):
        return _walk(group, assumed)
    if group.has(Kind.CONES) or group.has(Kind.ZONE):
        return _cones(group, assumed)
    if group.has(Kind.WORKER):
        raise InstructionNotUnderstood("A worker is only placed beside cones, and none are named.")
    return _vehicle(group, assumed)


def _vehicle(group: Group, assumed: list[str]) -> VehicleRequest:
    _check_meaning(group, "a vehicle", (*_PLACE, *_ACROSS, Standing, Moving, Faces, Turned))
    if _count(group, Kind.VEHICLE) != 1:
        raise InstructionNotUnderstood("Several vehicles need a sentence and a place each.")
    moving, standing = gather(group.facts, Moving), gather(group.facts, Standing)
    speeds = {fact.speed_mps for fact in moving if fact.speed_mps is not None}
    if standing and (moving and speeds != {0.0}):
        raise InstructionNotUnderstood("It can't both stand and move.")
    if moving and len(speeds) != 1:
        raise InstructionNotUnderstood("A vehicle that moves needs one speed, such as 8 m/s.")
    if not moving and not standing:
        assumed.append("the vehicle stands still")
    turned = only(gather(group.facts, Turned), "angles")
    if turned is not None and turned.side is None:
        raise InstructionNotUnderstood("To which side the vehicle is turned is not said.")
    faces = only(gather(group.facts, Faces), "headings")
    return VehicleRequest(
        spot=spot_of(group.facts, assumed),
        body=next((thing.body for thing in group.things if thing.body), Body.VEHICLE),
        facing=faces.facing if faces else Facing.WITH_LANE,
        turn_deg=_signed(turned),
        speed_mps=next(iter(speeds), 0.0),
    )


def _walk(group: Group, assumed: list[str]) -> WalkRequest:
    _check_meaning(group, "a pedestrian", (*_PLACE, Crosses, Sides))
    if not gather(group.facts, Crosses):
        raise InstructionNotUnderstood("What the pedestrian does is not said; only crossing is.")
    start, _ = _sides(group.facts)
    if start is None:
        raise InstructionNotUnderstood("From which side the pedestrian crosses is not said.")
    count = _count(group, Kind.PEDESTRIAN)
    _check_count(count, _MOST_WALKERS, "pedestrians")
    spot = spot_of(group.facts, assumed, whole_lane=True)
    return WalkRequest(spot=spot, start=start, count=count)


def _cones(group: Group, assumed: list[str]) -> ConesRequest:
    _check_meaning(group, "cones", (*_PLACE, Towards, Formation, Spacing, Sides, Standing))
    start, _ = _sides(group.facts)
    formation = only(gather(group.facts, Formation), "shapes")
    towards = [
        fact
        for fact in gather(group.facts, Towards)
        if fact.target is not LateralTarget.LANE_CENTRE
    ]
    shape = formation.shape if formation else Shape.LINE if towards else Shape.TAPER
    if (towards and shape is not Shape.LINE) or (start and shape is not Shape.TAPER):
        raise InstructionNotUnderstood(f"A side of the lane means nothing for a {shape} of cones.")
    spacing = only(gather(group.facts, Spacing), "spacings")
    workers = [thing.count or 1 for thing in group.things if thing.kind is Kind.WORKER]
    if workers not in ([], [1]):
        raise InstructionNotUnderstood("Exactly one worker is placed beside cones.")
    count = next((thing.count for thing in group.things if thing.kind is Kind.CONES), None)
    is_zone = group.has(Kind.ZONE)
    if count is None and not is_zone:
        raise InstructionNotUnderstood("How many cones is not said.")
    _check_count(CONE_COUNT if count is None else count, _MOST_CONES, "cones")
    if formation is None and shape is Shape.TAPER:
        assumed.append("the cones stand in a taper")
    if start is None and shape is Shape.TAPER:
        assumed.append("the taper begins at the kerb's side of the lane")
    if count is None:
        assumed.append(f"{CONE_COUNT} cones")
    if spacing is None:
        assumed.append(f"{CONE_SPACING_M:g} m between the cones")
    if is_zone and not workers:
        assumed.append("one worker stands beside the cones")
    return ConesRequest(
        spot=spot_of(group.facts, assumed, whole_lane=True),
        shape=shape,
        count=CONE_COUNT if count is None else count,
        spacing=spacing.length if spacing else Length(low_m=CONE_SPACING_M, high_m=CONE_SPACING_M),
        start=start,
        has_worker=is_zone or bool(workers),
    )


def _crash(group: Group, assumed: list[str]) -> CrashRequest:
    _check_meaning(group, "an accident", (*_PLACE, Crashed, Standing, Turned))
    counts = {thing.count for thing in group.things if thing.count and thing.is_plural}
    counts |= {thing.count for thing in group.things if thing.count and thing.kind is Kind.CRASH}
    if len(counts) != 1:
        raise InstructionNotUnderstood("How many vehicles have crashed is not said.")
    count = counts.pop()
    _check_count(count, _MOST_CARS, "crashed vehicles")
    if count < 2:
        raise InstructionNotUnderstood("An accident needs at least two vehicles.")
    turned = only(gather(group.facts, Turned), "angles")
    return CrashRequest(
        spot=spot_of(group.facts, assumed, whole_lane=True),
        count=count,
        body=next((thing.body for thing in group.things if thing.body), Body.CAR),
        turn_deg=None if turned is None else _signed(turned),
    )


def _check_meaning(group: Group, what: str, allowed: tuple[type[Fact], ...]) -> None:
    for fact in group.facts:
        if not isinstance(fact, allowed):
            part = type(fact).__name__.lower()
            raise InstructionNotUnderstood(f"What “{part}” means for {what} is not known here.")


def _count(group: Group, kind: Kind) -> int:
    """The one count of a noun; an article or nothing before a singular is one."""
    thing = next(thing for thing in group.things if thing.kind is kind)
    if thing.is_plural and thing.count is None:
        raise InstructionNotUnderstood(f"How many {kind}s is not said.")
    return 1 if thing.count is None else thing.count


def _check_count(count: int, most: int, what: str) -> None:
    if not 1 <= count <= most:
        raise InstructionNotUnderstood(f"{count} {what}: from 1 to {most} are placed.")


def _sides(facts: list[Fact]) -> tuple[Side | None, Side | None]:
    starts = {fact.start for fact in gather(facts, Sides) if fact.start}
    ends = {fact.end for fact in gather(facts, Sides) if fact.end}
    starts |= {end.other for end in ends}
    if len(starts) > 1:
        raise InstructionNotUnderstood("The sides contradict each other.")
    start = next(iter(starts), None)
    return start, start.other if start else None


def _signed(turned: Turned | None) -> float:
    if turned is None:
        return 0.0
    return -turned.degrees if turned.side is Side.RIGHT else turned.degrees
