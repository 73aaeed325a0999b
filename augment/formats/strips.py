"""A source's pieces of lane and areas as lines in the ego frame of t0, those within reach.

Metres are rounded to millimetres.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.errors import InvalidDocument
from augment.formats.road_map import FURTHEST_M, Name, RoadMap, Segment
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.entities import Area

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
