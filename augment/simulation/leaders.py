"""Who is ahead on each of several parallel paths, and where everybody will be.

Nobody is expected to change speed or heading. Every object is laid beside the centreline once;
beside a path that runs so far to the left of it, it lies as much further to the right. P paths,
V policies, F slices of 0.2 s, A objects.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.path import Path
from augment.simulation.states import EgoBody, FloatArray, Kind, Objects, corners

SLICE_S = 0.2
STEPS_A_SLICE = 2
RADIUS_M = 50.0
MOST: dict[Kind, int] = {Kind.VEHICLE: 50, Kind.PEDESTRIAN: 25, Kind.BICYCLE: 10, Kind.STATIC: 50}
"""How many of each kind PDM-Closed looks at, nearest first."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forecast:
    """Objects and their boxes (F, A, 5) at 0, 0.2, 0.4 ... s from now."""

    objects: Objects
    boxes: FloatArray


def foresee(objects: Objects, horizon_s: float) -> Forecast:
    """Constant velocity along each object's heading (backwards where its speed is negative)."""
    times = np.arange(round(horizon_s / SLICE_S) + 1) * SLICE_S
    boxes = np.broadcast_to(objects.boxes, (len(times), *objects.boxes.shape)).copy()
    heading = objects.boxes[:, 2]
    boxes[..., 0] += times[:, None] * (objects.speeds_mps * np.cos(heading))
    boxes[..., 1] += times[:, None] * (objects.speeds_mps * np.sin(heading))
    return Forecast(objects=objects, boxes=boxes)


def nearest(objects: Objects, place_m: FloatArray, radius_m: float = RADIUS_M) -> Objects:
    """Those within the radius of a place (2,), of each kind as many as PDM-Closed looks at."""
    away = np.hypot(*(objects.boxes[:, :2] - place_m).T)
    kept = np.zeros(len(objects), dtype=np.bool_)
    for kind, most in MOST.items():
        rows = np.flatnonzero((objects.kinds == kind) & (away <= radius_m))
        kept[rows[np.argsort(away[rows], kind="stable")[:most]]] = True
    return objects.chosen(kept)


_BEHIND_M = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor:
    """Which road each object takes up on each path.

    Attributes:
        near_m: (F, P, A) where it begins on the path; inf where it does not meet the corridor.
        middle_m: (F, P, A) where its centre is.
        speeds_mps: (F, A) along the centreline.
    """

    near_m: FloatArray
    middle_m: FloatArray
    speeds_mps: FloatArray


class ParallelPaths:
    """The centreline and its parallels, one an offset.

    Attributes:
        offsets_m: (P,) to the left of the centreline.
    """

    def __init__(self, centreline: Path, offsets_m: FloatArray) -> None:
        self.centreline = centreline
        self.offsets_m = offsets_m
        self.paths = [centreline.offset(float(left)) for left in offsets_m]
        self._from_centre = [
            (centreline.stations_m, path.stations_m)
            if path is centreline
            else _matched(path, self)
            for path in self.paths
        ]

    def stations(self, centre_m: FloatArray) -> FloatArray:
        """Arc lengths (P, ...) on the paths, of arc lengths (...) on the centreline."""
        stations = np.empty((len(self.paths), *centre_m.shape))
        for row, (on_centre, on_path) in enumerate(self._from_centre):
            inside = np.clip(centre_m, on_centre[0], on_centre[-1])
            stations[row] = np.interp(inside, on_centre, on_path) + (centre_m - inside)
        return stations

    def poses(self, stations_m: FloatArray) -> FloatArray:
        """Poses (P, ..., 3) of arc lengths (P, ...), each row on its own path."""
        return np.stack(
            [path.poses(row) for path, row in zip(self.paths, stations_m, strict=True)]
        )

    def corridor(
        self, forecast: Forecast, ego_m: float, reach_m: float, body: EgoBody
    ) -> Corridor:
        """Who meets the corridor of half the ego's width either side, between ego and reach."""
        boxes = forecast.boxes
        slices, count = boxes.shape[:2]
        middle = self._laid(boxes[..., :2].reshape(-1, 2)).reshape(slices, count, 2)
        size = np.hypot(boxes[0, :, 3], boxes[0, :, 4]) / 2.0
        widest = float(np.abs(self.offsets_m).max()) + body.width_m / 2.0
        near = np.abs(middle[..., 1]) < widest + size
        near &= (middle[..., 0] > ego_m - _BEHIND_M) & (middle[..., 0] < ego_m + reach_m + size)
        kept = np.flatnonzero(near.any(axis=0))
        boxes, middle = boxes[:, kept], middle[:, kept]
        edges = self._laid(corners(boxes).reshape(-1, 2)).reshape(slices, len(kept), 4, 2)
        low, high = edges[..., 1].min(axis=-1), edges[..., 1].max(axis=-1)
        first = edges[..., 0].min(axis=-1)
        left = self.offsets_m[:, None] + body.width_m / 2.0
        right = self.offsets_m[:, None] - body.width_m / 2.0
        meets = (low[:, None] <= left) & (high[:, None] >= right)
        begin = np.moveaxis(self.stations(first), 0, 1)
        heading = self.centreline.poses(middle[..., 0])[..., 2]
        speeds = forecast.objects.speeds_mps[kept]
        return Corridor(
            near_m=np.where(meets, begin, np.inf),
            middle_m=np.moveaxis(self.stations(middle[..., 0]), 0, 1),
            speeds_mps=speeds * np.cos(boxes[..., 2] - heading),
        )

    def _laid(self, points_m: FloatArray) -> FloatArray:
        """Arc length and distance to the left (N, 2) of points (N, 2)."""
        return np.stack(self.centreline.beside(points_m), axis=1)


def _matched(path: Path, family: ParallelPaths) -> tuple[FloatArray, FloatArray]:
    """Arc lengths on the centreline and on a parallel that belong together."""
    on_centre, _ = family.centreline.beside(path.points_m)
    rising = np.maximum.accumulate(on_centre)
    return rising, path.stations_m
