"""What readers make of a source's map: segments and areas in its world frame, and their notes.

Also what maps leave open: the edges and widths of lanes that have lines beside them alone, and
which segments lie in an intersection. P points of a lane.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType
from augment.scene.recording import Note, SceneNoteKind

FloatArray = NDArray[np.float64]
Name = int | str

FURTHEST_M = 1e8
"""Nothing on earth is further from the origin of a map."""
MOST_NAMED = 12
NARROWEST_M, WIDEST_M, USUAL_M = 2.0, 8.0, 3.5


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Segment:
    """A piece of lane in the source's world frame, in the direction of travel.

    Attributes:
        name: Its id in the source; all of one map are of one kind.
        centerline: (P, 2); None for the middle between the boundaries.
        left, right: (P, 2), None where the source has no boundaries.
        width_m: None to measure it between the boundaries, or see `fill_widths`.
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


# Notes


def map_notes(
    segments: Sequence[Segment],
    *,
    assumed: int = 0,
    there: Mapping[SceneNoteKind, bool],
    counts: Mapping[SceneNoteKind, int],
    left_out: Mapping[str, int],
) -> tuple[Note, ...]:
    """Return what a map does not say.

    Args:
        segments: Of the whole map.
        assumed: How many widths are assumed.
        there: By the note on what is not there, whether it is.
        counts: Notes on what there is so many of, where it is not 0.
        left_out: How many parts of which name have no place here.
    """
    total = len(segments)
    unlimited = sum(segment.speed_limit_mps is None for segment in segments)
    notes = []
    if total and unlimited == total:
        notes.append(Note(kind=SceneNoteKind.NO_SPEED_LIMITS))
    elif unlimited:
        notes.append(Note(kind=SceneNoteKind.SOME_SPEED_LIMITS, number=unlimited, of=total))
    if assumed:
        kind = SceneNoteKind.LANE_WIDTHS_ASSUMED
        notes.append(Note(kind=kind, number=assumed, of=total, value=USUAL_M))
    return (
        *notes,
        *(Note(kind=kind) for kind, is_there in there.items() if not is_there),
        *(Note(kind=kind, number=number) for kind, number in counts.items() if number),
        *left_out_notes(SceneNoteKind.MAP_PARTS_LEFT_OUT, left_out),
    )


def left_out_notes(kind: SceneNoteKind, counts: Mapping[str, int]) -> list[Note]:
    """Return what is left out, by name, where there is any of it."""
    names = tuple(sorted(name for name, number in counts.items() if number))
    if not names:
        return []
    return [Note(kind=kind, number=sum(counts.values()), names=names[:MOST_NAMED])]


# Edges and widths


def edge_of(line: FloatArray, parts: Iterable[tuple[int, int, FloatArray]]) -> FloatArray:
    """Return where the edge of a lane lies beside each of its points (P, 2), NaN for nowhere.

    Args:
        line: The lane's middle (P, 2).
        parts: From which of its points to which (both among them) what line is its edge.
    """
    edge = np.full(line.shape, np.nan)
    for start, end, beside in parts:
        rows = slice(max(start, 0), max(end + 1, 0))
        if len(beside) >= 2:
            along = shapely.LineString(beside)
            stations_m = shapely.line_locate_point(along, shapely.points(line[rows]))
            nearest = shapely.line_interpolate_point(along, stations_m)
            edge[rows] = shapely.get_coordinates(nearest)
    return edge


def width_of(line: FloatArray, left: FloatArray, right: FloatArray) -> float | None:
    """Return the mean width where both edges are known, else twice the half that is known.

    None where neither is, or where the edge lies too far away to be the lane's own.
    """
    halves = [np.hypot(*(edge - line).T) for edge in (left, right)]
    for widths in (halves[0] + halves[1], 2.0 * halves[0], 2.0 * halves[1]):
        known = widths[np.isfinite(widths)]
        if len(known) and NARROWEST_M <= float(np.median(known)) <= WIDEST_M:
            return float(np.median(known))
    return None


def fill_widths(segments: Iterable[Segment]) -> tuple[tuple[Segment, ...], int]:
    """Give segments that have neither width nor boundaries one.

    In an intersection the mean width of its ends, if that is known, else a usual one.

    Returns:
        The segments, and for how many of them the width is an assumption.
    """
    by_name = {one.name: one for one in segments}
    ends: dict[Name, list[float]] = {name: [] for name in by_name}
    for before, options in following_of(by_name).items():
        for after in options:
            for name, end in ((before, after), (after, before)):
                width_m = by_name[end].width_m
                if width_m is not None:
                    ends[name].append(width_m)
    made, assumed = [], 0
    for name, one in by_name.items():
        if one.width_m is None and one.left is None:
            is_known = one.crosses and bool(ends[name])
            width_m = round(fmean(ends[name]), 3) if is_known else USUAL_M
            assumed += not is_known
            one = replace(one, width_m=width_m)
        made.append(one)
    return tuple(made), assumed


# Intersections


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Intersection segments from one lane to another; None where the map begins or ends."""

    before: Name | None
    chain: tuple[Name, ...]
    after: Name | None = None


LONGEST_WAY = 8
"""Segments of one way through an intersection; maps have one to three."""


def following_of(segments: Mapping[Name, Segment]) -> dict[Name, list[Name]]:
    """Return the segments after each one, ascending; a joint counts if either end names it."""
    joints = {(name, after) for name, one in segments.items() for after in one.successors}
    joints |= {(before, name) for name, one in segments.items() for before in one.predecessors}
    inner = [joint for joint in joints if joint[0] in segments and joint[1] in segments]
    following: dict[Name, list[Name]] = {name: [] for name in segments}
    for before, after in sorted(inner):
        if before != after:
            following[before].append(after)
    return following


def ways_through(following: Mapping[Name, list[Name]], inside: set[Name]) -> Iterator[Way]:
    """Yield every way over an intersection's segments, from a lane or where the map begins."""
    entered = {after for options in following.values() for after in options}
    open_ways = [Way(before=None, chain=(name,)) for name in inside - entered]
    for before in following.keys() - inside:
        firsts = [after for after in following[before] if after in inside]
        open_ways += [Way(before=before, chain=(first,)) for first in firsts]
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
    names, lines = [], []
    for name, segment in segments.items():
        points = segment.centerline
        if points is not None and len(points) >= 2 and np.isfinite(points).all():
            names.append(name)
            lines.append(shapely.LineString(points))
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
