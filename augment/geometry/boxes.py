"""Oriented boxes: corners and overlap."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from augment.geometry.frames import Pose

_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


def corners(pose: Pose, length_m: float, width_m: float) -> NDArray[np.float64]:
    """The corners (4, 2): front left, rear left, rear right, front right (nuPlan's order)."""
    return pose.to_parent(_CORNERS * np.array([length_m, width_m]))
