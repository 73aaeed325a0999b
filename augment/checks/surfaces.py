"""Mapped ground as polygons: how much of a box lies outside, how far a point is from it.

The one module of the checks that knows shapely. Frame: the scene's.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import Area
from augment.scene.lane_graph import AnyLane

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

FloatArray = NDArray[np.float64]


SEAM_M = 0.3
"""A gap between two pieces of ground up to this long is a seam of the map, not an edge."""


class Surface:
    """The union of polygons, which are joined only where somebody asks.

    Args:
        pieces: Valid shapely polygons (P,); empty ones are dropped.
    """

    def __init__(self, pieces: NDArray[np.object_]) -> None:
        import shapely

        self._pieces = pieces[~shapely.is_empty(pieces)]
        self._tree = shapely.STRtree(self._pieces)

    @classmethod
    def of(cls, lanes: Iterable[AnyLane] = (), areas: Iterable[Area] = ()) -> Surface:
        """The ground of lanes and connectors and of areas.

        Lanes go by their boundaries where the map has both, else by their width. An area that
        crosses itself is taken as the ground that it encloses.
        """
        return cls(np.concatenate([strips(list(lanes)), rings(list(areas))]))

    def with_areas(self, areas: Iterable[Area]) -> Surface:
        """This ground and more areas."""
        return Surface(np.concatenate([self._pieces, rings(list(areas))]))

    @property
    def is_empty(self) -> bool:
        """Whether the map has no such ground at all."""
        return len(self._pieces) == 0

    def share_outside(self, corners_m: FloatArray) -> float:
        """The part, 0 to 1, of a box with the corners (4, 2) that lies off the surface."""
        import shapely

        box = shapely.Polygon(corners_m)
        near = self._pieces[self._tree.query(box, predicate="intersects")]
        if any(piece.covers(box) for piece in near):
            return 0.0
        left = float(shapely.difference(box, shapely.union_all(near)).area) / float(box.area)
        return min(1.0, max(0.0, left))

    def distance_m(self, x_m: float, y_m: float) -> float:
        """From the point to the surface, 0 on it; infinite where there is none."""
        import shapely

        if self.is_empty:
            return float("inf")
        _, distances = self._tree.query_nearest(
            shapely.Point(x_m, y_m), return_distance=True, all_matches=False
        )
        return float(distances[0])

    def reach_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """How far the surface goes on from a point in a direction, up to `most_m`.

        Neighbouring pieces seldom meet exactly: gaps up to `SEAM_M` are passed over. None where
        the point is not on the surface, or the surface ends nowhere within `most_m`.
        """
        reached_m = 0.0
        is_on = False
        for low_m, high_m in self._spans_m(x_m, y_m, heading_rad, most_m):
            if low_m > reached_m + SEAM_M:
                break
            is_on = is_on or high_m >= 0.0
            reached_m = max(reached_m, high_m)
        return reached_m if is_on and reached_m < most_m - SEAM_M else None

    def begins_m(self, x_m: float, y_m: float, heading_rad: float, most_m: float) -> float | None:
        """How far off a point the surface begins in a direction, 0 on it.

        None where it begins nowhere within `most_m`.
        """
        ahead = (span for span in self._spans_m(x_m, y_m, heading_rad, most_m) if span[1] > 0.0)
        first = next(ahead, None)
        return None if first is None else max(0.0, first[0])

    def _spans_m(
        self, x_m: float, y_m: float, heading_rad: float, most_m: float
    ) -> list[tuple[float, float]]:
        """From where to where each piece lies under a ray; it begins a seam behind its point."""
        import shapely

        step = np.array([math.cos(heading_rad), math.sin(heading_rad)])
        start = np.array([x_m, y_m])
        ray = shapely.LineString([start - SEAM_M * step, start + most_m * step])
        near = self._pieces[self._tree.query(ray, predicate="intersects")]
        parts = shapely.get_parts(shapely.intersection(near, ray))
        parts = parts[shapely.get_type_id(parts) == shapely.GeometryType.LINESTRING]
        spans = (((shapely.get_coordinates(part) - start) @ step).tolist() for part in parts)
        return sorted((min(span), max(span)) for span in spans)

    def distance_to_hull_m(self, x_m: float, y_m: float) -> float:
        """From the point to the smallest convex region around the whole surface, 0 inside."""
        import shapely

        return (
            float("inf") if self.is_empty else float(self._hull.distance(shapely.Point(x_m, y_m)))
        )

    @cached_property
    def _hull(self) -> BaseGeometry:
        import shapely

        points: BaseGeometry = shapely.MultiPoint(shapely.get_coordinates(self._pieces))
        return points.convex_hull


def gaps_m(boxes_m: FloatArray) -> FloatArray:
    """The gap (N, N) between every two boxes with corners (N, 4, 2); 0 where they meet."""
    import shapely

    boxes = np.asarray(shapely.polygons(boxes_m), dtype=object)
    return np.asarray(shapely.distance(boxes[:, None], boxes[None, :]), dtype=np.float64)


# Private


def strips(lanes: Sequence[AnyLane]) -> NDArray[np.object_]:
    """One polygon a lane."""
    import shapely

    outlines = [_outline(lane) for lane in lanes]
    strips = _polygons([outline for outline in outlines if outline is not None])
    made = np.full(len(lanes), None, dtype=object)
    made[[outline is not None for outline in outlines]] = strips
    # Those without an outline, and those whose outline crosses itself.
    broad = np.flatnonzero(~shapely.is_valid(made)).tolist()
    lines = [shapely.LineString(lanes[index].centerline.points_m) for index in broad]
    halves_m = [lanes[index].width_m / 2.0 for index in broad]
    made[broad] = shapely.buffer(lines, halves_m, cap_style="flat", quad_segs=4)
    return made


def _outline(lane: AnyLane) -> FloatArray | None:
    if lane.left_boundary is None or lane.right_boundary is None:
        return None
    return np.concatenate([lane.left_boundary.points_m, lane.right_boundary.points_m[::-1]])


def rings(areas: Sequence[Area]) -> NDArray[np.object_]:
    """One geometry an area."""
    import shapely

    made = _polygons([np.array(area.boundary_m, dtype=np.float64) for area in areas])
    crossing = ~shapely.is_valid(made)
    # A buffer of nothing keeps the polygons and drops the lines that mending may leave.
    made[crossing] = shapely.buffer(shapely.make_valid(made[crossing]), 0.0)
    return made


def _polygons(outlines: Sequence[FloatArray]) -> NDArray[np.object_]:
    """Polygons (N,) of outlines (P, 2), closed or not."""
    import shapely

    if not outlines:
        return np.empty(0, dtype=object)
    owners = np.repeat(np.arange(len(outlines)), [len(outline) for outline in outlines])
    rings = shapely.linearrings(np.concatenate(outlines), indices=owners)
    return np.asarray(shapely.polygons(rings), dtype=object)
