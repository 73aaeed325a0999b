"""What drives are computed with: states, boxes and objects as rows of numbers.

A state is a row of `WIDTH` numbers about the rear axle: x_m, y_m, heading_rad, speed_mps,
acceleration_mps2 and steering_rad (angle of the front wheels). A box is a row of 5: centre x_m,
y_m, heading_rad, length_m, width_m. Two boxes meet unless one of their four side directions parts
them (separating axes), so touching counts as meeting.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import AgentType, TrafficAgent

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
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
_SIGNS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


@dataclass(frozen=True, slots=True, kw_only=True)
class EgoBody:
    """The ego's box and axles; the box's centre lies `centre_m` ahead of the rear axle."""

    length_m: float = _LENGTH_M
    width_m: float = 2.297
    wheelbase_m: float = _WHEELBASE_M
    centre_m: float = _REAR_AXLE_TO_CENTRE_M

    @classmethod
    def of(cls, ego: TrafficAgent) -> EgoBody:
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
        boxes[..., :3] = moved_ahead(states, self.centre_m)
        boxes[..., 3:] = self.length_m, self.width_m
        return boxes


def moved_ahead(poses: FloatArray, way_m: NDArray[Any] | float) -> FloatArray:
    """Return poses (..., 3) that lie so far (...) ahead of poses or boxes (..., 3 or more)."""
    moved = poses[..., :3].copy()
    moved[..., X] += way_m * np.cos(moved[..., HEADING])
    moved[..., Y] += way_m * np.sin(moved[..., HEADING])
    return moved


def start_state(ego: TrafficAgent, body: EgoBody) -> FloatArray:
    """Return the ego at t0 as a state (6,): nothing is known of its pedals and its wheel."""
    centre = np.array([ego.x_m, ego.y_m, ego.heading_rad])
    return np.concatenate([moved_ahead(centre, -body.centre_m), [ego.speed_mps, 0.0, 0.0]])


def wrap_angles(angle_rad: FloatArray) -> FloatArray:
    """Return the same directions in [-pi, pi], whatever the shape."""
    return np.asarray(angle_rad - 2.0 * np.pi * np.round(angle_rad / (2.0 * np.pi)))


class Kind(IntEnum):
    """What an object is to planner and score."""

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

    def chosen(self, which: BoolArray | IntArray) -> Objects:
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
        boxes = np.broadcast_to(self.boxes, (*seconds.shape, *self.boxes.shape)).copy()
        boxes[..., :3] = moved_ahead(boxes, seconds[..., None] * self.speeds_mps)
        return boxes


def objects_of(agents: Sequence[TrafficAgent]) -> Objects:
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


def corners(boxes: FloatArray) -> FloatArray:
    """Return corners (..., 4, 2) of boxes (..., 5): front left, rear left, rear right, front."""
    cos, sin = np.cos(boxes[..., 2])[..., None], np.sin(boxes[..., 2])[..., None]
    along = boxes[..., 3, None] * _SIGNS[:, 0]
    left = boxes[..., 4, None] * _SIGNS[:, 1]
    points = np.empty((*boxes.shape[:-1], 4, 2))
    points[..., 0] = boxes[..., 0, None] + along * cos - left * sin
    points[..., 1] = boxes[..., 1, None] + along * sin + left * cos
    return points


def radii(boxes: FloatArray) -> FloatArray:
    """Return half the diagonal of each box, (...,)."""
    return np.asarray(0.5 * np.hypot(boxes[..., 3], boxes[..., 4]), dtype=np.float64)


def meet(first: FloatArray, second: FloatArray) -> BoolArray:
    """Return which boxes (..., 5) meet their partners (..., 5), (...,)."""
    cos_a, sin_a = np.cos(first[..., 2]), np.sin(first[..., 2])
    cos_b, sin_b = np.cos(second[..., 2]), np.sin(second[..., 2])
    dx, dy = second[..., 0] - first[..., 0], second[..., 1] - first[..., 1]
    cos = np.abs(cos_a * cos_b + sin_a * sin_b)
    sin = np.abs(sin_a * cos_b - cos_a * sin_b)
    length_a, width_a = first[..., 3] / 2.0, first[..., 4] / 2.0
    length_b, width_b = second[..., 3] / 2.0, second[..., 4] / 2.0
    hit = np.abs(dx * cos_a + dy * sin_a) <= length_a + length_b * cos + width_b * sin
    hit &= np.abs(dy * cos_a - dx * sin_a) <= width_a + length_b * sin + width_b * cos
    hit &= np.abs(dx * cos_b + dy * sin_b) <= length_b + length_a * cos + width_a * sin
    hit &= np.abs(dy * cos_b - dx * sin_b) <= width_b + length_a * sin + width_a * cos
    return np.asarray(hit, dtype=np.bool_)


class Contact(IntEnum):
    """How ego and object came together."""

    STOPPED_EGO = 0
    STOPPED_TRACK = 1
    REAR = 2
    FRONT = 3
    LATERAL = 4


def bearings(poses: FloatArray, places_m: FloatArray) -> FloatArray:
    """Return the angles (K,), 0 to pi, between the ego's heading and the way from its axle."""
    dx, dy = places_m[..., 0] - poses[..., X], places_m[..., 1] - poses[..., Y]
    cos, sin = np.cos(poses[..., HEADING]), np.sin(poses[..., HEADING])
    return np.abs(np.arctan2(dy * cos - dx * sin, dx * cos + dy * sin))


def classify_contacts(
    states: FloatArray, boxes: FloatArray, speeds: FloatArray, kinds: IntArray, body: EgoBody
) -> IntArray:
    """Return the `Contact` of ego states (K, 6) with boxes (K, 5) of such speeds and kinds."""
    bumper = np.zeros((len(states), 5))
    bumper[:, :3] = moved_ahead(states, body.front_m)
    bumper[:, 4] = body.width_m
    contacts = np.full(len(states), Contact.LATERAL, dtype=np.int64)
    contacts[meet(bumper, boxes)] = Contact.FRONT
    contacts[bearings(states, boxes[:, :2]) > BEHIND_RAD] = Contact.REAR
    contacts[(np.abs(speeds) <= STILL_MPS) | (kinds == Kind.STATIC)] = Contact.STOPPED_TRACK
    contacts[np.abs(states[:, SPEED]) <= STILL_MPS] = Contact.STOPPED_EGO
    return contacts


def are_at_fault(contacts: IntArray, astray: BoolArray) -> BoolArray:
    """Return which are the ego's fault; a lateral one if the ego is not on one way (`astray`)."""
    plain = (contacts == Contact.STOPPED_TRACK) | (contacts == Contact.FRONT)
    return np.asarray(plain | ((contacts == Contact.LATERAL) & astray), dtype=np.bool_)
