"""Everybody but the ego at one moment, as arrays."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from augment.scene.entities import AgentType
from augment.simulation.states import BoolArray, FloatArray, IntArray


class Kind(IntEnum):
    """What an object is to planner and score."""

    VEHICLE = 0
    PEDESTRIAN = 1
    BICYCLE = 2
    STATIC = 3


KIND_OF: dict[AgentType, Kind] = {
    AgentType.EGO_VEHICLE: Kind.VEHICLE,
    AgentType.VEHICLE: Kind.VEHICLE,
    AgentType.BUS: Kind.VEHICLE,
    AgentType.BICYCLE: Kind.BICYCLE,
    AgentType.PEDESTRIAN: Kind.PEDESTRIAN,
    AgentType.TRAFFIC_CONE: Kind.STATIC,
    AgentType.BARRIER: Kind.STATIC,
    AgentType.CONSTRUCTION_SIGN: Kind.STATIC,
    AgentType.GENERIC_OBJECT: Kind.STATIC,
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objects:
    """A objects, in an order that stays the same through a drive as far as they are there.

    Attributes:
        ids: (A,) as in the scene.
        kinds: (A,) values of `Kind`.
        boxes: (A, 5): centre x_m, y_m, heading_rad, length_m, width_m.
        speeds_mps: (A,) along the heading, as reported to the planner: interPlan's walkers say 0.
    """

    ids: tuple[str, ...]
    kinds: IntArray
    boxes: FloatArray
    speeds_mps: FloatArray

    def __len__(self) -> int:
        return len(self.ids)

    def chosen(self, which: BoolArray | IntArray) -> Objects:
        """Those that a mask or a row of indices names."""
        rows = np.flatnonzero(which) if which.dtype == np.bool_ else which
        return Objects(
            ids=tuple(self.ids[row] for row in rows),
            kinds=self.kinds[rows],
            boxes=self.boxes[rows],
            speeds_mps=self.speeds_mps[rows],
        )


NOBODY = Objects(
    ids=(),
    kinds=np.zeros(0, dtype=np.int64),
    boxes=np.zeros((0, 5)),
    speeds_mps=np.zeros(0),
)


def join_objects(parts: list[Objects]) -> Objects:
    """Several rows of objects as one."""
    parts = [part for part in parts if len(part)]
    if not parts:
        return NOBODY
    return Objects(
        ids=tuple(name for part in parts for name in part.ids),
        kinds=np.concatenate([part.kinds for part in parts]),
        boxes=np.concatenate([part.boxes for part in parts]),
        speeds_mps=np.concatenate([part.speeds_mps for part in parts]),
    )
