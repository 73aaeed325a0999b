"""Cones as a typed request: their shape, number, spacing, and the worker beside them."""

from __future__ import annotations

from dataclasses import dataclass, field

from augment.errors import InstructionNotUnderstood
from augment.instruction.assembly_parts import PLACE, check_count, check_meaning, sides_of
from augment.instruction.facts import (
    Bears,
    BothSides,
    Distance,
    Faces,
    Fact,
    Formation,
    Kind,
    Posted,
    Rank,
    Reaches,
    Sides,
    Spacing,
    Standing,
    Towards,
    Which,
)
from augment.instruction.grouping import Group
from augment.instruction.intent import (
    CONE_COUNT,
    CONE_SPACING_M,
    Bearing,
    ConesRequest,
    Facing,
    LateralTarget,
    Length,
    Post,
    Shape,
    Side,
    Spot,
)
from augment.instruction.spots import gather, only, spot_of

_MOST_CONES = 40
_FITS_M = 0.1
"""By how much a length may miss a whole number of spacings, as a share of a spacing."""

_SIDE_OF = {LateralTarget.LEFT_BOUNDARY: Side.LEFT, LateralTarget.RIGHT_BOUNDARY: Side.RIGHT}
_ALLOWED = (
    *PLACE,
    *(Towards, Formation, Spacing, Sides, Standing, Reaches, Posted, Bears, BothSides, Faces),
)


def cones(group: Group, assumed: list[str]) -> ConesRequest:
    """The request of a group of cones.

    Raises:
        InstructionNotUnderstood: It lacks something or contradicts itself.
    """
    check_meaning(group, "cones", _ALLOWED)
    told = _told(group.facts)
    shape, start, in_middle = _shape(told, assumed)
    low, reach_m = _reach(told)
    said = only(gather(told.facts, Spacing), "spacings")
    count, spacing = _numbers(group, said.length if said else None, reach_m, shape, assumed)
    sides = only(gather(told.facts, BothSides), "sides")
    if sides is not None and not sides.is_each and group.has(Kind.CONES):
        raise InstructionNotUnderstood(
            f"Whether {count} cones stand on each side or on both together is not said."
        )
    if sides is not None and shape is not Shape.LINE:
        raise InstructionNotUnderstood(f"Both sides mean nothing for a {shape} of cones.")
    post, post_side = _post(told.facts)
    return ConesRequest(
        spot=_spot(told, low, assumed),
        shape=shape,
        count=count,
        spacing=spacing,
        start=start,
        ends_in_middle=in_middle,
        both_sides=sides is not None,
        reach_m=reach_m,
        has_worker=_has_worker(group, assumed),
        post=post,
        post_side=post_side,
    )


# Private


@dataclass(slots=True)
class _Told:
    """What is said of all cones or of the first one, and what of the last one alone."""

    facts: list[Fact] = field(default_factory=list)
    last_place: list[Towards] = field(default_factory=list)
    last_distance: list[Distance] = field(default_factory=list)


def _told(facts: list[Fact]) -> _Told:
    told = _Told()
    is_last = False
    for fact in facts:
        if isinstance(fact, Which):
            is_last = fact.rank is Rank.LAST
            if fact.rank not in {Rank.LAST, Rank.FIRST, Rank.OTHER}:
                raise InstructionNotUnderstood("Only the first and the last cone have a place.")
        elif is_last and isinstance(fact, Towards):
            told.last_place.append(fact)
        elif is_last and isinstance(fact, Distance):
            told.last_distance.append(fact)
        else:
            told.facts.append(fact)
    return told


def _shape(told: _Told, assumed: list[str]) -> tuple[Shape, Side | None, bool]:
    """The shape, where a taper begins, and whether it ends in the middle of the lane."""
    start = sides_of(told.facts)
    formation = only(gather(told.facts, Formation), "shapes")
    faces = {fact.facing for fact in gather(told.facts, Faces)}
    if faces - {Facing.ACROSS}:
        raise InstructionNotUnderstood("Where a cone faces is not known here.")
    targets = {fact.target for fact in gather(told.facts, Towards)}
    ends = {fact.target for fact in told.last_place}
    in_middle = LateralTarget.LANE_CENTRE in ends or (
        start is not None and LateralTarget.LANE_CENTRE in targets
    )
    sided = targets - {LateralTarget.LANE_CENTRE}
    shape = formation.shape if formation else None
    if ends and shape in {None, Shape.LINE, Shape.TAPER}:
        start, shape = _tapered(sided, ends), Shape.TAPER
        sided = set()
    if faces and shape in {None, Shape.LINE}:
        shape = Shape.ROW
    if shape is None:
        shape = Shape.LINE if sided or gather(told.facts, BothSides) else Shape.TAPER
        if shape is Shape.TAPER and start is None:
            assumed.append("the cones stand in a taper")
    if (sided and shape is not Shape.LINE) or (start and shape is not Shape.TAPER):
        raise InstructionNotUnderstood(f"A side of the lane means nothing for a {shape} of cones.")
    if start is None and shape is Shape.TAPER:
        assumed.append("the taper begins at the kerb's side of the lane")
    return shape, start, in_middle


def _tapered(first: set[LateralTarget], last: set[LateralTarget]) -> Side | None:
    """Where the taper of "the first one on the right, the last one on the left" begins."""
    if len(first) != 1 or len(last) != 1 or first == last:
        raise InstructionNotUnderstood("From where to where the cones lead is not clear.")
    begin, end = next(iter(first)), next(iter(last))
    start = _SIDE_OF.get(begin)
    if start is None and begin is not LateralTarget.KERB:
        raise InstructionNotUnderstood("From where to where the cones lead is not clear.")
    if end in _SIDE_OF and start is not None and _SIDE_OF[end] is start:
        raise InstructionNotUnderstood("The sides contradict each other.")
    return start


def _reach(told: _Told) -> tuple[Distance | None, float | None]:
    """The distance of the first cone where a stretch names it, and the length of the stretch."""
    stretch = only(gather(told.facts, Reaches), "lengths")
    if stretch is None:
        ranges = [fact.length for fact in gather(told.facts, Distance) if fact.length.is_range]
        if ranges and not told.last_distance:
            stretch = Reaches(_exact(ranges[0].low_m), _exact(ranges[0].high_m))
    if stretch is None and told.last_distance:
        first = only(gather(told.facts, Distance), "distances")
        last = only(told.last_distance, "distances")
        stretch = Reaches(first.length if first else None, last.length if last else None)
    if stretch is None:
        return None, None
    if stretch.size is not None:
        return None, _one_number(stretch.size)
    if stretch.start is None or stretch.end is None:
        raise InstructionNotUnderstood("Where the cones begin and end is not said.")
    reach_m = _one_number(stretch.end) - _one_number(stretch.start)
    if reach_m <= 0.0:
        raise InstructionNotUnderstood("The cones would end before they begin.")
    return Distance(stretch.start), reach_m


def _exact(metres: float) -> Length:
    return Length(low_m=metres, high_m=metres)


def _one_number(length: Length) -> float:
    if length.is_range:
        raise InstructionNotUnderstood("A stretch of cones needs one number for each end.")
    return length.low_m


def _numbers(
    group: Group, said: Length | None, reach_m: float | None, shape: Shape, assumed: list[str]
) -> tuple[int, Length]:
    """How many cones and how far apart; a stretch gives one of the two."""
    count = next((thing.count for thing in group.things if thing.kind is Kind.CONES), None)
    if reach_m is not None and shape not in {Shape.LINE, Shape.TAPER}:
        raise InstructionNotUnderstood(f"A length along the road means nothing for a {shape}.")
    spacing = said or _exact(CONE_SPACING_M)
    if count is None and reach_m is not None:
        gaps = reach_m / max(spacing.low_m, 0.1)
        count = round(gaps) + 1
        if said is not None and abs(gaps - round(gaps)) > _FITS_M:
            raise InstructionNotUnderstood(f"{reach_m:g} m are no whole number of spacings.")
        assumed.append(f"{count} cones")
    elif count is None:
        if not group.has(Kind.ZONE):
            raise InstructionNotUnderstood("How many cones is not said.")
        count = CONE_COUNT
        assumed.append(f"{CONE_COUNT} cones")
    elif reach_m is not None and said is not None:
        gaps = reach_m / max(said.low_m, 0.1)
        if abs(gaps - (count - 1)) > _FITS_M * max(count - 1, 1):
            raise InstructionNotUnderstood("The length, the spacing and the number contradict.")
    check_count(count, _MOST_CONES, "cones")
    if said is None and reach_m is None:
        assumed.append(f"{CONE_SPACING_M:g} m between the cones")
    return count, spacing


def _spot(told: _Told, low: Distance | None, assumed: list[str]) -> Spot:
    facts = [fact for fact in told.facts if not isinstance(fact, Reaches)]
    if low is not None:
        facts = [low, *(fact for fact in facts if not isinstance(fact, Distance))]
    return spot_of(facts, assumed, whole_lane=True)


def _has_worker(group: Group, assumed: list[str]) -> bool:
    workers = [thing.count or 1 for thing in group.things if thing.kind is Kind.WORKER]
    is_zone = group.has(Kind.ZONE)
    if workers not in ([], [1]):
        raise InstructionNotUnderstood("Exactly one worker is placed beside cones.")
    if is_zone and not workers:
        assumed.append("one worker stands beside the cones")
    return is_zone or bool(workers)


def _post(facts: list[Fact]) -> tuple[Post | None, Side | None]:
    bearings = {Bearing.BEHIND: Post.BEHIND, Bearing.LEFT: Post.BESIDE, Bearing.RIGHT: Post.BESIDE}
    posts = gather(facts, Posted)
    for fact in gather(facts, Bears):
        if fact.bearing not in bearings:
            raise InstructionNotUnderstood("A worker in front of the cones is not placed.")
        side = {Bearing.LEFT: Side.LEFT, Bearing.RIGHT: Side.RIGHT}.get(fact.bearing)
        posts.append(Posted(bearings[fact.bearing], side))
    found = only(posts, "places of the worker")
    return (found.post, found.side) if found else (None, None)
