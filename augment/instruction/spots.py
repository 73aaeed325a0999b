"""Where a request is: the facts about one place, put together and held against each other."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

from augment.errors import InstructionNotUnderstood
from augment.instruction.facts import (
    Direction,
    Distance,
    Fact,
    InLane,
    Offset,
    PartlyIn,
    Reaches,
    Shoulder,
    Surroundings,
    Towards,
)
from augment.instruction.intent import (
    SLIGHT_OFFSET_M,
    LaneChoice,
    Lateral,
    LateralTarget,
    Length,
    Nearness,
    Side,
    Spot,
)

T = TypeVar("T")

_SHOULDERS = {
    None: LateralTarget.KERB,
    Side.LEFT: LateralTarget.LEFT_BOUNDARY,
    Side.RIGHT: LateralTarget.RIGHT_BOUNDARY,
}


def gather(facts: Sequence[Fact], kind: type[T]) -> list[T]:
    """The facts of one kind, in order."""
    return [fact for fact in facts if isinstance(fact, kind)]


def only(facts: Sequence[T], what: str) -> T | None:
    """The one fact, None without any.

    Raises:
        InstructionNotUnderstood: There are two that differ.
    """
    different = list(dict.fromkeys(facts))
    if len(different) > 1:
        raise InstructionNotUnderstood(f"Two {what} contradict each other.")
    return different[0] if different else None


def spot_of(facts: Sequence[Fact], assumed: list[str], *, whole_lane: bool = False) -> Spot:
    """The place that the facts describe; what a default fills is added to `assumed`.

    Args:
        facts: All that is said about one group.
        assumed: Collects sentences about defaults.
        whole_lane: Whether it spreads over the lane, so that its place across needs no default.

    Raises:
        InstructionNotUnderstood: The distance, its direction or a side is missing, or two differ.
    """
    lengths = [fact.length for fact in gather(facts, Distance)]
    lengths += [_drawn_from(fact) for fact in gather(facts, Reaches)]
    if not lengths:
        raise InstructionNotUnderstood("How far away is not said.")
    if len({(length.low_m, length.high_m) for length in lengths}) > 1:
        raise InstructionNotUnderstood("Two distances contradict each other.")
    direction = only(gather(facts, Direction), "directions")
    if direction is None:
        raise InstructionNotUnderstood("Whether it is ahead of the ego or behind is not said.")
    lane = only(gather(facts, InLane), "lanes")
    if lane is None and not whole_lane:
        assumed.append("in the ego's lane")
    return Spot(
        distance=lengths[0],
        relation=direction.relation,
        lane=lane.lane if lane else LaneChoice.OWN,
        lateral=_lateral(facts, [] if whole_lane else assumed),
        settings=tuple(dict.fromkeys(fact.setting for fact in gather(facts, Surroundings))),
    )


# Private


def _drawn_from(reach: Reaches) -> Length:
    """For what has no length itself, "from 15 m to 20 m" is a range to draw a distance from."""
    if reach.start is None or reach.end is None or reach.start.low_m > reach.end.high_m:
        raise InstructionNotUnderstood("A length along the road means something for cones alone.")
    return Length(low_m=reach.start.low_m, high_m=reach.end.high_m)


def _lateral(facts: Sequence[Fact], assumed: list[str]) -> Lateral:
    towards, shoulder = gather(facts, Towards), only(gather(facts, Shoulder), "shoulders")
    offsets = gather(facts, Offset)
    named = {fact.target for fact in towards}
    if not named and shoulder:
        named = {_SHOULDERS[shoulder.side]}
    by_map = named & {LateralTarget.KERB, LateralTarget.CENTRE_LINE}
    also = next(iter(by_map)) if len(named) == 2 and len(by_map) == 1 else None
    named -= {also}
    if len(named) > 1 or (also and LateralTarget.LANE_CENTRE in named):
        raise InstructionNotUnderstood(f"Two sides contradict each other: {_listed(named)}.")
    length = only([fact.length for fact in offsets if fact.length is not None], "offsets")
    is_offset = length.high_m > 0.0 if length else bool(offsets)
    target = next(iter(named), LateralTarget.LANE_CENTRE)
    if is_offset and target is LateralTarget.LANE_CENTRE:
        raise InstructionNotUnderstood(
            "To which side of the lane centre it is offset is not said."
        )
    nearness = _nearness(towards)
    if gather(facts, PartlyIn) and target is LateralTarget.LANE_CENTRE and not named:
        raise InstructionNotUnderstood("How far it stands in the lane is not said.")
    if nearness is None:
        nearness = shoulder.nearness if shoulder else Nearness.SLIGHTLY
    if length is None and target is not LateralTarget.LANE_CENTRE:
        if nearness is Nearness.SLIGHTLY:
            assumed.append(f"slightly means {SLIGHT_OFFSET_M:g} m")
    elif not named and length is None:
        assumed.append("in the middle of the lane")
    return Lateral(
        target=target,
        offset=length,
        nearness=nearness,
        on_shoulder=shoulder is not None,
        also=also,
    )


def _nearness(towards: list[Towards]) -> Nearness | None:
    """The strongest word: at the edge is more than slightly."""
    named = {fact.nearness for fact in towards if fact.nearness}
    return Nearness.AT_EDGE if Nearness.AT_EDGE in named else next(iter(named), None)


def _listed(targets: set[LateralTarget]) -> str:
    return " and ".join(sorted(targets))
