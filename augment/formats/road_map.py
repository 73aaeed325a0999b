"""Source's map as readers give it: segments and areas in its world frame.

Also what maps leave open: the edges and widths of lanes that have lines beside them alone, and
which segments lie in an intersection. P points of a lane.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from statistics import fmean

import numpy as np
import shapely

from augment.foreign import Doubts, FloatArray
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType

Name = int | str

NARROWEST_M, WIDEST_M, USUAL_M = 2.0, 8.0, 3.5
_MOST_NAMED = 12
NO_CONNECTIVITY = "No lane of this source has a successor."
NO_INTERSECTIONS = "No intersections in this source: no turn types, no lights."


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
    """Source's map in its world frame.

    Attributes:
        place: How faults call the part of the file.
        side: Where the lanes do not tell on which side people drive.
        is_side_told: Whether the source itself says so, whatever the lanes look like.
        side_reason: From what the side is assumed, as it ends the note on it.
        left_out: How many parts of which name have no place in a scene.
        tells_crossings: Whether the source says what lies in an intersection; else the lines do.
        doubts: About what is in it; those about shapes come when a scene is taken from it.
    """

    place: str
    segments: tuple[Segment, ...]
    areas: tuple[tuple[AreaKind, FloatArray], ...] = ()
    side: TrafficSide = TrafficSide.RIGHT
    is_side_told: bool = False
    side_reason: str = ""
    left_out: Mapping[str, int] = field(default_factory=dict)
    tells_crossings: bool = True
    doubts: Doubts = field(default_factory=Doubts)


def complete_map(city: RoadMap) -> tuple[RoadMap, list[str]]:
    """Return a map whose segments have widths and intersections, and notes on what it lacks."""
    segments = {segment.name: segment for segment in city.segments}
    city.doubts.assume(
        "Of two lanes with one id the last counts", len(city.segments) - len(segments)
    )
    if not city.tells_crossings:
        for name in crossing_segments(segments):
            segments[name] = replace(segments[name], crosses=True)
    filled, assumed = fill_widths(segments)
    total = len(filled)
    unlimited = sum(segment.speed_limit_mps is None for segment in filled)
    kinds = {kind for kind, _ in city.areas}
    lacking = {
        NO_CONNECTIVITY: not any(segment.successors or segment.predecessors for segment in filled),
        NO_INTERSECTIONS: not any(segment.crosses for segment in filled),
        "No traffic lights in this source.": all(
            segment.light is TrafficLight.UNKNOWN for segment in filled
        ),
        "No sidewalks in this source.": AreaKind.WALKWAY not in kinds,
        "No drivable areas in this source: only lanes can be driven on.": (
            AreaKind.DRIVABLE not in kinds
        ),
        f"{unlimited} of {total} lanes have no speed limit: drives assume a usual one.": (
            unlimited > 0
        ),
        f"{assumed} of {total} lanes have no boundaries on both sides: {USUAL_M:g} m wide where "
        "no neighbour tells.": assumed > 0,
    }
    notes = [note for note, holds in lacking.items() if holds]
    notes += note_left_out("parts of the map", city.left_out)
    return replace(city, segments=filled), notes


def note_left_out(what: str, counts: Mapping[str, int]) -> list[str]:
    """Return the sentence on what is left out, by name, where there is any of it."""
    names = tuple(sorted(name for name, number in counts.items() if number))
    if not names:
        return []
    return [f"{sum(counts.values())} {what} were left out: {', '.join(names[:_MOST_NAMED])}."]


# Edges and widths


def edge_distances(line: FloatArray, parts: Iterable[tuple[int, int, FloatArray]]) -> FloatArray:
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


def mean_width(line: FloatArray, left: FloatArray, right: FloatArray) -> float | None:
    """Return the mean width where both edges are known, else twice the half that is known.

    None where neither is, or where the edge lies too far away to be the lane's own.
    """
    halves = [np.hypot(*(edge - line).T) for edge in (left, right)]
    for widths in (halves[0] + halves[1], 2.0 * halves[0], 2.0 * halves[1]):
        usable = widths[np.isfinite(widths)]
        if len(usable) and NARROWEST_M <= float(np.median(usable)) <= WIDEST_M:
            return float(np.median(usable))
    return None


def fill_widths(segments: Mapping[Name, Segment]) -> tuple[tuple[Segment, ...], int]:
    """Give segments that have neither width nor boundaries one.

    In an intersection the mean width of its ends, if that is known, else a usual one.

    Returns:
        The segments, and for how many of them the width is an assumption.
    """
    ends: dict[Name, list[float]] = {name: [] for name in segments}
    for before, options in find_successors(segments).items():
        for after in options:
            for name, end in ((before, after), (after, before)):
                width_m = segments[end].width_m
                if width_m is not None:
                    ends[name].append(width_m)
    filled, assumed = [], 0
    for name, segment in segments.items():
        if segment.width_m is None and segment.left is None:
            is_known = segment.crosses and bool(ends[name])
            assumed += not is_known
            segment = replace(
                segment, width_m=round(fmean(ends[name]), 3) if is_known else USUAL_M
            )
        filled.append(segment)
    return tuple(filled), assumed


# Intersections


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Intersection segments from one lane to another; None where the map begins or ends."""

    before: Name | None
    chain: tuple[Name, ...]
    after: Name | None = None


LONGEST_WAY = 8
"""Segments of one way through an intersection; maps have one to three."""


def find_successors(segments: Mapping[Name, Segment]) -> dict[Name, list[Name]]:
    """Return the segments after each one, ascending; a joint counts if either end names it."""
    joints = {(name, after) for name, segment in segments.items() for after in segment.successors}
    joints |= {
        (before, name) for name, segment in segments.items() for before in segment.predecessors
    }
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
    lines = {
        name: shapely.LineString(segment.centerline)
        for name, segment in segments.items()
        if segment.centerline is not None and len(segment.centerline) >= 2
    }
    names = list(lines)
    following = find_successors(segments)
    preceding: dict[Name, list[Name]] = {name: [] for name in segments}
    for before, options in following.items():
        for after in options:
            preceding[after].append(before)
    forked = {name: {b for b in preceding[name] if len(following[b]) > 1} for name in segments}
    merged = {name: {a for a in following[name] if len(preceding[a]) > 1} for name in segments}
    parting = [name for name in names if forked[name] or merged[name]]
    if not parting:
        return set()
    tree = shapely.STRtree([*lines.values()])
    inside: set[Name] = set()
    for first, second in tree.query([lines[name] for name in parting], predicate="crosses").T:
        first_name, other = parting[first], names[second]
        joined = forked[first_name] & forked[other] or merged[first_name] & merged[other]
        follows = first_name in following[other] or other in following[first_name]
        if not joined and not follows:
            inside.add(first_name)
    forks = {fork for name in inside for fork in forked[name]}
    merges = {merge for name in inside for merge in merged[name]}
    return inside | {name for name in names if forked[name] & forks and merged[name] & merges}
