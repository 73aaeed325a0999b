"""A source's map as lanes, connectors and areas in the ego frame of t0, those within reach.

A segment outside intersections is a `Lane`; what follows it directly is its successor. Each way
through an intersection, from one lane to one other over one or more segments, is a
`LaneConnector` of its own, so that every connector has one beginning and one end. Metres are
rounded to millimetres.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from augment.foreign import FURTHEST, FloatArray, fault_at
from augment.formats.road_map import Name, RoadMap, Segment, Way, find_successors, ways_through
from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import Area, Lane, LaneConnector, TrafficLight, TrafficSide
from augment.scene.lane_graph import classify_turn, find_traffic_side

RADIUS_M = 150.0
"""Map and agents further from the ego than this are left out, but for a reader's own reach."""
LARGEST_M = 100_000.0
"""No scene is larger."""
WIDEST_M = 100.0
"""No lane is wider."""
JITTER_M = 0.2
"""A shorter step back is an inaccuracy of the map."""
SPACING_M = 2.0
SAME_POINT_M = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class MapExtract:
    """Part of a map for a scene; ids count from the nearest to the ego.

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


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Strip:
    """A segment in the ego frame."""

    segment: Segment
    line: Polyline
    left: Polyline | None
    right: Polyline | None
    width_m: float
    distance_m: float


def road_around(city: RoadMap, ego: Pose, reach_m: float = RADIUS_M) -> MapExtract:
    """Return the map within reach of the ego's centre, which is given in the world frame.

    Parts without a shape are left out; the map's doubts count them.
    """
    strips, far = dict[Name, Strip](), 0
    for segment in city.segments:
        with city.doubts.about("lanes"), refuse_shape(f"{city.place}.{segment.name}"):
            strip = _strip(segment, ego, reach_m)
            far += strip is None
            strips |= {} if strip is None else {segment.name: strip}
    inside = {name for name, strip in strips.items() if strip.segment.crosses}
    plain = sorted(
        strips.keys() - inside, key=lambda name: (round(strips[name].distance_m, 3), name)
    )
    lane_ids = {name: f"Lane{number}" for number, name in enumerate(plain, start=1)}
    following = find_successors({name: strip.segment for name, strip in strips.items()})
    lanes = tuple(_lane(name, strips, lane_ids, following) for name in lane_ids)
    side = city.side if city.is_side_told else find_traffic_side(lanes)
    areas, far_areas = _areas(city, ego, reach_m)
    return MapExtract(
        traffic_side=side or city.side,
        side_is_assumed=side is None,
        lanes=lanes,
        connectors=_connectors(ways_through(following, inside), strips, lane_ids),
        areas=areas,
        far=far + far_areas,
    )


@contextmanager
def refuse_shape(place: str) -> Iterator[None]:
    """Raise InvalidDocument for a line of the block that has no shape."""
    try:
        yield
    except ValueError as fault:
        raise fault_at(place, str(fault)) from None


def segment_centreline(segment: Segment) -> Polyline:
    """Return a segment's centreline in its world frame, or the line between its boundaries.

    Raises:
        ValueError: It has no shape.
    """
    if segment.centerline is not None:
        return Polyline(segment.centerline)
    if segment.left is None or segment.right is None:
        raise ValueError("has neither a centreline nor boundaries")
    return midline(Polyline(segment.left), Polyline(segment.right))


def midline(left: Polyline, right: Polyline) -> Polyline:
    """Return the line between two boundaries, at the same parts of both."""
    number = max(2, math.ceil((left.length_m + right.length_m) / 2.0 / SPACING_M) + 1)
    part = np.linspace(0.0, 1.0, min(number, 20_000))
    sides = [side.points_at(part * side.length_m) for side in (left, right)]
    return Polyline(np.round((sides[0] + sides[1]) / 2.0, 3))


def width_between(line: Polyline, left: Polyline, right: Polyline) -> float:
    """Return the mean width of a lane, measured across it at the points of its middle.

    Points at the same part of both boundaries lie askew where the lane begins askew.
    """
    middle = shapely.points(line.points_m[:: max(1, len(line.points_m) // 100)])
    widths = sum(
        shapely.distance(shapely.LineString(side.points_m), middle) for side in (left, right)
    )
    return round(float(np.mean(widths)), 3)


def is_far(points: FloatArray, reach_m: float) -> bool:
    """Return whether the bounding box is further than that from the origin; False for NaN."""
    if len(points) == 0:
        return True
    gap = np.maximum(np.maximum(points.min(axis=0), -points.max(axis=0)), 0.0)
    return bool(np.hypot(*gap) > reach_m)


# Private


def _strip(segment: Segment, ego: Pose, reach_m: float) -> Strip | None:
    """The segment in the ego frame, None if it lies far away.

    Raises:
        ValueError: It has no shape.
    """
    lines = (segment.centerline, segment.left, segment.right)
    local = [None if line is None else _local(line, ego) for line in lines]
    if all(points is None or is_far(points, reach_m) for points in local):
        return None
    if any(points is not None and (np.abs(points) > LARGEST_M).any() for points in local):
        raise ValueError(f"reaches further than {LARGEST_M:g} m")
    line, left, right = (None if points is None else Polyline(points) for points in local)
    if left is None or right is None:
        left = right = None
    elif line is None:
        line = midline(left, right)
    width_m = segment.width_m
    if width_m is None and line is not None and left is not None and right is not None:
        width_m = width_between(line, left, right)
    if line is None or width_m is None:
        raise ValueError("has neither boundaries nor a width")
    if not 0.001 <= width_m <= WIDEST_M:
        raise ValueError(f"is {width_m:g} m wide")
    ahead = np.diff(line.points_m, axis=0)
    ahead = ahead[np.hypot(*ahead.T) > JITTER_M]
    steps_m = np.hypot(*ahead.T)
    if (np.sum(ahead[:-1] * ahead[1:], axis=1) < -0.9 * steps_m[:-1] * steps_m[1:]).any():
        raise ValueError("folds back on itself")
    distance_m = line.project(0.0, 0.0).distance_m
    if distance_m > reach_m:
        return None
    width_m = round(width_m, 3)
    return Strip(
        segment=segment, line=line, left=left, right=right, width_m=width_m, distance_m=distance_m
    )


def _local(points: FloatArray, ego: Pose) -> FloatArray:
    """Points (P, 2) in the ego frame, to the millimetre; NaN for what lies beyond the earth."""
    return np.round(ego.to_local(np.where(np.abs(points) <= FURTHEST, points, np.nan)), 3)


def _areas(city: RoadMap, ego: Pose, reach_m: float) -> tuple[tuple[Area, ...], int]:
    """The areas within reach of the ego, the nearest first, and how many are not."""
    near, far = [], 0
    for number, (kind, points) in enumerate(city.areas):
        with city.doubts.about("areas"), refuse_shape(f"{city.place}: {kind} {number}"):
            ring = _ring(points, ego)
            distance_m = reach_m + 1.0
            if not is_far(ring, reach_m):
                distance_m = Polyline(np.vstack([ring, ring[:1]])).project(0.0, 0.0).distance_m
            if distance_m <= reach_m:
                near.append((round(distance_m, 3), kind, ring.tolist()))
            far += distance_m > reach_m
    areas = tuple(
        Area(id=f"Area{number}", kind=kind, boundary_m=tuple((x, y) for x, y in boundary))
        for number, (_, kind, boundary) in enumerate(sorted(near), start=1)
    )
    return areas, far


def _ring(points: FloatArray, ego: Pose) -> FloatArray:
    """The outline of an area in the ego frame, its end not joined.

    Raises:
        ValueError: It has no inside, or is not finite.
    """
    ring = _local(points, ego)
    if len(ring) > 1 and np.array_equal(ring[0], ring[-1]):
        ring = ring[:-1]
    if not (np.abs(ring) <= LARGEST_M).all() or len(np.unique(ring, axis=0)) < 3:
        raise ValueError("is an area without an inside, or not finite")
    return ring


def _lane(
    name: Name,
    strips: dict[Name, Strip],
    lane_ids: dict[Name, str],
    following: dict[Name, list[Name]],
) -> Lane:
    strip = strips[name]
    middle = strip.line.pose_at(strip.line.length_m / 2.0)

    def find_neighbor(beside: Sequence[Name]) -> str | None:
        """The lane beside, along a long one the nearest to its middle; oncoming ones are none."""
        nearest = []
        for other in beside:
            if other in lane_ids and other != name:
                line = strips[other].line
                place = line.project(middle.x_m, middle.y_m)
                turn_rad = difference(line.heading_at(place.s_m), middle.heading_rad)
                if abs(turn_rad) < math.pi / 2.0:
                    nearest.append((round(place.distance_m, 3), other))
        return lane_ids[min(nearest)[1]] if nearest else None

    return Lane(
        id=lane_ids[name],
        centerline=strip.line,
        width_m=strip.width_m,
        speed_limit_mps=strip.segment.speed_limit_mps,
        left_boundary=strip.left,
        right_boundary=strip.right,
        left_neighbor=find_neighbor(strip.segment.left_neighbors),
        right_neighbor=find_neighbor(strip.segment.right_neighbors),
        successors=tuple(lane_ids[after] for after in following[name] if after in lane_ids),
    )


def _connectors(
    ways: Iterable[Way], strips: dict[Name, Strip], lane_ids: dict[Name, str]
) -> tuple[LaneConnector, ...]:
    """Connectors, the nearest first; of equally near ones in the order of their names."""
    placed = []
    for way in ways:
        line = _join_lines([strips[name].line for name in way.chain])
        ends = ["" if name is None else str(name).rjust(20) for name in (way.before, way.after)]
        placed.append((round(line.project(0.0, 0.0).distance_m, 3), way.chain, ends, way, line))
    placed.sort(key=lambda item: item[:3])
    connectors = []
    for number, (*_, way, line) in enumerate(placed, start=1):
        chain = [strips[name] for name in way.chain]
        before = None if way.before is None else strips[way.before]
        connectors.append(
            LaneConnector(
                id=f"Connector{number}",
                from_lane=None if way.before is None else lane_ids[way.before],
                to_lane=None if way.after is None else lane_ids[way.after],
                centerline=line,
                **_along(chain, before, line),
            )
        )
    return tuple(connectors)


def _along(chain: Sequence[Strip], before: Strip | None, line: Polyline) -> dict[str, Any]:
    """Return the properties shared along a way; the lane before may have its light."""
    limits = [strip.segment.speed_limit_mps for strip in chain]
    lights = [strip.segment.light for strip in (*chain, *([] if before is None else [before]))]
    shown = [light for light in lights if light not in (TrafficLight.UNKNOWN, TrafficLight.NONE)]
    dark = [light for light in lights[: len(chain)] if light is TrafficLight.UNKNOWN]
    left = [strip.left for strip in chain if strip.left is not None]
    right = [strip.right for strip in chain if strip.right is not None]
    lengths = [strip.line.length_m for strip in chain]
    return {
        "width_m": round(float(np.average([s.width_m for s in chain], weights=lengths)), 3),
        "traffic_light": (*shown, *dark, lights[0])[0],
        "turn_type": (chain[0].segment.turn if len(chain) == 1 else None) or classify_turn(line),
        "speed_limit_mps": max((limit for limit in limits if limit is not None), default=None),
        "left_boundary": _join_lines(left) if len(left) == len(chain) else None,
        "right_boundary": _join_lines(right) if len(right) == len(chain) else None,
    }


def _join_lines(lines: Sequence[Polyline]) -> Polyline:
    """One line over several that follow each other; their shared ends are kept once."""
    if len(lines) == 1:
        return lines[0]
    points = np.vstack([line.points_m for line in lines])
    apart = np.append(True, np.hypot(*np.diff(points, axis=0).T) > SAME_POINT_M)
    return Polyline(points[apart] if apart.sum() > 1 else points)
