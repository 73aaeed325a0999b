"""A vehicle as a few whole numbers: what is left of a place when it is said in brackets.

The numbers are those that LCTGen's published prompts name for an actor: a quadrant around the
ego, a bin of the distance to it, one of four directions, a bin of the speed, and what it does.
Frame: ego frame; x ahead, y to the left.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from augment.geometry.frames import difference
from augment.scene.entities import TrafficAgent

FURTHEST_M = 72.0
SPEED_BIN_MPS = 2.5
_LEFT_FROM_M = 0.005
"""What lies on the ego's own axis is on its right; half a centimetre is no side."""


class Quadrant(IntEnum):
    """Where the centre lies, seen from the ego's."""

    FRONT_LEFT = 0
    BACK_LEFT = 1
    BACK_RIGHT = 2
    FRONT_RIGHT = 3

    @property
    def is_front(self) -> bool:
        """Whether it lies ahead of the ego."""
        return self in (Quadrant.FRONT_LEFT, Quadrant.FRONT_RIGHT)


class Direction(IntEnum):
    """Which way it faces against the ego, to 45 degrees."""

    SAME = 0
    OPPOSITE = 1
    ACROSS_TO_LEFT = 2
    ACROSS_TO_RIGHT = 3


class Action(IntEnum):
    """What it does next, as far as anybody can ask for it here."""

    STOP = 0
    KEEP_SPEED = 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Code:
    """One vehicle, without a class, a size, a lateral offset or an angle.

    Attributes:
        distance_bin: Of the straight line to the ego's centre, counted from 0.
        speed_bin: In steps of 2.5 m/s, counted from 0.
    """

    quadrant: Quadrant
    distance_bin: int
    direction: Direction
    speed_bin: int
    action: Action

    @property
    def speed_mps(self) -> float:
        """The middle of its bin, 0 where it stops."""
        if self.action is Action.STOP:
            return 0.0
        return (self.speed_bin + 0.5) * SPEED_BIN_MPS

    def words(self, bin_m: float) -> str:
        """The code for people, with the edges of its bin."""
        where = self.quadrant.name.replace("_", " ").lower()
        facing = self.direction.name.replace("_", " ").lower()
        low_m = self.distance_bin * bin_m
        if self.action is Action.STOP:
            does = "stands"
        else:
            low_mps = self.speed_bin * SPEED_BIN_MPS
            does = f"drives at {low_mps:g} to {low_mps + SPEED_BIN_MPS:g} m/s"
        return f"{where}, {low_m:g} to {low_m + bin_m:g} m away, direction {facing}, {does}"


def code_of(agent: TrafficAgent, *, bin_m: float) -> Code:
    """What is left of a vehicle.

    Args:
        agent: The vehicle.
        bin_m: The width of a bin of the distance.
    """
    centre = np.array([[agent.x_m, agent.y_m]])
    return Code(
        quadrant=Quadrant(int(quadrants_of(centre)[0])),
        distance_bin=int(bins_of(centre, bin_m=bin_m)[0]),
        direction=direction_of(agent.heading_rad),
        speed_bin=int(agent.speed_mps / SPEED_BIN_MPS),
        action=Action.KEEP_SPEED if agent.speed_mps > 0.0 else Action.STOP,
    )


def quadrants_of(points_m: NDArray[np.float64]) -> NDArray[np.int64]:
    """The quadrants (P,) of points (P, 2)."""
    ahead, left = points_m[:, 0] > 0.0, points_m[:, 1] > _LEFT_FROM_M
    front = np.where(left, int(Quadrant.FRONT_LEFT), int(Quadrant.FRONT_RIGHT))
    back = np.where(left, int(Quadrant.BACK_LEFT), int(Quadrant.BACK_RIGHT))
    return np.where(ahead, front, back).astype(np.int64)


def bins_of(points_m: NDArray[np.float64], *, bin_m: float) -> NDArray[np.int64]:
    """The bins (P,) of the distances of points (P, 2); what is further than 72 m counts as 72."""
    away_m = np.minimum(np.hypot(points_m[:, 0], points_m[:, 1]), FURTHEST_M)
    return np.asarray(away_m // bin_m, dtype=np.int64)


def direction_of(heading_rad: float) -> Direction:
    """The direction of a heading against the ego's, which is 0."""
    turn_rad = difference(heading_rad, 0.0)
    if abs(turn_rad) < math.radians(45.0):
        return Direction.SAME
    if abs(turn_rad) > math.radians(135.0):
        return Direction.OPPOSITE
    return Direction.ACROSS_TO_LEFT if turn_rad > 0.0 else Direction.ACROSS_TO_RIGHT
