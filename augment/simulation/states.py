"""What the ego's state is, and the body that carries it.

A state is a row of `WIDTH` numbers about the rear axle: x_m, y_m, heading_rad, speed_mps,
acceleration_mps2 and steering_rad (angle of the front wheels), in this order.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from augment.scene.entities import AgentType, TrafficAgent
from augment.simulation.road import Road

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


_SIGNS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


def corners(boxes: FloatArray) -> FloatArray:
    """Corners (..., 4, 2) of boxes (..., 5): front left, rear left, rear right, front right."""
    cos, sin = np.cos(boxes[..., 2])[..., None], np.sin(boxes[..., 2])[..., None]
    along = boxes[..., 3, None] * _SIGNS[:, 0]
    left = boxes[..., 4, None] * _SIGNS[:, 1]
    points = np.empty((*boxes.shape[:-1], 4, 2))
    points[..., 0] = boxes[..., 0, None] + along * cos - left * sin
    points[..., 1] = boxes[..., 1, None] + along * sin + left * cos
    return points


def radii(boxes: FloatArray) -> FloatArray:
    """Half the diagonal of each box, (...,)."""
    return np.asarray(0.5 * np.hypot(boxes[..., 3], boxes[..., 4]), dtype=np.float64)


def meet(first: FloatArray, second: FloatArray) -> BoolArray:
    """Which boxes (..., 5) meet their partners (..., 5), (...,)."""
    return separation(first, second) <= 0.0


def separation(first: FloatArray, second: FloatArray) -> FloatArray:
    """The widest gap (...,) that one of the four side directions shows; <= 0 where boxes meet.

    For boxes that meet it is minus the shortest push that would part them.
    """
    cos_a, sin_a = np.cos(first[..., 2]), np.sin(first[..., 2])
    cos_b, sin_b = np.cos(second[..., 2]), np.sin(second[..., 2])
    dx, dy = second[..., 0] - first[..., 0], second[..., 1] - first[..., 1]
    cos = np.abs(cos_a * cos_b + sin_a * sin_b)
    sin = np.abs(sin_a * cos_b - cos_a * sin_b)
    length_a, width_a = first[..., 3] / 2.0, first[..., 4] / 2.0
    length_b, width_b = second[..., 3] / 2.0, second[..., 4] / 2.0
    b_along, b_across = length_b * cos + width_b * sin, length_b * sin + width_b * cos
    a_along, a_across = length_a * cos + width_a * sin, length_a * sin + width_a * cos
    gap = np.abs(dx * cos_a + dy * sin_a) - length_a - b_along
    gap = np.maximum(gap, np.abs(dy * cos_a - dx * sin_a) - width_a - b_across)
    gap = np.maximum(gap, np.abs(dx * cos_b + dy * sin_b) - length_b - a_along)
    gap = np.maximum(gap, np.abs(dy * cos_b - dx * sin_b) - width_b - a_across)
    return np.asarray(gap, dtype=np.float64)


AHEAD_RAD = math.radians(30.0)
BEHIND_RAD = math.radians(150.0)
STILL_MPS = 0.05
"""Up to this speed somebody stands, for the score and for PDM-Closed's own judgement alike."""


class Contact(IntEnum):
    """How ego and object came together."""

    STOPPED_EGO = 0
    STOPPED_TRACK = 1
    REAR = 2
    FRONT = 3
    LATERAL = 4


def bearings(poses: FloatArray, places_m: FloatArray) -> FloatArray:
    """The angle (K,), 0 to pi, between the ego's heading and the way from its rear axle."""
    dx, dy = places_m[..., 0] - poses[..., X], places_m[..., 1] - poses[..., Y]
    cos, sin = np.cos(poses[..., HEADING]), np.sin(poses[..., HEADING])
    return np.abs(np.arctan2(dy * cos - dx * sin, dx * cos + dy * sin))


def classify(
    poses: FloatArray,
    ego_speeds: FloatArray,
    boxes: FloatArray,
    speeds: FloatArray,
    kinds: IntArray,
    body: EgoBody,
) -> IntArray:
    """The `Contact` of ego poses (K, 3 or more) with boxes (K, 5).

    Args:
        poses: Of the rear axle.
        ego_speeds: Of the ego.
        boxes: Of whom it touches.
        speeds: Of whom it touches.
        kinds: Values of `Kind`.
        body: The ego.
    """
    contacts = np.full(len(poses), Contact.LATERAL, dtype=np.int64)
    contacts[_bumper_meets(poses, boxes, body)] = Contact.FRONT
    contacts[bearings(poses, boxes[:, :2]) > BEHIND_RAD] = Contact.REAR
    contacts[(np.abs(speeds) <= STILL_MPS) | (kinds == Kind.STATIC)] = Contact.STOPPED_TRACK
    contacts[np.abs(ego_speeds) <= STILL_MPS] = Contact.STOPPED_EGO
    return contacts


def at_fault(contacts: IntArray, astray: BoolArray) -> BoolArray:
    """Which are the ego's fault; a lateral one if the ego is not on one way (`astray`)."""
    plain = (contacts == Contact.STOPPED_TRACK) | (contacts == Contact.FRONT)
    return np.asarray(plain | ((contacts == Contact.LATERAL) & astray), dtype=np.bool_)


def _bumper_meets(poses: FloatArray, boxes: FloatArray, body: EgoBody) -> BoolArray:
    """Whether the line of the front bumper touches the box."""
    heading = poses[:, HEADING]
    line = np.zeros((len(poses), 5))
    line[:, 0] = poses[:, X] + body.front_m * np.cos(heading)
    line[:, 1] = poses[:, Y] + body.front_m * np.sin(heading)
    line[:, 2] = heading
    line[:, 4] = body.width_m
    return np.asarray(separation(line, boxes) <= 0.0, dtype=np.bool_)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One moment, as a planner sees it.

    Attributes:
        step: Counted from 0, `STEP_S` apart.
        ego: The state (6,) of the rear axle.
        objects: Everybody who is there, wherever they are.
    """

    step: int
    ego: FloatArray
    objects: Objects


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposals:
    """What a planner considered, for people to look at; nothing depends on it.

    Attributes:
        states: (B, T, 3 or more): rear-axle poses over the planner's horizon.
        scores: (B,).
        chosen: The row that won.
    """

    states: FloatArray
    scores: FloatArray
    chosen: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """What the ego is to do.

    Attributes:
        poses: (T, 3), rear axle, every `STEP_S` from this moment on, T >= 2. The tracker reads
            a second ahead, so give it that much.
        proposals: What was considered, None if nothing is to be shown.
        braking: Whether this is an emergency brake.
    """

    poses: FloatArray
    proposals: Proposals | None = None
    braking: bool = False


@runtime_checkable
class Planner(Protocol):
    """Drives one scene; `start` comes once before the first `plan`."""

    def start(self, road: Road, body: EgoBody) -> None:
        """Get to know the map and the car; forget every drive before."""

    def plan(self, situation: Situation) -> Plan:
        """What to do from this moment on."""
