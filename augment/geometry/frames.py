"""Angles, rigid frames in the plane, and oriented boxes.

Angles are in radians, counter-clockwise from +x.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

# (4, 2) in lengths and widths: front left, rear left, rear right, front right.
_CORNERS = np.array([[0.5, 0.5], [-0.5, 0.5], [-0.5, -0.5], [0.5, -0.5]])


def wrap(angle_rad: float) -> float:
    """Return the same direction in (-pi, pi]."""
    # IEEE's remainder rounds to even and may give -pi, which is outside of the range.
    wrapped = math.remainder(angle_rad, 2.0 * math.pi)
    return math.pi if wrapped == -math.pi else wrapped


def difference(to_rad: float, from_rad: float) -> float:
    """Return the turn from one heading to another, in (-pi, pi], positive to the left."""
    return wrap(to_rad - from_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Pose:
    """A position and a heading in some frame."""

    x_m: float
    y_m: float
    heading_rad: float

    def to_local(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (N, 2) of the frame this pose is given in, seen from the pose."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        moved = np.asarray(points_m, dtype=np.float64) - np.array([self.x_m, self.y_m])
        # Points are rows: p R, where R turns a column by the heading, turns a row back by it.
        return np.asarray(moved @ np.array([[cos, -sin], [sin, cos]]), dtype=np.float64)

    def to_parent(self, points_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return points (N, 2) seen from the pose, in the frame the pose is given in."""
        cos, sin = math.cos(self.heading_rad), math.sin(self.heading_rad)
        turned = np.asarray(points_m, dtype=np.float64) @ np.array([[cos, sin], [-sin, cos]])
        return np.asarray(turned + np.array([self.x_m, self.y_m]), dtype=np.float64)

    def beside(self, left_m: float) -> tuple[float, float]:
        """Return the point so far to the left of the pose."""
        x_m, y_m = self.to_parent(np.array([[0.0, left_m]]))[0].tolist()
        return x_m, y_m

    def turn(self, turn_rad: float) -> Pose:
        """Return the pose turned on the spot, to the left."""
        return replace(self, heading_rad=wrap(self.heading_rad + turn_rad))

    def pose_to_local(self, other: Pose) -> Pose:
        """Return another pose of the same parent frame, seen from this one."""
        x_m, y_m = self.to_local(np.array([[other.x_m, other.y_m]]))[0].tolist()
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(other.heading_rad - self.heading_rad))

    def pose_to_parent(self, other: Pose) -> Pose:
        """Return a pose seen from this one, in the frame that this one is given in."""
        x_m, y_m = self.to_parent(np.array([[other.x_m, other.y_m]]))[0].tolist()
        return Pose(x_m=x_m, y_m=y_m, heading_rad=wrap(other.heading_rad + self.heading_rad))


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A rectangle around the pose's point, its length along the pose's heading."""

    pose: Pose
    length_m: float
    width_m: float

    @property
    def corners_m(self) -> NDArray[np.float64]:
        """The corners (4, 2): front left, rear left, rear right, front right."""
        return corners(self.pose, self.length_m, self.width_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Overlap:
    """Common area of two boxes; all zero for boxes that are apart or only touch.

    Attributes:
        depth_m: The shortest push that would part them.
        share: What they have in common as a part of the smaller box, 0 to 1.
    """

    depth_m: float
    share: float


APART = Overlap(depth_m=0.0, share=0.0)


def corners(pose: Pose, length_m: float, width_m: float) -> NDArray[np.float64]:
    """Return the corners (4, 2): front left, rear left, rear right, front right (as nuPlan)."""
    return pose.to_parent(_CORNERS * np.array([length_m, width_m]))


def overlap(first: Box, second: Box) -> Overlap:
    """Return the common area of two boxes of one frame.

    The depth is the smallest overlap of their shadows on the four side directions.
    """
    reach_m = math.hypot(first.length_m, first.width_m) + math.hypot(
        second.length_m, second.width_m
    )
    if math.dist((first.pose.x_m, first.pose.y_m), (second.pose.x_m, second.pose.y_m)) > reach_m:
        return APART
    one, other = first.corners_m, second.corners_m
    # (4, 2): the two side directions of each box; no other direction can part rectangles.
    sides = np.concatenate([np.diff(one[:3], axis=0), np.diff(other[:3], axis=0)])
    axes = sides / np.hypot(sides[:, 0], sides[:, 1])[:, None]
    # (4 corners, 4 axes): the shadows of the corners on the unit directions.
    a, b = one @ axes.T, other @ axes.T
    ends = np.minimum(a.max(axis=0) - b.min(axis=0), b.max(axis=0) - a.min(axis=0))
    depth_m = float(ends.min())
    if depth_m <= 0.0:
        return APART
    # Without a grid, sides that coincide but for rounding can leave nothing of what is shared.
    shared = shapely.intersection(shapely.Polygon(one), shapely.Polygon(other), grid_size=1e-9)
    smaller_m2 = min(box.length_m * box.width_m for box in (first, second))
    return Overlap(depth_m=depth_m, share=min(1.0, float(shared.area) / smaller_m2))
