"""What passengers feel: smoothed accelerations, jerks and turning, and their limits.

The final score and PDM's own look ahead smooth in different ways (`SCORE`, `PROPOSAL`); both ask
the same limits of every moment. Savitzky-Golay filters are kept as matrices, so that smoothing is
one product for all proposals.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    STEP_S,
    BoolArray,
    EgoBody,
    FloatArray,
    yaw_rates,
)


@lru_cache(maxsize=64)
def filter_matrix(count: int, window: int, order: int, derivative: int = 0) -> FloatArray:
    """The matrix (T, T) that smooths T samples every `STEP_S`, or gives a derivative of them.

    Short rows take a shorter window, and a lower order where it needs one.

    Args:
        count: T.
        window: Samples that one polynomial is put through.
        order: Of the polynomial.
        derivative: 0 for the value, 1 for the rate, 2 for its rate.
    """
    from scipy.signal import savgol_filter

    window = min(window, count)
    matrix = savgol_filter(
        np.eye(count), window, min(order, window - 1), deriv=derivative, delta=STEP_S, axis=0
    )
    return np.asarray(matrix, dtype=np.float64)


LIMITS: dict[str, tuple[float, float]] = {
    "longitudinal_acceleration_mps2": (-4.05, 2.40),
    "lateral_acceleration_mps2": (-4.89, 4.89),
    "longitudinal_jerk_mps3": (-4.13, 4.13),
    "jerk_mps3": (-8.37, 8.37),
    "yaw_rate_radps": (-0.95, 0.95),
    "yaw_acceleration_radps2": (-1.93, 1.93),
}
"""Lowest and highest value of each signal."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Windows:
    """How accelerations become signals, in samples; yaw takes a window of 5 either way.

    Attributes:
        acceleration: The window of the acceleration itself.
        before_jerk: A window that smooths the raw acceleration before its rate is taken,
            None to take the rate of the smoothed one.
        jerk: The window of the rate.
        at_centre: Whether accelerations are those of the box centre instead of the rear axle.
    """

    acceleration: int
    before_jerk: int | None
    jerk: int
    at_centre: bool


SCORE = Windows(acceleration=8, before_jerk=None, jerk=15, at_centre=True)
PROPOSAL = Windows(acceleration=41, before_jerk=8, jerk=41, at_centre=False)
_YAW_WINDOW = 5


def comfort_signals(
    states: FloatArray, body: EgoBody, windows: Windows = SCORE
) -> dict[str, FloatArray]:
    """The signals (..., T) named in `LIMITS`, of states (..., T, 6) every 0.1 s; T >= 2."""
    forward, sideways = _accelerations(states, body, windows.at_centre)
    count = states.shape[-2]
    smooth = filter_matrix(count, windows.acceleration, 2).T
    rate = filter_matrix(count, windows.jerk, 2, 1).T
    if windows.before_jerk is None:
        to_jerk = smooth @ rate
    else:
        to_jerk = filter_matrix(count, windows.before_jerk, 2).T @ rate
    jerk = forward @ to_jerk
    heading = np.unwrap(states[..., HEADING], axis=-1)
    return {
        "longitudinal_acceleration_mps2": forward @ smooth,
        "lateral_acceleration_mps2": sideways @ smooth,
        "longitudinal_jerk_mps3": jerk,
        "jerk_mps3": np.hypot(jerk, sideways @ to_jerk),
        "yaw_rate_radps": heading @ filter_matrix(count, _YAW_WINDOW, 2, 1).T,
        "yaw_acceleration_radps2": heading @ filter_matrix(count, _YAW_WINDOW, 3, 2).T,
    }


def is_comfortable(signals: dict[str, FloatArray]) -> BoolArray:
    """Whether each moment (..., T) is within all limits."""
    fits = [(signals[name] > low) & (signals[name] < high) for name, (low, high) in LIMITS.items()]
    return np.asarray(np.logical_and.reduce(fits), dtype=np.bool_)


# Private


def _accelerations(
    states: FloatArray, body: EgoBody, at_centre: bool
) -> tuple[FloatArray, FloatArray]:
    """Forward and sideways (..., T). The model's rear axle never accelerates sideways.

    nuPlan moves an acceleration from the axle to the centre by adding d w^2 and d w' to it, d
    being (centre_m, 0); both lie along the car, so nothing sideways comes of it. It is kept so.
    """
    forward = states[..., ACCELERATION]
    sideways = np.zeros_like(forward)
    if not at_centre:
        return forward, sideways
    turning = yaw_rates(states, body)
    change = np.diff(turning, axis=-1, prepend=turning[..., :1]) / STEP_S
    return forward + body.centre_m * (turning**2 + change), sideways
