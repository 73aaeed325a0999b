"""The vector map of a log as lanes, connectors and areas in the ego frame of t0.

A lane segment outside intersections is a `Lane`; what follows it directly is its successor. Each
way through an intersection, from one lane to one other over one or more segments, is a
`LaneConnector` of its own, so that every connector has one beginning and one end. Bicycle lanes
are left out: no car drives there. The format has no speed limits, no lights (their state is
unknown) and no sidewalks.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.argoverse2.log import WHAT
from augment.formats.argoverse2.map_file import MapFile, MapPoint, MapSegment, read_map
from augment.geometry.angles import difference
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.directions import traffic_side_of, turn_type_of
from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    TrafficLight,
    TrafficSide,
)

RADIUS_M = 150.0
"""Map and agents further from the ego than this are left out."""

SPACING_M = 2.0
SAME_POINT_M = 0.05
LONGEST_WAY = 8
"""Segments of one way through an intersection; maps have one to three."""

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Road:
    """What a scene takes from the map; ids count from the nearest to the ego."""

    traffic_side: TrafficSide
    lanes: tuple[Lane, ...]
    connectors: tuple[LaneConnector, ...]
    areas: tuple[Area, ...]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strip:
    """A lane segment in the ego frame."""

    segment: MapSegment
    line: Polyline
    left: Polyline
    right: Polyline
    width_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Way:
    """Intersection segments from one lane to another; None where the map begins or ends."""

    before: int | None
    chain: tuple[int, ...]
    after: int | None = None

    @property
    def key(self) -> tuple[int, ...]:
        """An order among ways that lie equally near."""
        return (*self.chain, self.before or 0, self.after or 0)


def read_road(file: Path, ego: Pose) -> Road:
    """The map around the ego.

    Args:
        file: The log's `log_map_archive_*.json`.
        ego: The ego's centre in the city frame.

    Raises:
        InvalidDocument: The file is no such map; with the path and the reason of every fault.
    """
    city = read_map(file)
    strips = _near_strips(city, ego, file.name)
    lane_ids = _lane_ids(strips)
    lanes = _lanes(strips, lane_ids)
    return Road(
        # A map of one-way streets does not tell; all logs are from the United States.
        traffic_side=traffic_side_of(lanes) or TrafficSide.RIGHT,
        lanes=lanes,
        connectors=_connectors(strips, lane_ids),
        areas=_areas(city, ego, file.name),
    )


# Private: geometry


def _local(points: Sequence[MapPoint], ego: Pose) -> FloatArray:
    """Points (P, 2) in the ego frame, to the millimetre."""
    return np.round(ego.to_local(np.array([[point.x, point.y] for point in points])), 3)


def _near_strips(city: MapFile, ego: Pose, file_name: str) -> dict[int, Strip]:
    strips, problems = {}, []
    for key, segment in city.lane_segments.items():
        if segment.lane_type == "BIKE":
            continue
        try:
            strip = _strip(segment, ego)
        except ValueError as fault:
            problems.append((f"{file_name}: lane_segments.{key}", str(fault)))
            continue
        if _distance_m(strip.line) <= RADIUS_M:
            strips[segment.id] = strip
    if problems:
        raise InvalidDocument(WHAT, problems)
    return strips


def _strip(segment: MapSegment, ego: Pose) -> Strip:
    left = Polyline(_local(segment.left_lane_boundary, ego))
    right = Polyline(_local(segment.right_lane_boundary, ego))
    number = max(2, math.ceil((left.length_m + right.length_m) / 2.0 / SPACING_M) + 1)
    part = np.linspace(0.0, 1.0, number)
    on_left = left.points_at(part * left.length_m)
    on_right = right.points_at(part * right.length_m)
    line = Polyline(np.round((on_left + on_right) / 2.0, 3))
    # Across the lane: points at the same part of both boundaries lie askew where it begins askew.
    widths = [
        left.project(x_m, y_m).distance_m + right.project(x_m, y_m).distance_m
        for x_m, y_m in line.points_m.tolist()
    ]
    width_m = round(float(np.mean(widths)), 3)
    return Strip(segment=segment, line=line, left=left, right=right, width_m=width_m)


def _distance_m(line: Polyline) -> float:
    return line.project(0.0, 0.0).distance_m


def _joined(lines: Sequence[Polyline]) -> Polyline:
    """One line over several that follow each other; their shared ends are kept once."""
    points = np.vstack([line.points_m for line in lines])
    apart = np.hypot(*np.diff(points, axis=0).T) > SAME_POINT_M
    return Polyline(points[np.concatenate([[True], apart])])


# Private: ids and references


def _following(strips: dict[int, Strip]) -> dict[int, list[int]]:
    """The segments after each one, ascending; a joint counts if either end names it."""
    joints = {(name, after) for name in strips for after in strips[name].segment.successors}
    joints |= {(before, name) for name in strips for before in strips[name].segment.predecessors}
    following: dict[int, list[int]] = {name: [] for name in strips}
    for before, after in sorted(joints):
        if before in strips and after in strips:
            following[before].append(after)
    return following


def _lane_ids(strips: dict[int, Strip]) -> dict[int, str]:
    plain = [name for name, strip in strips.items() if not strip.segment.is_intersection]
    plain.sort(key=lambda name: (round(_distance_m(strips[name].line), 3), name))
    return {name: f"Lane{number}" for number, name in enumerate(plain, start=1)}


def _lanes(strips: dict[int, Strip], lane_ids: dict[int, str]) -> tuple[Lane, ...]:
    following = _following(strips)
    return tuple(
        Lane(
            id=lane_id,
            centerline=strips[name].line,
            width_m=strips[name].width_m,
            left_boundary=strips[name].left,
            right_boundary=strips[name].right,
            left_neighbor=_neighbor(strips, lane_ids, name, strips[name].segment.left_neighbor_id),
            right_neighbor=_neighbor(
                strips, lane_ids, name, strips[name].segment.right_neighbor_id
            ),
            successors=tuple(lane_ids[after] for after in following[name] if after in lane_ids),
        )
        for name, lane_id in lane_ids.items()
    )


def _neighbor(
    strips: dict[int, Strip], lane_ids: dict[int, str], name: int, beside: int | None
) -> str | None:
    """The id of the lane beside, unless it is oncoming: the map names such neighbours too."""
    if beside is None or beside not in lane_ids:
        return None
    line, other = strips[name].line, strips[beside].line
    middle = line.pose_at(line.length_m / 2.0)
    heading = other.heading_at(other.project(middle.x_m, middle.y_m).s_m)
    same = abs(difference(heading, middle.heading_rad)) < math.pi / 2.0
    return lane_ids[beside] if same else None


def _connectors(strips: dict[int, Strip], lane_ids: dict[int, str]) -> tuple[LaneConnector, ...]:
    ways = [(way, _joined([strips[name].line for name in way.chain])) for way in _ways(strips)]
    ways.sort(key=lambda item: (round(_distance_m(item[1]), 3), item[0].key))
    return tuple(
        LaneConnector(
            id=f"Connector{number}",
            from_lane=None if way.before is None else lane_ids[way.before],
            to_lane=None if way.after is None else lane_ids[way.after],
            centerline=line,
            width_m=_mean_width(strips[name] for name in way.chain),
            traffic_light=TrafficLight.UNKNOWN,
            turn_type=turn_type_of(line),
            left_boundary=_joined([strips[name].left for name in way.chain]),
            right_boundary=_joined([strips[name].right for name in way.chain]),
        )
        for number, (way, line) in enumerate(ways, start=1)
    )


def _mean_width(strips: Iterable[Strip]) -> float:
    widths = [(strip.width_m, strip.line.length_m) for strip in strips]
    total = sum(length for _, length in widths)
    return round(sum(width * length for width, length in widths) / total, 3)


def _ways(strips: dict[int, Strip]) -> Iterator[Way]:
    """Every way from a lane, or from where the map begins, over an intersection's segments."""
    following = _following(strips)
    inside = {name for name, strip in strips.items() if strip.segment.is_intersection}
    entered = {after for options in following.values() for after in options}
    open_ways = [
        Way(before=before, chain=(after,))
        for before in strips
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


def _areas(city: MapFile, ego: Pose, file_name: str) -> tuple[Area, ...]:
    rings = [
        (AreaKind.DRIVABLE, _local(area.area_boundary, ego))
        for area in city.drivable_areas.values()
    ]
    for crossing in city.pedestrian_crossings.values():
        one, other = _local(crossing.edge1, ego), _local(crossing.edge2, ego)
        same_way = float(np.dot(one[-1] - one[0], other[-1] - other[0])) > 0.0
        rings.append((AreaKind.CROSSWALK, np.vstack([one, other[::-1] if same_way else other])))
    near = []
    for kind, ring in rings:
        boundary = ring[:-1] if np.array_equal(ring[0], ring[-1]) else ring
        if len(np.unique(boundary, axis=0)) < 3:
            raise InvalidDocument(WHAT, [(file_name, f"has a {kind} area without an inside")])
        distance = _distance_m(Polyline(np.vstack([boundary, boundary[:1]])))
        if distance <= RADIUS_M:
            near.append((round(distance, 3), kind, boundary.tolist()))
    return tuple(
        Area(id=f"Area{number}", kind=kind, boundary_m=tuple((x, y) for x, y in boundary))
        for number, (_, kind, boundary) in enumerate(sorted(near), start=1)
    )
