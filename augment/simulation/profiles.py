"""The speed and the curvature that lie in a row of poses, by regularised least squares.

Both fits are nuPlan's, solved for the profile itself instead of its first value and its rates:
the speed's normal matrix then holds no heading and is one constant, and the curvature's has three
diagonals. Shapes: (T, B), the moments first, because the tracker walks along them.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from augment.simulation.states import HEADING, STEP_S, FloatArray, X, Y, wrap_angles

JERK_PENALTY = 1e-4
"""On the squared difference of neighbouring accelerations."""
CURVATURE_RATE_PENALTY = 1e-2
FIRST_CURVATURE_PENALTY = 1e-10


def speeds(poses: FloatArray) -> FloatArray:
    """The speed profile (T-1, B) of poses (T, B, 3)."""
    steps = np.diff(poses[..., :2], axis=0)
    heading = poses[:-1, :, HEADING]
    advance = np.cos(heading) * steps[..., X] + np.sin(heading) * steps[..., Y]
    return np.asarray(_speed_fit(len(advance)) @ advance, dtype=np.float64)


def curvatures(poses: FloatArray, speed: FloatArray) -> FloatArray:
    """The curvature profile (T-1, B) of poses (T, B, 3), given their speeds (T-1, B)."""
    way = speed * STEP_S
    right = way * wrap_angles(np.diff(poses[..., HEADING], axis=0))
    coupling = CURVATURE_RATE_PENALTY / STEP_S**2
    diagonal = way**2 + 2.0 * coupling
    diagonal[0] += FIRST_CURVATURE_PENALTY - coupling
    diagonal[-1] -= coupling
    if len(way) == 1:
        return np.asarray(right / (way**2 + FIRST_CURVATURE_PENALTY), dtype=np.float64)
    return _solved(diagonal, -coupling, right)


# Private


@lru_cache(maxsize=16)
def _speed_fit(count: int) -> FloatArray:
    """The matrix (N, N) from advances along the heading to speeds."""
    second = np.zeros((max(count - 2, 0), count))
    for row in range(len(second)):
        second[row, row : row + 3] = np.array([1.0, -2.0, 1.0]) / STEP_S
    normal = STEP_S**2 * np.eye(count) + JERK_PENALTY * second.T @ second
    return np.asarray(np.linalg.inv(normal) * STEP_S, dtype=np.float64)


def _solved(diagonal: FloatArray, off: float, right: FloatArray) -> FloatArray:
    """Symmetric systems of three diagonals, all columns at once: (N, B) -> (N, B)."""
    upper = np.empty_like(diagonal)
    solved = np.empty_like(right)
    upper[0] = off / diagonal[0]
    solved[0] = right[0] / diagonal[0]
    for row in range(1, len(diagonal)):
        pivot = 1.0 / (diagonal[row] - off * upper[row - 1])
        upper[row] = off * pivot
        solved[row] = (right[row] - off * solved[row - 1]) * pivot
    for row in range(len(diagonal) - 2, -1, -1):
        solved[row] -= upper[row] * solved[row + 1]
    return solved
