"""Which phrase belongs to which object: each noun opens a group, or goes on with one."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from augment.errors import InstructionNotUnderstood
from augment.instruction.facts import (
    Apart,
    Crashed,
    Direction,
    Distance,
    Drifts,
    Fact,
    Kept,
    Kind,
    Mention,
    Purpose,
    Thing,
)
from augment.instruction.intent import Body, Relation
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
    is_passed = False
    for fact in (fact for part in reads for fact in part.facts):
        if isinstance(fact, Mention | Purpose | Kept):
            is_passed = is_passed or (isinstance(fact, Purpose) and fact.is_passed)
            continue
        if isinstance(fact, Thing):
            current = _group_for(fact, groups)
            current.facts.append(fact)
        elif current is None:
            early.append(fact)
        else:
            current.facts.append(fact)
            if isinstance(fact, Crashed) and _hits_the_one_before(groups):
                groups[-2].things += current.things
                groups[-2].facts += current.facts
                current = groups[-2]
                groups.pop()
    if groups:
        groups[0].facts[:0] = early  # nouns are facts too: what follows one may be its alone
    if groups:
        _from_the_ego(groups[0])
    if is_passed and len(groups) == 1:
        _lies_ahead(groups[0])
    return groups


# Private


def _from_the_ego(group: Group) -> None:
    """With nothing named before, what is "further along" is further along than the ego."""
    is_alone = group.has(Kind.VEHICLE) and not group.has(Kind.CRASH)
    has_place = any(isinstance(fact, Distance | Apart) for fact in group.facts)
    drifts = [fact for fact in group.facts if isinstance(fact, Drifts)]
    if is_alone and not has_place and len(drifts) == 1 and drifts[0].relation is Relation.AHEAD:
        group.facts.remove(drifts[0])
        group.facts += [Distance(drifts[0].length), Direction(Relation.AHEAD)]


def _lies_ahead(group: Group) -> None:
    """What the ego has to pass is ahead of it, where no direction is named."""
    if not any(isinstance(fact, Direction) for fact in group.facts):
        group.facts.append(Direction(Relation.AHEAD))


def _hits_the_one_before(groups: list[Group]) -> bool:
    """Whether "another car has crashed into it" speaks of the single vehicle named before."""
    return len(groups) > 1 and all(
        [(thing.kind, thing.count) for thing in group.things] == [(Kind.VEHICLE, 1)]
        for group in groups[-2:]
    )


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
    if thing.kind is Kind.CRASH:  # "an accident 20 m ahead with two crashed cars"
        return group.has(Kind.CRASH) and all(named.count is None for named in group.things)
    if thing.kind is not Kind.VEHICLE:
        return False
    if thing.joins:
        return group.has(Kind.VEHICLE) or group.has(Kind.CRASH)
    if any(named.count for named in group.things if named.is_plural):
        return False
    has_crashed = any(isinstance(fact, Crashed) for fact in group.facts)
    return group.has(Kind.CRASH) or (has_crashed and not thing.is_plural)
