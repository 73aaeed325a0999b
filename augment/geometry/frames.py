"""Rigid frames in the plane."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


def wrap(angle_rad: float) -> float:
    """The same direction in (-pi, pi]."""
    wrapped = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def difference(to_rad: float, from_rad: float) -> float:
    """The turn from one heading to another, in (-pi, pi], positive to the left."""
    return wrap(to_rad - from_rad)


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

    def beside(self, left_m: float) -> tuple[float, float]:
        """Return the point so far to the left of the pose."""
        x_m, y_m = self.to_parent(np.array([[0.0, left_m]]))[0].tolist()
        return x_m, y_m

    def turned(self, turn_rad: float) -> Pose:
        """Return the pose turned on the spot, to the left."""
        return replace(self, heading_rad=wrap(self.heading_rad + turn_rad))

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


_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A rectangle around the pose's point, its length along the pose's heading."""

    pose: Pose
    length_m: float
    width_m: float

    @property
    def area_m2(self) -> float:
        """Length times width."""
        return self.length_m * self.width_m

    @property
    def corners_m(self) -> NDArray[np.float64]:
        """The corners (4, 2): front left, rear left, rear right, front right."""
        return corners(self.pose, self.length_m, self.width_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Overlap:
    """What two boxes have in common; all zero for boxes that are apart or only touch.

    Attributes:
        depth_m: The shortest push that would part them.
        area_m2: The area of what they share.
        share_of_first, share_of_second: That area as a part of each box, 0 to 1.
    """

    depth_m: float
    area_m2: float
    share_of_first: float
    share_of_second: float


APART = Overlap(depth_m=0.0, area_m2=0.0, share_of_first=0.0, share_of_second=0.0)


def corners(pose: Pose, length_m: float, width_m: float) -> NDArray[np.float64]:
    """The corners (4, 2): front left, rear left, rear right, front right (nuPlan's order)."""
    return pose.to_parent(_CORNERS * np.array([length_m, width_m]))


def overlap(first: Box, second: Box) -> Overlap:
    """What two boxes of one frame have in common."""
    depth_m = _depth(first.corners_m, second.corners_m)
    if depth_m <= 0.0:
        return APART
    area_m2 = _area(_clipped(first.corners_m, second.corners_m))
    return Overlap(
        depth_m=depth_m,
        area_m2=area_m2,
        share_of_first=min(1.0, area_m2 / first.area_m2),
        share_of_second=min(1.0, area_m2 / second.area_m2),
    )


# Private


def _depth(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """The smallest overlap (m) of the shadows on the four side directions; <= 0 when apart."""
    sides = np.concatenate([np.diff(first[:3], axis=0), np.diff(second[:3], axis=0)])
    axes = sides / np.hypot(sides[:, 0], sides[:, 1])[:, None]
    a, b = first @ axes.T, second @ axes.T
    ends = np.minimum(a.max(axis=0) - b.min(axis=0), b.max(axis=0) - a.min(axis=0))
    return float(ends.min())


def _clipped(subject: NDArray[np.float64], window: NDArray[np.float64]) -> NDArray[np.float64]:
    """The part (P, 2) of a convex polygon inside a convex counter-clockwise window."""
    for start, end in zip(window, np.roll(window, -1, axis=0), strict=True):
        if len(subject) == 0:
            break
        direction, offset = end - start, subject - start
        left = direction[0] * offset[:, 1] - direction[1] * offset[:, 0]
        kept: list[NDArray[np.float64]] = []
        for index, point in enumerate(subject):
            following = (index + 1) % len(subject)
            if left[index] >= 0.0:
                kept.append(point)
            if left[index] * left[following] < 0.0:
                part = left[index] / (left[index] - left[following])
                kept.append(point + part * (subject[following] - point))
        subject = np.array(kept).reshape(-1, 2)
    return subject


def _area(polygon: NDArray[np.float64]) -> float:
    """The area (m2) of a counter-clockwise polygon (P, 2); about its first point, for accuracy."""
    if len(polygon) < 3:
        return 0.0
    x, y = (polygon - polygon[0]).T
    return max(0.0, 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)))
