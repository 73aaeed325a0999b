"""Oriented boxes by the thousand: corners, and which pairs meet.

A box is a row of 5: centre x_m, y_m, heading_rad, length_m, width_m. Two boxes meet unless one of
their four side directions parts them (separating axes), so touching counts as meeting.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from augment.simulation.states import HEADING, BoolArray, EgoBody, FloatArray, IntArray, Kind, X, Y

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
