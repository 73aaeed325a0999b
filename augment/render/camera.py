"""Which part of a scene a picture shows: one window for every contestant of a scenario.

Frames: metres in the ego frame (x forward, y left); pixels from the picture's top left corner
(x right, y down). The ego faces right, so what lies to its left is further up.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from augment.geometry.boxes import corners
from augment.geometry.polyline import FloatArray
from augment.scene.entities import Scene, TrafficAgent
from augment.scene.modification import Modification

WIDTH_PX = 1200
STEP_M = 5.0
MARGIN_M = 3.0
# The widest window, 5 px/m: beyond it a car is a speck, and an arrow at the edge tells more.
MAX_WIDTH_M = 240.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A window of the ego frame and its scale, the same on both axes."""

    x_min_m: float
    x_max_m: float
    y_min_m: float
    y_max_m: float
    px_per_m: float

    @property
    def width_px(self) -> int:
        """The picture's width."""
        return round((self.x_max_m - self.x_min_m) * self.px_per_m)

    @property
    def height_px(self) -> int:
        """The picture's height."""
        return round((self.y_max_m - self.y_min_m) * self.px_per_m)

    def at_width(self, width_px: int) -> Camera:
        """The same window as a picture of another width."""
        return replace(self, px_per_m=width_px / (self.x_max_m - self.x_min_m))

    def to_pixels(self, points_m: FloatArray) -> FloatArray:
        """Points (N, 2) of the ego frame as pixel coordinates (N, 2), also outside the picture."""
        points = np.asarray(points_m, dtype=np.float64)
        return np.column_stack(
            [
                (points[:, 0] - self.x_min_m) * self.px_per_m,
                (self.y_max_m - points[:, 1]) * self.px_per_m,
            ]
        )

    def shows(self, points_m: FloatArray, margin_m: float = 0.0) -> bool:
        """Whether the bounding box of points (N, 2) touches the window, widened by a margin."""
        low, high = np.min(points_m, axis=0), np.max(points_m, axis=0)
        return bool(
            high[0] >= self.x_min_m - margin_m
            and low[0] <= self.x_max_m + margin_m
            and high[1] >= self.y_min_m - margin_m
            and low[1] <= self.y_max_m + margin_m
        )


@dataclass(frozen=True, slots=True)
class _Window:
    x_min: float
    x_max: float
    y_min: float
    y_max: float


_DEFAULT = _Window(-15.0, 45.0, -20.0, 20.0)


def camera_for(scene: Scene, reference: Modification | None) -> Camera:
    """The window of a scenario: it depends on the scene and its reference, on nothing else.

    60 x 40 m at 20 px/m; where the reference does not fit, the window grows in steps of 5 m a
    side and keeps 3:2, the picture its size. Of places too far apart for the widest window the
    nearest to the ego are kept.

    Args:
        scene: The scene before the change; the old places of what the reference moves or
            removes belong into the picture as well.
        reference: The scenario's reference, None without one.
    """
    window = _DEFAULT
    if reference is not None:
        for place in sorted(_places(scene, reference), key=_distance_m):
            grown = _grown(window, place)
            if grown.x_max - grown.x_min <= MAX_WIDTH_M:
                window = grown
    return Camera(
        x_min_m=window.x_min,
        x_max_m=window.x_max,
        y_min_m=window.y_min,
        y_max_m=window.y_max,
        px_per_m=WIDTH_PX / (window.x_max - window.x_min),
    )


def _places(scene: Scene, reference: Modification) -> Iterator[FloatArray]:
    """The points (N, 2) of each place that the reference touches."""
    touched = {agent.id for agent in reference.moved} | set(reference.removed)
    for agent in scene.agents:
        if agent.id in touched:
            yield _footprint(agent)
    for agent in reference.changed:
        yield _footprint(agent)


def _footprint(agent: TrafficAgent) -> FloatArray:
    box = corners(agent.pose, agent.length_m, agent.width_m)
    return box if agent.walk_to_m is None else np.vstack([box, [agent.walk_to_m]])


def _distance_m(points_m: FloatArray) -> float:
    return float(np.hypot(points_m[:, 0], points_m[:, 1]).max())


def _grown(window: _Window, points_m: FloatArray) -> _Window:
    """The smallest 3:2 window on the 5 m raster that holds the given one and the points."""
    low, high = points_m.min(axis=0) - MARGIN_M, points_m.max(axis=0) + MARGIN_M
    x_min = min(window.x_min, math.floor(low[0] / STEP_M) * STEP_M)
    x_max = max(window.x_max, math.ceil(high[0] / STEP_M) * STEP_M)
    y_min = min(window.y_min, math.floor(low[1] / STEP_M) * STEP_M)
    y_max = max(window.y_max, math.ceil(high[1] / STEP_M) * STEP_M)
    # 15 m in width and 10 m in height are the smallest step that keeps 3:2 on the raster.
    size = max(math.ceil((x_max - x_min) / 15.0), math.ceil((y_max - y_min) / 10.0))
    x_max = x_min + 15.0 * size
    while y_max - y_min < 10.0 * size:
        if y_max <= -y_min:
            y_max += STEP_M
        else:
            y_min -= STEP_M
    return _Window(x_min, x_max, y_min, y_max)
