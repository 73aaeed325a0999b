"""A source's pieces of lane as lanes, connectors and areas in the ego frame of t0.

A segment outside intersections is a `Lane`; what follows it directly is its successor. Each way
through an intersection, from one lane to one other over one or more segments, is a
`LaneConnector` of its own, so that every connector has one beginning and one end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.errors import InvalidDocument
from augment.formats.road_map import (
    FURTHEST_M,
    MapExtract,
    Name,
    RoadMap,
    Segment,
    Way,
    following_of,
    ways_through,
)
from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import Area, Lane, LaneConnector, TrafficLight
from augment.scene.lane_graph import traffic_side_of, turn_type_of

RADIUS_M = 150.0
"""Map and agents further from the ego than this are left out."""

SPACING_M = 2.0
SAME_POINT_M = 0.05

MOST_NEAR = 2_000
"""Segments within reach; a city centre has some hundreds."""
MOST_NAMED = 10

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strip:
    """A segment in the ego frame."""

    segment: Segment
    line: Polyline
    left: Polyline | None
    right: Polyline | None
    width_m: float
    distance_m: float


def find_strips(city: RoadMap, ego: Pose) -> dict[Name, Strip]:
    """The segments within reach of the ego.

    Raises:
        InvalidDocument: A segment has no shape, or there are too many.
    """
    near, strips, problems = [], {}, []
    for segment in city.segments:
        try:
            local = _near_lines(segment, ego)
        except ValueError as fault:
            problems.append((f"{city.place}.{segment.name}", str(fault)))
            continue
        if local is not None:
            near.append((segment, local))
    check_count(city, f"segments within {RADIUS_M:g} m of the ego", len(near), MOST_NEAR)
    for segment, local in near:
        try:
            strip = _strip(segment, local)
        except ValueError as fault:
            problems.append((f"{city.place}.{segment.name}", str(fault)))
            continue
        if strip is not None:
            strips[segment.name] = strip
    if problems:
        more = len(problems) - MOST_NAMED
        rest = [(city.place, f"and {more} more")] if more > 0 else []
        raise InvalidDocument(city.what, [*problems[:MOST_NAMED], *rest])
    return strips


def find_areas(city: RoadMap, ego: Pose) -> tuple[Area, ...]:
    """The areas within reach of the ego, the nearest first.

    Raises:
        InvalidDocument: An area has no inside.
    """
    near = []
    for kind, points in city.areas:
        ring = _local(points, ego)
        if not np.isfinite(ring).all():
            raise InvalidDocument(
                city.what, [(city.place, f"has a {kind} area that is not finite")]
            )
        boundary = ring[:-1] if len(ring) > 1 and np.array_equal(ring[0], ring[-1]) else ring
        if len(np.unique(boundary, axis=0)) < 3:
            raise InvalidDocument(
                city.what, [(city.place, f"has a {kind} area without an inside")]
            )
        if _is_far(boundary):
            continue
        distance = Polyline(np.vstack([boundary, boundary[:1]])).project(0.0, 0.0).distance_m
        if distance <= RADIUS_M:
            near.append((round(distance, 3), kind, boundary.tolist()))
    return tuple(
        Area(id=f"Area{number}", kind=kind, boundary_m=tuple((x, y) for x, y in boundary))
        for number, (_, kind, boundary) in enumerate(sorted(near), start=1)
    )


def check_count(city: RoadMap, name: str, number: int, most: int) -> None:
    """Do nothing where there are at most so many.

    Raises:
        InvalidDocument: There are more.
    """
    if number > most:
        raise InvalidDocument(
            city.what, [(city.place, f"{number} {name} are too many, at most {most} are read")]
        )


def midline(left: Polyline, right: Polyline) -> Polyline:
    """The line between two boundaries, at the same parts of both."""
    number = max(2, math.ceil((left.length_m + right.length_m) / 2.0 / SPACING_M) + 1)
    part = np.linspace(0.0, 1.0, min(number, 20_000))
    on_left = left.points_at(part * left.length_m)
    on_right = right.points_at(part * right.length_m)
    return Polyline(np.round((on_left + on_right) / 2.0, 3))


def width_between(line: Polyline, left: Polyline, right: Polyline) -> float:
    """The mean width of a lane, measured across it at the points of its middle.

    Points at the same part of both boundaries lie askew where the lane begins askew.
    """
    widths = [
        left.project(x_m, y_m).distance_m + right.project(x_m, y_m).distance_m
        for x_m, y_m in line.points_m[:: max(1, len(line.points_m) // 100)].tolist()
    ]
    return round(float(np.mean(widths)), 3)


def join(lines: Sequence[Polyline]) -> Polyline:
    """One line over several that follow each other; their shared ends are kept once."""
    if len(lines) == 1:
        return lines[0]
    points = np.vstack([line.points_m for line in lines])
    apart = np.hypot(*np.diff(points, axis=0).T) > SAME_POINT_M
    apart = np.concatenate([[True], apart])
    return Polyline(points[apart] if apart.sum() > 1 else points)


# Private


def _near_lines(segment: Segment, ego: Pose) -> list[FloatArray] | None:
    """Centreline, left and right, as far as there are, from the ego; None if they lie far away.

    Raises:
        ValueError: A line has no shape.
    """
    given = [
        line for line in (segment.centerline, segment.left, segment.right) if line is not None
    ]
    local = [_local(line, ego) for line in given]
    if all(_is_far(points) for points in local):
        for points in local:
            _check_shape(points)
        return None
    return local


def _strip(segment: Segment, local: list[FloatArray]) -> Strip | None:
    """The segment of its lines in the ego frame; None if it lies far away after all.

    Raises:
        ValueError: It has no shape.
    """
    lines = [Polyline(points) for points in local]
    line = lines.pop(0) if segment.centerline is not None else midline(lines[0], lines[1])
    left, right = (lines[0], lines[1]) if len(lines) == 2 else (None, None)
    distance_m = line.project(0.0, 0.0).distance_m
    if distance_m > RADIUS_M:
        return None
    width_m = segment.width_m
    if width_m is None:
        if left is None or right is None:
            raise ValueError("has neither boundaries nor a width")
        width_m = width_between(line, left, right)
    return Strip(
        segment=segment,
        line=line,
        left=left,
        right=right,
        width_m=min(max(round(width_m, 3), 0.001), 100.0),
        distance_m=distance_m,
    )


def _local(points: ArrayLike, ego: Pose) -> FloatArray:
    """Points (P, 2) in the ego frame, to the millimetre; NaN for what lies beyond the earth."""
    points = np.asarray(points, dtype=np.float64)
    points = np.where(np.abs(points) <= FURTHEST_M, points, np.nan)
    return np.round(ego.to_local(points), 3)


def _check_shape(points: FloatArray) -> None:
    if not np.isfinite(points).all():
        raise ValueError("a line needs finite coordinates")
    if len(points) < 2 or not np.ptp(points, axis=0).any():
        raise ValueError("a line needs at least two distinct points")


def _is_far(points: FloatArray) -> bool:
    """Whether the box around the points lies away from the ego; NaN does not."""
    if len(points) == 0:
        return True
    gap = np.maximum(np.maximum(points.min(axis=0), -points.max(axis=0)), 0.0)
    return bool(np.hypot(*gap) > RADIUS_M)


MOST_WAYS = 4_000


def road_around(city: RoadMap, ego: Pose) -> MapExtract:
    """The map around the ego.

    Args:
        city: The source's map.
        ego: The ego's centre in the world frame.

    Raises:
        InvalidDocument: A part has no shape; with the place and the reason of every fault.
    """
    strips = find_strips(city, ego)
    lane_ids = _lane_ids(strips)
    following = following_of({name: strip.segment for name, strip in strips.items()})
    inside = {name for name, strip in strips.items() if strip.segment.crosses}
    ways = list(islice(ways_through(following, inside), MOST_WAYS + 1))
    check_count(city, "ways through intersections", len(ways), MOST_WAYS)
    lanes = _lanes(strips, lane_ids, following)
    side = city.side if city.is_side_told else traffic_side_of(lanes)
    areas = find_areas(city, ego)
    return MapExtract(
        traffic_side=side or city.side,
        side_is_assumed=side is None,
        lanes=lanes,
        connectors=_connectors(ways, strips, lane_ids),
        areas=areas,
        far=len(city.segments) - len(strips) + len(city.areas) - len(areas),
    )


# Private


def _lane_ids(strips: dict[Name, Strip]) -> dict[Name, str]:
    plain = [name for name, strip in strips.items() if not strip.segment.crosses]
    plain.sort(key=lambda name: (round(strips[name].distance_m, 3), name))
    return {name: f"Lane{number}" for number, name in enumerate(plain, start=1)}


def _lanes(
    strips: dict[Name, Strip], lane_ids: dict[Name, str], following: dict[Name, list[Name]]
) -> tuple[Lane, ...]:
    return tuple(
        Lane(
            id=lane_id,
            centerline=strips[name].line,
            width_m=strips[name].width_m,
            speed_limit_mps=strips[name].segment.speed_limit_mps,
            left_boundary=strips[name].left,
            right_boundary=strips[name].right,
            left_neighbor=_neighbor(strips, lane_ids, name, strips[name].segment.left_neighbors),
            right_neighbor=_neighbor(strips, lane_ids, name, strips[name].segment.right_neighbors),
            successors=tuple(lane_ids[after] for after in following[name] if after in lane_ids),
        )
        for name, lane_id in lane_ids.items()
    )


def _neighbor(
    strips: dict[Name, Strip], lane_ids: dict[Name, str], name: Name, beside: tuple[Name, ...]
) -> str | None:
    """The id of the lane beside, unless it is oncoming: some maps name such neighbours too.

    Of several, along a long lane, the one nearest to its middle.
    """
    line = strips[name].line
    middle = line.pose_at(line.length_m / 2.0)
    found = []
    for other in beside:
        if other not in lane_ids or other == name:
            continue
        place = strips[other].line.project(middle.x_m, middle.y_m)
        heading = strips[other].line.heading_at(place.s_m)
        if abs(difference(heading, middle.heading_rad)) < math.pi / 2.0:
            found.append((round(place.distance_m, 3), other))
    return lane_ids[min(found)[1]] if found else None


def _connectors(
    found: list[Way], strips: dict[Name, Strip], lane_ids: dict[Name, str]
) -> tuple[LaneConnector, ...]:
    ways = [(way, join([strips[name].line for name in way.chain])) for way in found]
    ways.sort(key=lambda item: (round(item[1].project(0.0, 0.0).distance_m, 3), item[0].key))
    return tuple(
        _connector(f"Connector{number}", way, line, strips, lane_ids)
        for number, (way, line) in enumerate(ways, start=1)
    )


def _connector(
    connector_id: str,
    way: Way,
    line: Polyline,
    strips: dict[Name, Strip],
    lane_ids: dict[Name, str],
) -> LaneConnector:
    chain = [strips[name] for name in way.chain]
    limits = [strip.segment.speed_limit_mps for strip in chain]
    return LaneConnector(
        id=connector_id,
        from_lane=None if way.before is None else lane_ids[way.before],
        to_lane=None if way.after is None else lane_ids[way.after],
        centerline=line,
        width_m=_mean_width(chain),
        traffic_light=_light(chain, None if way.before is None else strips[way.before]),
        turn_type=(chain[0].segment.turn if len(chain) == 1 else None) or turn_type_of(line),
        speed_limit_mps=max((limit for limit in limits if limit is not None), default=None),
        left_boundary=_edge([strip.left for strip in chain]),
        right_boundary=_edge([strip.right for strip in chain]),
    )


def _edge(lines: Sequence[Polyline | None]) -> Polyline | None:
    known = [line for line in lines if line is not None]
    return join(known) if len(known) == len(lines) else None


def _light(chain: Sequence[Strip], before: Strip | None) -> TrafficLight:
    """The first state that is told along the way; the lane before may tell it for all."""
    told = [strip.segment.light for strip in (*chain, *([before] if before is not None else []))]
    states = [one for one in told if one not in (TrafficLight.UNKNOWN, TrafficLight.NONE)]
    return states[0] if states else chain[0].segment.light


def _mean_width(strips: Iterable[Strip]) -> float:
    widths = [(strip.width_m, strip.line.length_m) for strip in strips]
    total = sum(length for _, length in widths)
    return round(sum(width * length for width, length in widths) / total, 3)
