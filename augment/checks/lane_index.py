"""All lanes and connectors of a scene read at once: how a point lies beside each of them.

Frame: the scene's. W lanes, M segments of all their centrelines.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from augment.geometry.frames import difference
from augment.scene.lane_graph import AnyLane

FloatArray = NDArray[np.float64]

NEAR_M = 20.0
"""How far beside a lane a point still has anything to do with it."""
_JOINT_M = 0.5
"""Where two lanes meet in a bend, a wedge beside the joint belongs to neither; it is as long."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Beside:
    """How a point lies beside one lane.

    Attributes:
        s_m: Along the centreline, within its ends.
        d_m: To the left of the centreline (right is negative).
        beyond_m: How far past one of the ends the point lies, 0 beside the lane.
        distance_m: To the centreline.
        tangent_rad: The direction of travel there.
    """

    lane_id: str
    s_m: float
    d_m: float
    beyond_m: float
    distance_m: float
    tangent_rad: float
    width_m: float

    @property
    def covers(self) -> bool:
        """Whether the lane lies under the point."""
        return abs(self.d_m) <= self.width_m / 2.0 and self.beyond_m <= _JOINT_M

    @property
    def off_m(self) -> float:
        """From the edge of the lane to the point, 0 where the lane covers it."""
        return 0.0 if self.covers else max(0.0, self.distance_m - self.width_m / 2.0)


class LaneIndex:
    """The lanes of one scene, laid out for a search by place."""

    def __init__(self, lanes: Iterable[AnyLane]) -> None:
        self._lanes = tuple(lanes)
        lines = [lane.centerline for lane in self._lanes]
        counts = [len(line.points_m) - 1 for line in lines]
        self._bounds: list[int] = np.cumsum([0, *counts]).tolist()
        empty = np.zeros((0, 2))
        self._halves_m = np.array([lane.width_m / 2.0 for lane in self._lanes])
        self._starts = np.concatenate([empty, *(line.points_m[:-1] for line in lines)])
        steps = np.concatenate([empty, *(np.diff(line.points_m, axis=0) for line in lines)])
        self._lengths = np.hypot(steps[:, 0], steps[:, 1])
        self._directions = steps / self._lengths[:, None]
        self._stations = np.concatenate([empty[:, 0], *(line.stations_m[:-1] for line in lines)])

    def beside(self, x_m: float, y_m: float) -> tuple[Beside, ...]:
        """The point beside the lanes near it, in the order of the lanes.

        Those are all whose edge is within `NEAR_M` of the point, else the nearest one.
        """
        if not self._lanes:
            return ()
        offset = np.array([x_m, y_m]) - self._starts
        along = (offset * self._directions).sum(axis=1)
        past = along - np.clip(along, 0.0, self._lengths)
        left = self._directions[:, 0] * offset[:, 1] - self._directions[:, 1] * offset[:, 0]
        distances = np.hypot(left, past)
        edges_m = np.minimum.reduceat(distances, self._bounds[:-1]) - self._halves_m
        near = np.flatnonzero(edges_m <= max(NEAR_M, float(edges_m.min()))).tolist()
        return tuple(self._read(number, distances, along, past, left) for number in near)

    def _read(
        self,
        number: int,
        distances: FloatArray,
        along: FloatArray,
        past: FloatArray,
        left: FloatArray,
    ) -> Beside:
        """One lane; the arrays (M,) tell how the point lies beside every segment."""
        lane, start, end = self._lanes[number], *self._bounds[number : number + 2]
        index = start + int(distances[start:end].argmin())
        distance_m, past_m, left_m = (float(a[index]) for a in (distances, past, left))
        is_past_end = (past_m < 0.0 and index == start) or (past_m > 0.0 and index == end - 1)
        dx, dy = self._directions[index].tolist()
        return Beside(
            lane_id=lane.id,
            s_m=float(self._stations[index] + along[index]) - past_m,
            # On the outside of a bend the nearest place is a corner, which is past no end.
            d_m=left_m if is_past_end else math.copysign(distance_m, left_m),
            beyond_m=abs(past_m) if is_past_end else 0.0,
            distance_m=distance_m,
            tangent_rad=math.atan2(dy, dx),
            width_m=lane.width_m,
        )


def best_aligned(beside: Iterable[Beside], heading_rad: float) -> Beside | None:
    """Of the lanes under a point the one that fits the heading, of equal ones the nearest."""

    def misfit(one: Beside) -> tuple[int, float]:
        turn_deg = math.degrees(abs(difference(one.tangent_rad, heading_rad)))
        return round(turn_deg / 15.0), round(one.distance_m, 4)

    return min((one for one in beside if one.covers), key=misfit, default=None)
