"""An accident as a typed request: how many vehicles, and what is said of each of them."""

from __future__ import annotations

from augment.errors import InstructionNotUnderstood
from augment.instruction.assembly_parts import PLACE, check_count, check_meaning, signed
from augment.instruction.facts import (
    Apart,
    Bears,
    Crashed,
    Direction,
    Distance,
    Drifts,
    Faces,
    Fact,
    Kind,
    Posted,
    Rank,
    Row,
    Spacing,
    Standing,
    Thing,
    Turned,
    Which,
)
from augment.instruction.grouping import Group
from augment.instruction.intent import (
    Bearing,
    Body,
    CrashedCar,
    CrashRequest,
    Facing,
    Length,
    Post,
    Relation,
    Side,
    Spot,
)
from augment.instruction.spots import gather, only, spot_of

_MOST_CARS = 4
_NUMBERED = {Rank.FIRST: 0, Rank.SECOND: 1, Rank.THIRD: 2, Rank.FOURTH: 3}
_NAMED = {Rank.FORMER: 0, Rank.LATTER: 1}
_TURNS = {Facing.AGAINST_LANE: 180.0, Facing.ACROSS: 90.0}
_ALLOWED = (*PLACE, Crashed, Standing, Turned, Faces, Apart, Bears, Posted, Spacing, Row, Drifts)

Facts = list[Fact]


def crash(group: Group, assumed: list[str]) -> CrashRequest:
    """The request of a group of crashed vehicles.

    Raises:
        InstructionNotUnderstood: It lacks something or contradicts itself.
    """
    check_meaning(group, "an accident", _ALLOWED)
    count = _count(group)
    every, cars = _shares(group.facts, count)
    _check_first(cars, every)
    turned = only(gather(every, Turned), "angles")
    others = tuple(_other(cars[0], facts, every) for facts in cars[1:])
    is_told = any(other != CrashedCar() for other in others)
    spot = spot_of([*_places(every), *_places(cars[0])], assumed, whole_lane=True)
    _check_alone(cars[1:], spot)
    if not is_told and turned is None:
        assumed.append("the angles between them")
    return CrashRequest(
        spot=spot,
        count=count,
        body=_body(group),
        turn_deg=None if turned is None else signed(turned),
        facing=_facing(cars[0]),
        others=others if is_told else (),
    )


# Private


def _check_first(cars: list[Facts], every: Facts) -> None:
    """The angle of the first of two is that between them; of more it is not clear."""
    turned = gather(cars[0], Turned)
    if turned and (len(cars) > 2 or turned[0].side is not None or gather(cars[1], Turned)):
        raise InstructionNotUnderstood("Against what the first of the cars is turned is not said.")
    if gather(cars[0], Bears):
        raise InstructionNotUnderstood("The first of the cars is placed from the ego.")
    every += turned


def _count(group: Group) -> int:
    counts = {thing.count for thing in group.things if thing.count and thing.is_plural}
    counts |= {thing.count for thing in group.things if thing.count and thing.kind is Kind.CRASH}
    named = sum(thing.kind is Kind.VEHICLE and not thing.is_plural for thing in group.things)
    if not counts and named > 1:
        counts = {named}
    if counts == {1} and group.has(Kind.CRASH):
        counts = set()
    if len(counts) != 1:
        raise InstructionNotUnderstood("How many vehicles have crashed is not said.")
    count = counts.pop() or 0
    check_count(count, _MOST_CARS, "crashed vehicles")
    if count < 2:
        raise InstructionNotUnderstood("An accident needs at least two vehicles.")
    return count


def _body(group: Group) -> Body:
    bodies = {thing.body for thing in group.things if thing.body}
    if len(bodies - {Body.VEHICLE}) > 1 or (Body.VEHICLE in bodies and Body.BUS in bodies):
        raise InstructionNotUnderstood("Crashed vehicles of different kinds are not placed.")
    special = bodies - {Body.VEHICLE}
    return next(iter(special or bodies), Body.CAR)


def _shares(facts: Facts, count: int) -> tuple[Facts, list[Facts]]:
    """What is said of all of them, and of each, the one with a distance from the ego first."""
    every: Facts = []
    cars: list[Facts] = [[] for _ in range(count)]
    share, last, named = every, 0, -1
    for fact in facts:
        if isinstance(fact, Thing):
            if fact.kind is Kind.VEHICLE and fact.count == 1 and not fact.is_plural:
                named += 1
                share, last = cars[_within(named, count)], named
        elif isinstance(fact, Which):
            is_queue = fact.rank is Rank.LAST and share is every  # its end is the nearest
            last = 0 if is_queue else _which(fact.rank, last, count)
            share = cars[_within(last, count)]
        elif isinstance(fact, Spacing):
            every.append(fact)
        elif isinstance(fact, Drifts):
            is_ahead = fact.relation is Relation.AHEAD
            share.append(Apart(fact.length, Bearing.AHEAD if is_ahead else Bearing.BEHIND))
        else:
            share.append(fact)
    if count == 2 and [_has_place(car) for car in cars] == [False, True]:
        cars.reverse()
    return every, cars


def _within(index: int, count: int) -> int:
    if index >= count:
        raise InstructionNotUnderstood(f"More than {count} crashed vehicles are spoken of.")
    return index


def _which(rank: Rank, last: int, count: int) -> int:
    if rank in _NUMBERED:
        return _NUMBERED[rank]
    if rank in _NAMED:
        return _NAMED[rank]
    if rank is Rank.LAST:
        return count - 1
    return min(last + 1, count - 1) if last > 0 else 1


def _has_place(facts: Facts) -> bool:
    """Whether a distance from the ego is among them."""
    return bool(gather(facts, Distance)) and bool(gather(facts, Direction))


def _places(facts: Facts) -> Facts:
    return [fact for fact in facts if isinstance(fact, PLACE)]


def _facing(facts: Facts) -> Facing:
    faces = only(gather(facts, Faces), "headings")
    return faces.facing if faces else Facing.WITH_LANE


def _other(first: Facts, facts: Facts, every: Facts) -> CrashedCar:
    """A further vehicle against the one before it."""
    shared = [fact for fact in [*facts, *every] if not _is_place_of_all(fact, every)]
    gap = _gap(first, facts, [*shared, *gather(first, Apart)])
    turned = only([*gather(facts, Turned), *gather(every, Turned)], "angles")
    faces = only(gather(facts, Faces), "headings")
    turn_deg = None if turned is None else signed(turned)
    if turned is None and faces is not None:
        turn_deg = _TURNS.get(faces.facing, 0.0)
    return CrashedCar(
        gap=gap,
        bearing=_bearing([*facts, *every]),
        turn_deg=turn_deg,
        is_signed=turned is not None and turned.side is not None,
    )


def _is_place_of_all(fact: Fact, every: Facts) -> bool:
    return isinstance(fact, Distance) and fact in every


def _gap(first: Facts, facts: Facts, shared: Facts) -> Length | None:
    lengths = [fact.length for fact in gather(shared, Apart) + gather(shared, Spacing)]
    own = [fact.length for fact in gather(facts, Distance)]
    if _has_place(facts):
        start = next((fact.length for fact in gather(first, Distance)), None)
        if start is None or own[0].low_m <= start.low_m:
            raise InstructionNotUnderstood("Two distances contradict each other.")
        size_m = own[0].low_m - start.low_m
        lengths.append(Length(low_m=size_m, high_m=size_m))
    else:
        lengths += own
    return only(lengths, "distances")


def _bearing(facts: Facts) -> Bearing:
    named = {fact.bearing for fact in gather(facts, Bears)}
    named |= {fact.bearing for fact in gather(facts, Apart) if fact.bearing}
    for posted in gather(facts, Posted):
        if posted.post is Post.BEHIND:
            named.add(Bearing.BEHIND)
        elif posted.side is not None:
            named.add(Bearing.LEFT if posted.side is Side.LEFT else Bearing.RIGHT)
    if len(named) > 1:
        raise InstructionNotUnderstood("Two directions contradict each other.")
    return next(iter(named), Bearing.AHEAD)


def _check_alone(others: list[Facts], spot: Spot) -> None:
    """A lane of its own for a further vehicle is not placed."""
    for facts in others:
        for fact in _places(facts):
            lane = getattr(fact, "lane", None)
            if lane is not None and lane is not spot.lane:
                raise InstructionNotUnderstood("Crashed vehicles stand in one lane here.")
