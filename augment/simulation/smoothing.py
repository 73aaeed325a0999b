"""Savitzky-Golay filters as matrices, so that smoothing is one product for all proposals.

The two ends are read off the polynomial through the first and the last window, as scipy's default
mode does; an even window lies half a step off its middle.
"""

from __future__ import annotations

from functools import lru_cache
from math import factorial

import numpy as np

from augment.simulation.states import STEP_S, FloatArray


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
    window = min(window, count)
    order = min(order, window - 1)
    half = window // 2
    middle = half if window % 2 else half - 0.5
    matrix = np.zeros((count, count))
    inside = _row(window, order, derivative, middle)
    for row in range(count):
        if row < half:
            matrix[row, :window] = _row(window, order, derivative, row)
        elif row >= count - half:
            at = row - (count - window)
            matrix[row, count - window :] = _row(window, order, derivative, at)
        else:
            # An even window has its middle between two samples, half a step after this one.
            first = row - half + (0 if window % 2 else 1)
            matrix[row, first : first + window] = inside
    matrix.flags.writeable = False
    return matrix


def _row(window: int, order: int, derivative: int, at: float) -> FloatArray:
    """The weights (window,) that give a fitted polynomial's derivative at one place."""
    if derivative > order:
        return np.zeros(window)
    places = np.arange(window) - at
    powers = np.vander(places, order + 1, increasing=True)
    weights = np.linalg.pinv(powers)[derivative] * factorial(derivative)
    return np.asarray(weights / STEP_S**derivative, dtype=np.float64)
