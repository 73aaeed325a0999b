"""What the ego's state is, and the body that carries it.

A state is a row of `WIDTH` numbers about the rear axle: x_m, y_m, heading_rad, speed_mps,
acceleration_mps2 and steering_rad (angle of the front wheels), in this order.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.scene.entities import AgentType, TrafficAgent

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

STEP_S = 0.1
X, Y, HEADING, SPEED, ACCELERATION, STEERING = range(6)
WIDTH = 6

# nuPlan's body "pacifica"; another ego's axles lie in the same proportion of its length.
_LENGTH_M, _WHEELBASE_M, _REAR_AXLE_TO_CENTRE_M = 5.176, 3.089, 1.461


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoBody:
    """The ego's box and axles; the box's centre lies `centre_m` ahead of the rear axle."""

    length_m: float = _LENGTH_M
    width_m: float = 2.297
    wheelbase_m: float = _WHEELBASE_M
    centre_m: float = _REAR_AXLE_TO_CENTRE_M

    @classmethod
    def of(cls, ego: TrafficAgent) -> EgoBody:
        """The body of a scene's ego: its own box, its axles in nuPlan's proportion."""
        scale = ego.length_m / _LENGTH_M
        return cls(
            length_m=ego.length_m,
            width_m=ego.width_m,
            wheelbase_m=_WHEELBASE_M * scale,
            centre_m=_REAR_AXLE_TO_CENTRE_M * scale,
        )

    @property
    def front_m(self) -> float:
        """From the rear axle to the front bumper."""
        return self.centre_m + self.length_m / 2.0

    def centre(self, states: FloatArray) -> FloatArray:
        """The box centres (..., 2) of states or rear-axle poses (..., 3 or more)."""
        heading = states[..., HEADING]
        return np.stack(
            [
                states[..., X] + self.centre_m * np.cos(heading),
                states[..., Y] + self.centre_m * np.sin(heading),
            ],
            axis=-1,
        )

    def boxes(self, states: FloatArray) -> FloatArray:
        """Boxes (..., 5) of states (..., 3 or more): centre x, y, heading, length, width."""
        boxes = np.empty((*states.shape[:-1], 5))
        boxes[..., :2] = self.centre(states)
        boxes[..., 2] = states[..., HEADING]
        boxes[..., 3] = self.length_m
        boxes[..., 4] = self.width_m
        return boxes


def start_state(ego: TrafficAgent, body: EgoBody) -> FloatArray:
    """The ego of a scene at t0 as a state (6,): nothing is known of its pedals and its wheel."""
    state = np.zeros(WIDTH)
    state[X] = ego.x_m - body.centre_m * np.cos(ego.heading_rad)
    state[Y] = ego.y_m - body.centre_m * np.sin(ego.heading_rad)
    state[HEADING] = ego.heading_rad
    state[SPEED] = ego.speed_mps
    return state


def state_of(start: ArrayLike) -> FloatArray:
    """A whole state (6,) of (x, y, heading, speed), with pedals and wheel at rest."""
    given = np.asarray(start, dtype=np.float64)
    if given.shape not in ((4,), (WIDTH,)):
        raise ValueError(f"a start is (x, y, heading, speed), not of shape {given.shape}")
    return np.concatenate([given, np.zeros(WIDTH - len(given))])


def wrap_angles(angle_rad: FloatArray) -> FloatArray:
    """The same directions in [-pi, pi], whatever the shape."""
    return np.asarray(angle_rad - 2.0 * np.pi * np.round(angle_rad / (2.0 * np.pi)))


def yaw_rates(states: FloatArray, body: EgoBody) -> FloatArray:
    """The turning (...,) in rad/s that speed and steering of states (..., 6) make."""
    return np.asarray(
        states[..., SPEED] * np.tan(states[..., STEERING]) / body.wheelbase_m, dtype=np.float64
    )


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
    ids=(), kinds=np.zeros(0, dtype=np.int64), boxes=np.zeros((0, 5)), speeds_mps=np.zeros(0)
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
