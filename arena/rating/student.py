"""Student's t with any degrees of freedom; fewer than one count as one."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtr, stdtrit

from arena.rating.comparisons import FloatArray
from arena.rating.estimate import LEVEL


def t_above(value: ArrayLike, degrees: ArrayLike) -> FloatArray:
    """Return the probability that t is above a value that is not negative."""
    return np.asarray(stdtr(np.maximum(degrees, 1.0), -np.asarray(value)))


def t_quantile(degrees: ArrayLike, probability: float = 0.5 + LEVEL / 2.0) -> FloatArray:
    """Return what t is below with a probability above a half."""
    return np.asarray(stdtrit(np.maximum(degrees, 1.0), probability))
