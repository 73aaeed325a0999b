"""Which phrase belongs to which object: each noun opens a group, or goes on with one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from augment.errors import InstructionNotUnderstood
from augment.instruction.facts import Fact, Kind, Mention, Purpose, Thing
from augment.instruction.intent import Body
from augment.instruction.reading import Read

_ROADWORKS = frozenset({Kind.ZONE, Kind.CONES, Kind.WORKER})
_ANY_CAR = frozenset({Body.VEHICLE, Body.CAR})


@dataclass(slots=True)
class Group:
    """The nouns that name one object or one arrangement, and all that is said about it."""

    things: list[Thing] = field(default_factory=list)
    facts: list[Fact] = field(default_factory=list)

    def has(self, kind: Kind) -> bool:
        """Whether one of its nouns is of that kind."""
        return any(thing.kind is kind for thing in self.things)


def grouped(reads: Iterable[Read]) -> list[Group]:
    """The groups of a text in order; what comes before the first noun belongs to it.

    Raises:
        InstructionNotUnderstood: A noun with "the" points at nothing that was named.
    """
    groups: list[Group] = []
    early: list[Fact] = []
    current: Group | None = None
    for fact in (fact for part in reads for fact in part.facts):
        if isinstance(fact, Mention | Purpose):
            continue
        if isinstance(fact, Thing):
            current = _group_for(fact, groups)
        elif current is None:
            early.append(fact)
        else:
            current.facts.append(fact)
    if groups:
        groups[0].facts[:0] = early
    return groups


# Private


def _group_for(thing: Thing, groups: list[Group]) -> Group:
    if thing.is_definite and groups:
        for group in reversed(groups):
            if any(_is_same(thing, named) for named in group.things):
                return group
        raise InstructionNotUnderstood(
            f"“the {thing.body or thing.kind}” was not named before; "
            "distances are only read from the ego."
        )
    if groups and _goes_on(thing, groups[-1]):
        groups[-1].things.append(thing)
        return groups[-1]
    groups.append(Group(things=[thing]))
    return groups[-1]


def _is_same(later: Thing, named: Thing) -> bool:
    if later.kind is Kind.VEHICLE and named.kind in {Kind.VEHICLE, Kind.CRASH}:
        return later.body in _ANY_CAR or later.body is named.body
    return later.kind is named.kind


def _goes_on(thing: Thing, group: Group) -> bool:
    """Whether a new noun tells more about the last group: its cones, its worker, its cars."""
    if thing.kind in _ROADWORKS:
        return any(named.kind in _ROADWORKS for named in group.things)
    return (
        thing.kind is Kind.VEHICLE
        and group.has(Kind.CRASH)
        and not any(named.count for named in group.things if named.is_plural)
    )
