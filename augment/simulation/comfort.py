"""Comfort of a drive; T moments every 0.1 s.

The final score and PDM-Closed's own smooth accelerations in different ways (`SCORE`, `PROPOSAL`);
both hold every moment against the same limits. Savitzky-Golay filters are kept as matrices, so
that smoothing is one product for all proposals.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    SPEED,
    STEERING,
    STEP_S,
    BoolArray,
    EgoBody,
    FloatArray,
)

LIMITS: dict[str, tuple[float, float]] = {
    "longitudinal_acceleration_mps2": (-4.05, 2.40),
    "lateral_acceleration_mps2": (-4.89, 4.89),
    "longitudinal_jerk_mps3": (-4.13, 4.13),
    "jerk_mps3": (-8.37, 8.37),
    "yaw_rate_radps": (-0.95, 0.95),
    "yaw_acceleration_radps2": (-1.93, 1.93),
}
"""Lowest and highest value of each signal."""
# Samples.
_YAW_WINDOW = 5


@lru_cache(maxsize=64)
def filter_matrix(count: int, window: int, order: int, derivative: int = 0) -> FloatArray:
    """Return the matrix (T, T) that smooths T samples every `STEP_S`, or derives them.

    Short rows take a shorter window, and a lower order where it needs one.
    """
    from scipy.signal import savgol_filter

    window = min(window, count)
    # The filter is linear: what it makes of unit vectors is its matrix, for signals as rows.
    matrix = savgol_filter(
        np.eye(count), window, min(order, window - 1), deriv=derivative, delta=STEP_S, axis=0
    )
    return np.asarray(matrix, dtype=np.float64).T


@dataclass(frozen=True, slots=True)
class Windows:
    """Filters of acceleration signals, in samples; yaw takes a window of 5 either way.

    Attributes:
        acceleration: The window of the acceleration itself.
        before_jerk: A window that smooths the raw acceleration before its rate is taken.
        jerk: The window of the rate.
        at_centre: Whether accelerations are those of the box centre instead of the rear axle.
    """

    acceleration: int
    before_jerk: int
    jerk: int
    at_centre: bool


SCORE = Windows(8, 8, 15, at_centre=True)
PROPOSAL = Windows(41, 8, 41, at_centre=False)


def comfort_signals(
    states: FloatArray, body: EgoBody, windows: Windows = SCORE
) -> dict[str, FloatArray]:
    """Return the signals (..., T) named in `LIMITS`, of states (..., T, 6) every 0.1 s; T >= 2.

    The model's rear axle never accelerates sideways. nuPlan moves an acceleration from the axle
    to the centre by adding d w^2 and d w' to it, d being (centre_m, 0); both lie along the car, so
    nothing sideways comes of it. It is kept so.
    """
    forward = states[..., ACCELERATION]
    if windows.at_centre:
        # Yaw rate w of the bicycle, (..., T); the centre's acceleration is a + d (w^2 + w').
        turning = states[..., SPEED] * np.tan(states[..., STEERING]) / body.wheelbase_m
        change = np.diff(turning, axis=-1, prepend=turning[..., :1]) / STEP_S
        forward = forward + body.centre_m * (turning**2 + change)
    count = states.shape[-2]
    rate = filter_matrix(count, windows.jerk, 2, 1)
    # Smoothed first, then derived: both filters as one matrix (T, T).
    jerk = forward @ (filter_matrix(count, windows.before_jerk, 2) @ rate)
    # A jump by 2 pi would be an infinite yaw rate.
    heading = np.unwrap(states[..., HEADING], axis=-1)
    return {
        "longitudinal_acceleration_mps2": forward @ filter_matrix(count, windows.acceleration, 2),
        "lateral_acceleration_mps2": np.zeros_like(forward),
        "longitudinal_jerk_mps3": jerk,
        "jerk_mps3": np.abs(jerk),
        "yaw_rate_radps": heading @ filter_matrix(count, _YAW_WINDOW, 2, 1),
        "yaw_acceleration_radps2": heading @ filter_matrix(count, _YAW_WINDOW, 3, 2),
    }


def is_comfortable(signals: dict[str, FloatArray]) -> BoolArray:
    """Return whether all moments (...,) are within all limits."""
    fits = [(signals[name] > low) & (signals[name] < high) for name, (low, high) in LIMITS.items()]
    return np.asarray(np.logical_and.reduce(fits).all(axis=-1), dtype=np.bool_)
