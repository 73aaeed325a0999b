"""Whose fault a collision is, by nuPlan's classes. All arrays (K,), one entry a contact."""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from augment.simulation.objects import Kind
from augment.simulation.overlap import separation
from augment.simulation.states import HEADING, BoolArray, EgoBody, FloatArray, IntArray, X, Y

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
    made = np.full(len(poses), Contact.LATERAL, dtype=np.int64)
    made[_bumper_meets(poses, boxes, body)] = Contact.FRONT
    made[bearings(poses, boxes[:, :2]) > BEHIND_RAD] = Contact.REAR
    made[(np.abs(speeds) <= STILL_MPS) | (kinds == Kind.STATIC)] = Contact.STOPPED_TRACK
    made[np.abs(ego_speeds) <= STILL_MPS] = Contact.STOPPED_EGO
    return made


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
