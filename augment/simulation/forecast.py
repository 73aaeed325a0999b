"""Where everybody will be if nobody changes speed or heading. F slices of 0.2 s, A objects."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from augment.simulation.objects import Kind, Objects
from augment.simulation.states import FloatArray

SLICE_S = 0.2
STEPS_A_SLICE = 2
RADIUS_M = 50.0
MOST: dict[Kind, int] = {
    Kind.VEHICLE: 50,
    Kind.PEDESTRIAN: 25,
    Kind.BICYCLE: 10,
    Kind.STATIC: 50,
}
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
