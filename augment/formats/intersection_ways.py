"""Intersections: which segments lie in one, how wide they are, and the ways through them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from augment.formats.road_map import FloatArray, Name, Segment

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


def crossing_segments(segments: Mapping[Name, Segment]) -> set[Name]:
    """Return the segments that lie in an intersection, for maps that do not tell.

    A segment of a fork or a merge does if its line crosses another's, unless both are of the same
    fork or merge; so does one that leads from a fork to a merge beside such a segment.
    """
    import shapely

    names = [name for name, one in segments.items() if _is_line(one.centerline)]
    lines = [shapely.LineString(segments[name].centerline) for name in names]
    following = following_of(segments)
    preceding: dict[Name, list[Name]] = {name: [] for name in segments}
    for before, options in following.items():
        for after in options:
            preceding[after].append(before)
    forked = {name: {b for b in preceding[name] if len(following[b]) > 1} for name in segments}
    merged = {name: {a for a in following[name] if len(preceding[a]) > 1} for name in segments}
    rows = [row for row, name in enumerate(names) if forked[name] or merged[name]]
    if not rows:
        return set()
    tree = shapely.STRtree(lines)
    inside: set[Name] = set()
    for first, second in tree.query([lines[row] for row in rows], predicate="crosses").T:
        one, other = names[rows[first]], names[second]
        joined = forked[one] & forked[other] or merged[one] & merged[other]
        if not joined and one not in following[other] and other not in following[one]:
            inside.add(one)
    forks = {fork for name in inside for fork in forked[name]}
    merges = {merge for name in inside for merge in merged[name]}
    beside = {name for name in names if forked[name] & forks and merged[name] & merges}
    return inside | beside


def take_end_widths(
    segments: Sequence[Segment], assumed: AbstractSet[Name]
) -> tuple[tuple[Segment, ...], int]:
    """Give intersection segments whose width was assumed the mean width of their ends.

    Args:
        segments: Of a whole map.
        assumed: Names of those whose width was assumed.

    Returns:
        The segments, and for how many of them the width is still an assumption.
    """
    by_name = {one.name: one for one in segments}
    ends: dict[Name, list[float]] = {name: [] for name in by_name}
    for before, options in following_of(by_name).items():
        for after in options:
            for name, end in ((before, after), (after, before)):
                width_m = by_name[end].width_m
                if width_m is not None and end not in assumed:
                    ends[name].append(width_m)
    taken = {name for name in assumed if by_name[name].crosses and ends[name]}
    made = tuple(
        replace(one, width_m=round(fmean(ends[one.name]), 3)) if one.name in taken else one
        for one in segments
    )
    return made, len(assumed) - len(taken)


# Private


def _is_line(points: FloatArray | None) -> bool:
    return points is not None and len(points) >= 2 and bool(np.isfinite(points).all())


def _padded(name: Name | None) -> str:
    """A text that sorts as the names do, where these are numbers."""
    return "" if name is None else str(name).rjust(20)
