"""Rigid frames in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from augment.geometry.frames import wrap


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A position and a heading in some frame."""

    x_m: float
    y_m: float
    heading_rad: float

    def to_local(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (N, 2) of the frame this pose is given in, seen from the pose."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        moved = np.asarray(points_m, dtype=np.float64) - np.array([self.x_m, self.y_m])
        return np.asarray(moved @ np.array([[cos, -sin], [sin, cos]]), dtype=np.float64)

    def to_parent(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Points (N, 2) seen from the pose, in the frame the pose is given in."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        turned = np.asarray(points_m, dtype=np.float64) @ np.array([[cos, sin], [-sin, cos]])
        return np.asarray(turned + np.array([self.x_m, self.y_m]), dtype=np.float64)

    def pose_to_local(self, other: Pose) -> Pose:
        """Another pose of the same parent frame, seen from this one."""
        x_m, y_m = self.to_local(np.array([[other.x_m, other.y_m]]))[0]
        return Pose(
            x_m=float(x_m), y_m=float(y_m), heading_rad=wrap(other.heading_rad - self.heading_rad)
        )

    def pose_to_parent(self, other: Pose) -> Pose:
        """A pose seen from this one, in the frame this one is given in."""
        x_m, y_m = self.to_parent(np.array([[other.x_m, other.y_m]]))[0]
        return Pose(
            x_m=float(x_m), y_m=float(y_m), heading_rad=wrap(other.heading_rad + self.heading_rad)
        )
