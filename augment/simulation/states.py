"""States, boxes and objects of drives as rows of numbers.

A state is a row of `WIDTH` numbers about the rear axle: x_m, y_m, heading_rad, speed_mps,
acceleration_mps2 and steering_rad (angle of the front wheels).
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.geometry.polyline import FloatArray as FloatArray
from augment.scene.entities import AgentType, TrafficAgent
from augment.simulation import shapes
from augment.simulation.shapes import BoolArray as BoolArray

IntArray = NDArray[np.int64]

STEP_S = 0.1
X, Y, HEADING, SPEED, ACCELERATION, STEERING = range(6)
WIDTH = 6
AHEAD_RAD = math.radians(30.0)
BEHIND_RAD = math.radians(150.0)
STILL_MPS = 0.05
"""Up to this speed somebody stands, for the score and for PDM-Closed's own judgement alike."""

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
    def of(cls, ego: TrafficAgent) -> "EgoBody":
        """Return the body of a scene's ego: its own box, its axles in nuPlan's proportion."""
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

    def boxes(self, states: FloatArray) -> FloatArray:
        """Return the boxes (..., 5) of states or rear-axle poses (..., 3 or more)."""
        boxes = np.empty((*states.shape[:-1], 5))
        boxes[..., :3] = shapes.move_ahead(states, self.centre_m)
        boxes[..., 3:] = self.length_m, self.width_m
        return boxes


def start_state(ego: TrafficAgent, body: EgoBody) -> FloatArray:
    """Return the ego at t0 as a state (6,): nothing is known of its pedals and its wheel."""
    centre = np.array([ego.x_m, ego.y_m, ego.heading_rad])
    return np.concatenate([shapes.move_ahead(centre, -body.centre_m), [ego.speed_mps, 0.0, 0.0]])


class Kind(IntEnum):
    """Class of an object for planner and score."""

    VEHICLE = 0
    PEDESTRIAN = 1
    BICYCLE = 2
    STATIC = 3


_KINDS = {
    AgentType.VEHICLE: Kind.VEHICLE,
    AgentType.BUS: Kind.VEHICLE,
    AgentType.BICYCLE: Kind.BICYCLE,
    AgentType.PEDESTRIAN: Kind.PEDESTRIAN,
}
"""What can't move by itself is static."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Objects:
    """A objects, in an order that stays the same through a drive as far as they are there.

    Attributes:
        ids: (A,) as in the scene.
        kinds: (A,) values of `Kind`.
        boxes: (A, 5).
        speeds_mps: (A,) along the heading, as reported to the planner: interPlan's walkers say 0.
    """

    ids: tuple[str, ...]
    kinds: IntArray
    boxes: FloatArray
    speeds_mps: FloatArray

    def __len__(self) -> int:
        return len(self.ids)

    def chosen(self, which: BoolArray | IntArray) -> "Objects":
        """Return those that a mask or a row of indices names."""
        rows = np.flatnonzero(which) if which.dtype == np.bool_ else which
        return Objects(
            ids=tuple(self.ids[row] for row in rows),
            kinds=self.kinds[rows],
            boxes=self.boxes[rows],
            speeds_mps=self.speeds_mps[rows],
        )

    def later(self, seconds: NDArray[Any]) -> FloatArray:
        """Return the boxes (..., A, 5) after times (...), each going straight on at its speed."""
        # (..., A, 5) from (A, 5); seconds (..., 1) times speeds (A,) are ways (..., A).
        boxes = np.broadcast_to(self.boxes, (*seconds.shape, *self.boxes.shape)).copy()
        boxes[..., :3] = shapes.move_ahead(boxes, seconds[..., None] * self.speeds_mps)
        return boxes


def to_objects(agents: Sequence[TrafficAgent]) -> Objects:
    """Return agents as they stand in the scene."""
    boxes = [(a.x_m, a.y_m, a.heading_rad, a.length_m, a.width_m) for a in agents]
    kinds = [_KINDS.get(agent.type, Kind.STATIC) for agent in agents]
    return Objects(
        ids=tuple(agent.id for agent in agents),
        kinds=np.array(kinds, dtype=np.int64),
        boxes=np.array(boxes, dtype=np.float64).reshape(-1, 5),
        speeds_mps=np.array([agent.speed_mps for agent in agents], dtype=np.float64),
    )


def join_objects(parts: list[Objects]) -> Objects:
    """Return several rows of objects as one."""
    return Objects(
        ids=tuple(name for part in parts for name in part.ids),
        kinds=np.concatenate([part.kinds for part in parts]),
        boxes=np.concatenate([part.boxes for part in parts]),
        speeds_mps=np.concatenate([part.speeds_mps for part in parts]),
    )


class Contact(IntEnum):
    """Kind of contact between ego and object."""

    STOPPED_EGO = 0
    STOPPED_TRACK = 1
    REAR = 2
    FRONT = 3
    LATERAL = 4


def classify_contacts(
    states: FloatArray, boxes: FloatArray, speeds: FloatArray, kinds: IntArray, body: EgoBody
) -> IntArray:
    """Return the `Contact` of ego states (K, 6) with boxes (K, 5) of such speeds and kinds."""
    # A box without a length, at the front: what it meets is hit by the front.
    bumper = np.zeros((len(states), 5))
    bumper[:, :3] = shapes.move_ahead(states, body.front_m)
    bumper[:, 4] = body.width_m
    # Later lines overrule earlier ones: a standing ego before all, then a standing object.
    contacts = np.full(len(states), Contact.LATERAL, dtype=np.int64)
    contacts[shapes.meet(bumper, boxes)] = Contact.FRONT
    contacts[shapes.bearings(states, boxes[:, :2]) > BEHIND_RAD] = Contact.REAR
    contacts[(np.abs(speeds) <= STILL_MPS) | (kinds == Kind.STATIC)] = Contact.STOPPED_TRACK
    contacts[np.abs(states[:, SPEED]) <= STILL_MPS] = Contact.STOPPED_EGO
    return contacts


def are_at_fault(contacts: IntArray, astray: BoolArray) -> BoolArray:
    """Return which are the ego's fault; a lateral one if the ego is not on one way (`astray`)."""
    plain = (contacts == Contact.STOPPED_TRACK) | (contacts == Contact.FRONT)
    return np.asarray(plain | ((contacts == Contact.LATERAL) & astray), dtype=np.bool_)
