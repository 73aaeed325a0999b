"""PDM-Closed's emergency brake."""

from __future__ import annotations

import numpy as np

from augment.simulation.proposals import WHOLE_STEPS
from augment.simulation.states import ACCELERATION, HEADING, SPEED, STEP_S, EgoBody, FloatArray

FAULT_WITHIN_S = 2.0
AT_MOST_MPS = 5.0
_LOW_MPS = 0.2
_HARDEST, _SOFTEST = -4.05, 2.40


def must_brake(fault_s: float, speed_mps: float) -> bool:
    """Whether even the best proposal hits somebody soon, at a speed that braking can end."""
    return fault_s <= FAULT_WITHIN_S and speed_mps <= AT_MOST_MPS


def brake(ego: FloatArray, body: EgoBody) -> FloatArray:
    """Poses (T, 3) straight ahead from the ego's centre, at one commanded speed.

    The commanded speed may be negative; the tracker turns that into hard braking.
    """
    speed = float(ego[SPEED])
    if speed > _LOW_MPS:
        pull = min(max(-10.0 * speed, _HARDEST), _SOFTEST)
        commanded = 1.1 * (speed + pull)
    else:
        pull = min(max(-4.0 * speed - float(ego[ACCELERATION]), _HARDEST), _SOFTEST)
        commanded = speed + pull
    way = commanded * STEP_S * np.arange(WHOLE_STEPS + 1)
    heading = float(ego[HEADING])
    x_m, y_m = body.centre(ego)
    poses = np.empty((len(way), 3))
    poses[:, 0] = x_m + way * np.cos(heading)
    poses[:, 1] = y_m + way * np.sin(heading)
    poses[:, 2] = heading
    return poses
