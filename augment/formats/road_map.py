"""What readers make of a source's map, and what becomes of it: values alone."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    TrafficLight,
    TrafficSide,
    TurnType,
)
from augment.scene.recording import Note, SceneNoteKind

FloatArray = NDArray[np.float64]
Name = int | str

FURTHEST_M = 1e8
"""Nothing on earth is further from the origin of a map."""


MOST_NAMED = 12


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A piece of lane in the source's world frame, in the direction of travel.

    Attributes:
        name: Its id in the source; all of one map are of one kind.
        centerline: (P, 2); None for the middle between the boundaries.
        left, right: (P, 2), None where the source has no boundaries.
        width_m: None to measure it between the boundaries.
        crosses: Whether it lies in an intersection.
        successors, predecessors: Names; a joint counts if either end names it.
        left_neighbors, right_neighbors: Names of what lies beside it; what is oncoming is passed
            over.
        light: Of the segment itself, or of all that follows it where it lies in no intersection.
        turn: None for what the shape says.
    """

    name: Name
    crosses: bool = False
    centerline: FloatArray | None = None
    left: FloatArray | None = None
    right: FloatArray | None = None
    width_m: float | None = None
    successors: tuple[Name, ...] = ()
    predecessors: tuple[Name, ...] = ()
    left_neighbors: tuple[Name, ...] = ()
    right_neighbors: tuple[Name, ...] = ()
    speed_limit_mps: float | None = None
    light: TrafficLight = TrafficLight.UNKNOWN
    turn: TurnType | None = None


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RoadMap:
    """What a source's map holds, in its world frame.

    Attributes:
        what, place: How faults call the source and the file.
        side: Where the lanes do not tell on which side people drive.
        is_side_told: Whether the source itself says so, whatever the lanes look like.
        notes: What the map does not say.
    """

    what: str
    place: str
    segments: tuple[Segment, ...]
    areas: tuple[tuple[AreaKind, FloatArray], ...] = ()
    side: TrafficSide = TrafficSide.RIGHT
    is_side_told: bool = False
    notes: tuple[Note, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class MapExtract:
    """What a scene takes from the map; ids count from the nearest to the ego.

    Attributes:
        side_is_assumed: Whether no two oncoming lanes told the side.
        far: How many segments and areas lie too far from the ego and were left out.
    """

    traffic_side: TrafficSide
    lanes: tuple[Lane, ...]
    connectors: tuple[LaneConnector, ...]
    areas: tuple[Area, ...]
    side_is_assumed: bool = False
    far: int = 0


def limit_notes(segments: Sequence[Segment]) -> Iterator[Note]:
    """Of how many lanes the map has no speed limit."""
    unlimited = sum(segment.speed_limit_mps is None for segment in segments)
    if segments and unlimited == len(segments):
        yield Note(kind=SceneNoteKind.NO_SPEED_LIMITS)
    elif unlimited:
        kind = SceneNoteKind.SOME_SPEED_LIMITS
        yield Note(kind=kind, number=unlimited, of=len(segments))


def count_notes(counts: dict[SceneNoteKind, int]) -> Iterator[Note]:
    """A note of each kind with its number, where that is not 0."""
    return (Note(kind=kind, number=number) for kind, number in counts.items() if number)


def left_out_notes(kind: SceneNoteKind, counts: dict[str, int]) -> Iterator[Note]:
    """What is left out, by name, where there is any of it."""
    names = tuple(sorted(name for name, number in counts.items() if number))
    if names:
        yield Note(kind=kind, number=sum(counts.values()), names=names[:MOST_NAMED])


NARROWEST_M = 2.0
WIDEST_M = 8.0
USUAL_M = 3.5
MOST_CELLS = 500_000
"""Pairs of a point and a piece of line that are looked at in one go."""


def nearest_on(points: FloatArray, line: FloatArray) -> FloatArray:
    """The nearest place (P, 2) on a line (Q, 2) to each of some points (P, 2)."""
    if len(line) < 2:
        return np.full(points.shape, np.nan)
    most = max(1, MOST_CELLS // len(line))
    if len(points) > most:
        parts = [nearest_on(points[at : at + most], line) for at in range(0, len(points), most)]
        return np.vstack(parts)
    start, step = line[:-1], np.diff(line, axis=0)
    square = np.maximum((step**2).sum(axis=1), 1e-12)
    along = ((points[:, None] - start) * step).sum(axis=2) / square
    feet = start + np.clip(along, 0.0, 1.0)[:, :, None] * step
    away = np.hypot(*np.moveaxis(points[:, None] - feet, 2, 0))
    nearest: FloatArray = feet[np.arange(len(points)), away.argmin(axis=1)]
    return nearest


def edge_of(line: FloatArray, parts: Iterable[tuple[int, int, FloatArray]]) -> FloatArray:
    """Where the edge of a lane lies beside each of its points (P, 2), NaN where nothing is.

    Args:
        line: The lane's middle (P, 2).
        parts: From which of its points to which (both among them) what line is its edge.
    """
    edge = np.full(line.shape, np.nan)
    for start, end, beside in parts:
        rows = slice(max(start, 0), max(end + 1, 0))
        if len(line[rows]) and len(beside) >= 2:
            edge[rows] = nearest_on(line[rows], beside)
    return edge


def width_of(line: FloatArray, left: FloatArray, right: FloatArray) -> float | None:
    """The mean width where an edge is known on both sides, else twice the half that is known.

    None where neither is, or where the edge lies too far away to be the lane's own.
    """
    halves = [np.hypot(*(edge - line).T) for edge in (left, right)]
    whole = halves[0] + halves[1]
    for widths in (whole, 2.0 * halves[0], 2.0 * halves[1]):
        known = widths[np.isfinite(widths)]
        if len(known):
            width_m = float(np.median(known))
            if NARROWEST_M <= width_m <= WIDEST_M:
                return width_m
    return None


def whole_edge(line: FloatArray, edge: FloatArray) -> FloatArray | None:
    """An edge that is known all along and has a length, None else."""
    if not np.isfinite(edge).all() or len(edge) < 2:
        return None
    # An edge that is far away in places is another lane's: it is no boundary of this one.
    if np.hypot(*(edge - line).T).max() > WIDEST_M:
        return None
    return edge if np.hypot(*np.diff(edge, axis=0).T).sum() > 0.5 else None


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
