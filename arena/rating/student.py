"""Student's t with any degrees of freedom, without SciPy: rating starts in a tenth of a second.

Source: Abramowitz and Stegun 26.5.8 (continued fraction of the incomplete beta function), 26.7.1.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike

from arena.rating.comparisons import FloatArray
from arena.rating.estimate import LEVEL

_MOST_TERMS = 400
_LARGEST = 1e7
"""Beyond so many degrees of freedom it is the normal distribution."""
_log_gamma = np.frompyfunc(math.lgamma, 1, 1)


def t_above(value: ArrayLike, degrees: ArrayLike) -> FloatArray:
    """How likely t is above a value, which is not negative, with degrees of freedom from 1."""
    value, degrees = np.broadcast_arrays(
        np.asarray(value, dtype=np.float64),
        np.minimum(np.asarray(degrees, dtype=np.float64), _LARGEST),
    )
    below = degrees / (degrees + value**2)
    return np.asarray(0.5 * _incomplete_beta(below, 0.5 * degrees))


def t_quantile(degrees: ArrayLike, probability: float = 0.5 + LEVEL / 2.0) -> FloatArray:
    """What t is below with a probability above a half, for degrees of freedom from 1.

    Newton's method on logarithms, where the tail is nearly straight.
    """
    degrees = np.minimum(np.asarray(degrees, dtype=np.float64), _LARGEST)
    goal = math.log(1.0 - probability)
    place = np.full(degrees.shape, math.log(1.0 + (probability - 0.5) * 2.0))
    for _ in range(60):
        value = np.exp(place)
        tail = t_above(value, degrees)
        step = (np.log(tail) - goal) * tail / (value * _density(value, degrees))
        place = place + np.clip(step, -1.0, 1.0)
        if np.abs(step).max(initial=0.0) < 1e-12:
            break
    return np.asarray(np.exp(place))


def _density(value: FloatArray, degrees: FloatArray) -> FloatArray:
    scale = _log_beta_of_half(0.5 * degrees) + 0.5 * np.log(degrees)
    return np.asarray(np.exp(-scale - 0.5 * (degrees + 1.0) * np.log1p(value**2 / degrees)))


def _log_beta_of_half(one: FloatArray) -> FloatArray:
    """The logarithm of the beta function of `one` and a half."""
    sums = _log_gamma(one) - _log_gamma(one + 0.5)
    return np.asarray(sums, dtype=np.float64) + math.lgamma(0.5)


def _incomplete_beta(x: FloatArray, a: FloatArray) -> FloatArray:
    """The regularised incomplete beta function I_x(a, 1/2)."""
    x = np.clip(x, 0.0, 1.0)
    turned = x > (a + 1.0) / (a + 2.5)
    half = np.full(a.shape, 0.5)
    one, other = np.where(turned, half, a), np.where(turned, a, half)
    at = np.where(turned, 1.0 - x, x)
    with np.errstate(divide="ignore"):
        front = np.exp(one * np.log(at) + other * np.log1p(-at) - _log_beta_of_half(a)) / one
    found = front * _fraction(at, one, other)
    return np.asarray(np.where(turned, 1.0 - found, found))


def _fraction(x: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """The continued fraction, from its start on (Lentz 1976)."""
    tiny = 1e-300
    c = np.ones(x.shape)
    d = 1.0 / np.where(np.abs(found := 1.0 - (a + b) * x / (a + 1.0)) < tiny, tiny, found)
    value = d.copy()
    for m in range(1, _MOST_TERMS):
        even = m * (b - m) * x / ((a + 2 * m - 1.0) * (a + 2 * m))
        odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1.0))
        for term in (even, odd):
            d = 1.0 / np.where(np.abs(found := 1.0 + term * d) < tiny, tiny, found)
            c = np.where(np.abs(found := 1.0 + term / c) < tiny, tiny, found)
            value *= c * d
        if np.abs(c * d - 1.0).max(initial=0.0) < 1e-15:
            break
    return value
