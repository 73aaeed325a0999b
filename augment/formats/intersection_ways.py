"""The ways through intersections: which segments follow which, from one lane to one other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace

from augment.formats.road_map import Name, Segment

LONGEST_WAY = 8
"""Segments of one way through an intersection; maps have one to three."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Intersection segments from one lane to another; None where the map begins or ends."""

    before: Name | None
    chain: tuple[Name, ...]
    after: Name | None = None

    @property
    def key(self) -> tuple[tuple[Name, ...], str, str]:
        """An order among ways that lie equally near."""
        return (self.chain, _padded(self.before), _padded(self.after))


def following_of(segments: Mapping[Name, Segment]) -> dict[Name, list[Name]]:
    """The segments after each one, ascending; a joint counts if either end names it."""
    joints = {(name, after) for name in segments for after in segments[name].successors}
    joints |= {(before, name) for name in segments for before in segments[name].predecessors}
    following: dict[Name, list[Name]] = {name: [] for name in segments}
    for before, after in sorted(
        (before, after) for before, after in joints if before in segments and after in segments
    ):
        if before != after:
            following[before].append(after)
    return following


def ways_through(following: Mapping[Name, list[Name]], inside: AbstractSet[Name]) -> Iterator[Way]:
    """Every way from a lane, or from where the map begins, over an intersection's segments."""
    entered = {after for options in following.values() for after in options}
    open_ways = [
        Way(before=before, chain=(after,))
        for before in following
        if before not in inside
        for after in following[before]
        if after in inside
    ]
    open_ways += [Way(before=None, chain=(name,)) for name in inside - entered]
    while open_ways:
        way = open_ways.pop()
        options = following[way.chain[-1]]
        if not options or len(way.chain) == LONGEST_WAY:
            yield way
            continue
        for after in options:
            if after not in inside:
                yield replace(way, after=after)
            elif after not in way.chain:
                open_ways.append(replace(way, chain=(*way.chain, after)))


# Private


def _padded(name: Name | None) -> str:
    """A text that sorts as the names do, where these are numbers."""
    return "" if name is None else str(name).rjust(20)
