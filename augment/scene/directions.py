"""What the shape of a map says: which way a connector turns, on which side people drive.

Frame: any, as long as it is one frame.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from augment.geometry.frames import Pose, difference
from augment.geometry.polyline import Polyline
from augment.scene.entities import Lane, TrafficSide, TurnType

STRAIGHT_BELOW_RAD = math.radians(30.0)
U_TURN_ABOVE_RAD = math.radians(150.0)
ONCOMING_ABOVE_RAD = math.radians(150.0)
ONCOMING_WITHIN_M = 8.0
"""Between centrelines: two lanes side by side, or with a narrow median between."""

MOST_BESIDE = 200
"""Lanes that are looked at beside one; no road has as many."""


def turn_type_of(line: Polyline) -> TurnType:
    """How a line turns from its first point to its last, all bends summed up."""
    headings = np.arctan2(*np.diff(line.points_m, axis=0).T[::-1]).tolist()
    turn = sum(difference(after, before) for before, after in pairwise(headings))
    if abs(turn) < STRAIGHT_BELOW_RAD:
        return TurnType.STRAIGHT
    if abs(turn) > U_TURN_ABOVE_RAD:
        return TurnType.U_TURN
    return TurnType.LEFT if turn > 0.0 else TurnType.RIGHT


def traffic_side_of(lanes: Sequence[Lane]) -> TrafficSide | None:
    """The side that most lanes keep to: oncoming traffic to the left means right-hand traffic.

    Returns:
        None where no two lanes of opposite directions lie side by side, or as many speak for
        either side.
    """
    if not lanes:
        return None
    low = np.array([lane.centerline.points_m.min(axis=0) for lane in lanes]) - ONCOMING_WITHIN_M
    high = np.array([lane.centerline.points_m.max(axis=0) for lane in lanes]) + ONCOMING_WITHIN_M

    def near(middle: Pose) -> Iterator[Lane]:
        """The lanes whose surrounding rectangle comes near; of very many, the first."""
        here = np.array([middle.x_m, middle.y_m])
        found = np.flatnonzero(((low <= here) & (here <= high)).all(axis=1))
        return (lanes[place] for place in found[:MOST_BESIDE].tolist())

    balance = sum(_oncoming_side(lane, near) for lane in lanes)
    if balance == 0:
        return None
    return TrafficSide.RIGHT if balance > 0 else TrafficSide.LEFT


# Private


def _oncoming_side(lane: Lane, near: Callable[[Pose], Iterator[Lane]]) -> int:
    """1 if the nearest oncoming lane is to the left of the lane's middle, -1 right, 0 none."""
    middle = lane.centerline.pose_at(lane.centerline.length_m / 2.0)
    nearest_m, side = ONCOMING_WITHIN_M, 0
    for other in near(middle):
        place = other.centerline.project(middle.x_m, middle.y_m)
        if other is lane or place.distance_m > nearest_m:
            continue
        heading_rad = other.centerline.heading_at(place.s_m)
        if abs(difference(heading_rad, middle.heading_rad)) > ONCOMING_ABOVE_RAD:
            # The other lane runs against this one, so each sees the other on the same side.
            nearest_m, side = place.distance_m, 1 if place.d_m > 0.0 else -1
    return side
