"""The intelligent driver model: how hard to accelerate behind a leader."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from augment.simulation.states import FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Idm:
    """The driver's wishes.

    Attributes:
        min_gap_m: To a standing leader.
        headway_s: The time that the gap grows by with the speed.
        max_acceleration_mps2: On a free road from rest; also the upper clip.
        max_deceleration_mps2: Comfortable braking; also the lower clip (as a negative).
        exponent: How late a driver near the wished speed eases off.
    """

    min_gap_m: float
    headway_s: float
    max_acceleration_mps2: float
    max_deceleration_mps2: float
    exponent: float

    def acceleration(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """The law itself, m/s2, not clipped; all arrays in m and m/s and of one shape.

        `gap` is from bumper to bumper; `inf` is a free road.
        """
        root = 2.0 * math.sqrt(self.max_acceleration_mps2 * self.max_deceleration_mps2)
        moving = self.headway_s * speed + speed * (speed - leader_speed) / root
        wished = self.min_gap_m + np.maximum(moving, 0.0)
        free = (speed / np.maximum(target, 1e-9)) ** self.exponent
        return self.max_acceleration_mps2 * (1.0 - free - (wished / gap) ** 2)

    def clipped(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """The law with the gap held at the minimum gap, within the driver's two limits."""
        wished = self.acceleration(speed, target, np.maximum(gap, self.min_gap_m), leader_speed)
        low, high = -self.max_deceleration_mps2, self.max_acceleration_mps2
        return np.minimum(np.maximum(wished, low), high)


PROPOSAL_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.5,
    max_deceleration_mps2=3.0,
    exponent=10.0,
)
"""PDM-Closed's policies."""
TRAFFIC_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=2.0,
    exponent=4.0,
)
"""nuPlan's reactive traffic."""
PLANNER_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=3.0,
    exponent=4.0,
)
"""nuPlan's IDM planner."""
