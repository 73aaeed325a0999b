"""The kinematic bicycle about the rear axle, with pedals and a wheel that lag."""

from __future__ import annotations

import math

import numpy as np

from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    SPEED,
    STEERING,
    STEP_S,
    FloatArray,
    X,
    Y,
)

MAX_STEERING_RAD = math.pi / 3.0
ACCELERATION_LAG_S = 0.2
STEERING_LAG_S = 0.05
_PEDAL = STEP_S / (STEP_S + ACCELERATION_LAG_S)
_WHEEL = STEP_S / (STEP_S + STEERING_LAG_S)


def advance(
    state: FloatArray,
    acceleration_mps2: FloatArray,
    steering_rate_radps: FloatArray,
    wheelbase_m: float,
) -> FloatArray:
    """The states (6, B) one step later: the place by the old speed and the old steering.

    Args:
        state: (6, B), the numbers first.
        acceleration_mps2: The command (B,); the pedals follow with a lag of 0.2 s.
        steering_rate_radps: The command (B,); the wheel follows with a lag of 0.05 s.
        wheelbase_m: Between the axles.
    """
    following = np.empty_like(state)
    way = state[SPEED] * STEP_S
    heading, steering = state[HEADING], state[STEERING]
    following[X] = state[X] + way * np.cos(heading)
    following[Y] = state[Y] + way * np.sin(heading)
    following[HEADING] = heading + way * np.tan(steering) / wheelbase_m
    gained = state[ACCELERATION] + _PEDAL * (acceleration_mps2 - state[ACCELERATION])
    following[ACCELERATION] = gained
    following[SPEED] = state[SPEED] + gained * STEP_S
    turned = steering + (_WHEEL * STEP_S) * steering_rate_radps
    following[STEERING] = np.minimum(np.maximum(turned, -MAX_STEERING_RAD), MAX_STEERING_RAD)
    return following
