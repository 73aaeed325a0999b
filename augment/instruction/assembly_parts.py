"""What the assembly of every kind of request needs: counts, sides, signs, and what may be said."""

from __future__ import annotations

from collections.abc import Sequence

from augment.errors import InstructionNotUnderstood
from augment.instruction.facts import (
    Direction,
    Distance,
    Fact,
    InLane,
    Kind,
    Offset,
    Shoulder,
    Sides,
    Surroundings,
    Thing,
    Towards,
    Turned,
    Which,
)
from augment.instruction.grouping import Group
from augment.instruction.intent import Side
from augment.instruction.spots import gather

PLACE: tuple[type[Fact], ...] = (Distance, Direction, InLane, Surroundings)
ACROSS: tuple[type[Fact], ...] = (Towards, Offset, Shoulder)

_WORDS = {
    "Apart": "a distance from a neighbour",
    "Bears": "a direction from a neighbour",
    "BothSides": "both sides",
    "Formation": "a shape",
    "Moving": "a speed",
    "Offset": "an offset",
    "Posted": "a place beside cones",
    "Reaches": "a length along the road",
    "Row": "a row",
    "Spacing": "a spacing",
    "Turned": "an angle",
}


def check_meaning(group: Group, what: str, allowed: tuple[type[Fact], ...]) -> None:
    """Refuse what is said about a group that can't be placed with it.

    Raises:
        InstructionNotUnderstood: It names the first such thing.
    """
    for fact in group.facts:
        if not isinstance(fact, (*allowed, Thing, Which)):
            name = type(fact).__name__
            part = _WORDS.get(name, f"“{name.lower()}”")
            raise InstructionNotUnderstood(f"What {part} means for {what} is not known here.")


def count_of(group: Group, kind: Kind) -> int:
    """The one count of a noun; an article or nothing before a singular is one.

    Raises:
        InstructionNotUnderstood: A plural without a number.
    """
    thing = next(thing for thing in group.things if thing.kind is kind)
    if thing.is_plural and thing.count is None:
        raise InstructionNotUnderstood(f"How many {kind}s is not said.")
    return 1 if thing.count is None else thing.count


def check_count(count: int, most: int, what: str) -> None:
    """Refuse a number that nobody would place.

    Raises:
        InstructionNotUnderstood: It is below 1 or above `most`.
    """
    if not 1 <= count <= most:
        raise InstructionNotUnderstood(f"{count} {what}: from 1 to {most} are placed.")


def sides_of(facts: Sequence[Fact]) -> Side | None:
    """The side that something begins at, None where no side is named.

    Raises:
        InstructionNotUnderstood: The sides contradict each other.
    """
    starts = {fact.start for fact in gather(facts, Sides) if fact.start}
    starts |= {fact.end.other for fact in gather(facts, Sides) if fact.end}
    if len(starts) > 1:
        raise InstructionNotUnderstood("The sides contradict each other.")
    return next(iter(starts), None)


def signed(turned: Turned | None) -> float:
    """An angle in degrees, positive to the left; 0 without any."""
    if turned is None:
        return 0.0
    return -turned.degrees if turned.side is Side.RIGHT else turned.degrees
