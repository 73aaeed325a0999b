"""Which part of a scene a picture shows: one window for every contestant of a scenario.

The window holds the ego, all that the scenario's reference touches and what any contestant
changed nearby, and lies where it shows the most of the road.

Frames: metres in the ego frame (x forward, y left); pixels from the picture's top left corner
(x right, y down). The ego faces right, so what lies to its left is further up.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from PIL import Image, ImageDraw

from augment.geometry.polyline import FloatArray
from augment.render.shapes import ribbon
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.lane_graph import AnyLane

WIDTH_PX = 1200
MARGIN_M = 5.0
# The widest window, 5 px/m: beyond it a car is a speck, and an arrow at the edge tells more.
MAX_WIDTH_M = 240.0
# How far from the ego the window follows what contestants changed.
FOLLOWED_M = 60.0
# Without a reference nothing says where a change may come: a view far ahead. A wider one shows
# more of what lies beside a street, which maps mostly leave blank.
OPEN_WIDTH_M = 48.0
_OPEN_AHEAD_M = 40.0
LEAST_WIDTH_M = 42.0
WIDTH_STEP_M = 6.0
# Of the picture, width to height: a street is long, a junction is not.
TALL, LONG = 1.5, 2.0
# A long window must be worth it: so much less of it is blank, and the scale hardly suffers.
_GAIN_SHARE = 0.05
_MOST_WIDENING = 1.2
_AHEAD_M, _BEHIND_M, _BESIDE_M = 15.0, 3.0, 3.0
# Cells of the raster on which the ground is counted, per metre.
_CELLS_PER_M = 2

LOOK = 3
"""Raised whenever pictures of old and new look must not stand side by side."""


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

    @property
    def key(self) -> str:
        """Look and window in short: two pictures that share it can stand side by side."""
        edges = (self.x_min_m, self.x_max_m, self.y_min_m, self.y_max_m, self.px_per_m)
        shown = " ".join(f"{value:.6f}" for value in edges)
        return f"{LOOK}-{hashlib.sha256(shown.encode()).hexdigest()[:8]}"

    def to_pixels(self, points_m: FloatArray) -> FloatArray:
        """Points (N, 2) of the ego frame as pixel coordinates (N, 2), also outside the picture."""
        scale = self.px_per_m
        pixels = np.asarray(points_m, dtype=np.float64) * (scale, -scale)
        pixels += (-self.x_min_m * scale, self.y_max_m * scale)
        return pixels

    def shows(self, points_m: FloatArray, margin_m: float = 0.0) -> bool:
        """Whether the bounding box of points (N, 2) touches the window, widened by a margin."""
        low, high = np.min(points_m, axis=0), np.max(points_m, axis=0)
        return bool(
            high[0] >= self.x_min_m - margin_m
            and low[0] <= self.x_max_m + margin_m
            and high[1] >= self.y_min_m - margin_m
            and low[1] <= self.y_max_m + margin_m
        )


AROUND_THE_EGO = Camera(x_min_m=-60.0, x_max_m=100.0, y_min_m=-60.0, y_max_m=60.0, px_per_m=10.0)
"""The same for every scene, and wide: on it objects are placed by hand."""


@dataclass(frozen=True, slots=True)
class _Need:
    """What a window must hold, in whole metres: low and high corner."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float

    def and_points(self, points_m: FloatArray) -> _Need:
        low = np.floor(points_m.min(axis=0) - MARGIN_M)
        high = np.ceil(points_m.max(axis=0) + MARGIN_M)
        return _Need(
            min(self.x_min, float(low[0])),
            max(self.x_max, float(high[0])),
            min(self.y_min, float(low[1])),
            max(self.y_max, float(high[1])),
        )

    def width_m(self, ratio: float, least_m: float) -> float:
        """The least width in whole steps of a window of a shape that holds it."""
        wanted = max(least_m, self.x_max - self.x_min, (self.y_max - self.y_min) * ratio)
        return math.ceil(wanted / WIDTH_STEP_M) * WIDTH_STEP_M


@dataclass(frozen=True, slots=True)
class _Window:
    x_min: float
    y_min: float
    width: float
    height: float
    blank_share: float

    def camera(self) -> Camera:
        return Camera(
            x_min_m=self.x_min,
            x_max_m=self.x_min + self.width,
            y_min_m=self.y_min,
            y_max_m=self.y_min + self.height,
            px_per_m=WIDTH_PX / self.width,
        )


@lru_cache(maxsize=16)
def camera_for(
    scene: Scene, reference: Modification | None, changes: tuple[Modification, ...] = ()
) -> Camera:
    """Return the window of a scenario, the same for all its contestants.

    The least of the windows in steps of 6 m that holds the ego, 15 m ahead of it and with 5 m
    around it all that the reference touches, and all that contestants touch within 60 m of the
    ego; of those on a raster of 1 m the one that shows most of the ground. 3:2, or 2:1 where
    that leaves less blank. Of places too far apart for the widest window the nearest to the ego
    are kept.

    Args:
        scene: The scene before the change; the old places of what is moved or removed belong
            into the picture as well.
        reference: The scenario's reference, None without one.
        changes: What the scenario's contestants made of it.
    """
    half_m = scene.ego.length_m / 2.0
    ahead_m = _OPEN_AHEAD_M if reference is None else _AHEAD_M
    need = _Need(-math.ceil(half_m + _BEHIND_M), ahead_m, -_BESIDE_M, _BESIDE_M)
    least_m = OPEN_WIDTH_M if reference is None else LEAST_WIDTH_M
    places = [*_places(scene, reference or Modification())]
    for change in changes:
        places += [one for one in _places(scene, change) if _distance_m(one) <= FOLLOWED_M]
    for place in sorted(places, key=_distance_m):
        more = need.and_points(place)
        if more.width_m(TALL, least_m) <= MAX_WIDTH_M:
            need = more
    ground = _Ground(scene, need, reach_m=1.5 * need.width_m(TALL, least_m))
    tall, long = (_best(need, ground, ratio, least_m) for ratio in (TALL, LONG))
    is_worth_it = long.blank_share < tall.blank_share - _GAIN_SHARE and long.width <= min(
        tall.width * _MOST_WIDENING, MAX_WIDTH_M
    )
    return (long if is_worth_it else tall).camera()


class _Ground:
    """How much of a rectangle is road, walkway or crosswalk, from sums over a coarse raster."""

    def __init__(self, scene: Scene, need: _Need, reach_m: float) -> None:
        self._x0, self._y0 = need.x_max - reach_m, need.y_max - reach_m
        size_m = (need.x_min + reach_m - self._x0, need.y_min + reach_m - self._y0)
        raster = Image.new("L", (int(size_m[0] * _CELLS_PER_M), int(size_m[1] * _CELLS_PER_M)))
        pen = ImageDraw.Draw(raster)
        lanes: list[AnyLane] = [*scene.lanes, *scene.connectors]
        for polygon in (
            *(ribbon(lane) for lane in lanes),
            *(np.array(area.boundary_m, dtype=np.float64) for area in scene.areas),
        ):
            cells = (polygon - (self._x0, self._y0)) * _CELLS_PER_M
            pen.polygon([(x, y) for x, y in cells.tolist()], fill=1)
        sums = np.asarray(raster).astype(np.int64).cumsum(axis=0).cumsum(axis=1)
        self._sums = np.pad(sums, ((1, 0), (1, 0)))

    def share(
        self, x_min: FloatArray, y_min: FloatArray, width: float, height: float
    ) -> FloatArray:
        """Of rectangles of one size with lower left corners x_min (C,) by y_min (R,): (R, C)."""
        left = ((x_min - self._x0) * _CELLS_PER_M).astype(int)[None, :]
        low = ((y_min - self._y0) * _CELLS_PER_M).astype(int)[:, None]
        across, up = int(width * _CELLS_PER_M), int(height * _CELLS_PER_M)
        sums = self._sums
        covered = sums[low + up, left + across] - sums[low, left + across]
        covered = covered - sums[low + up, left] + sums[low, left]
        return np.asarray(covered / (across * up), dtype=np.float64)


def _best(need: _Need, ground: _Ground, ratio: float, least_m: float) -> _Window:
    """Of the least windows of a shape the one with most ground; the most usual among equals.

    As usual is one with the ego in the middle of its height and a quarter behind its left edge.
    """
    width = need.width_m(ratio, least_m)
    height = width / ratio
    x_min = np.arange(need.x_max - width, need.x_min + 0.5)
    y_min = np.arange(math.ceil(need.y_max - height), math.floor(need.y_min) + 0.5)
    share = ground.share(x_min, y_min, width, height)
    usual = np.abs(x_min + width / 4.0)[None, :] + np.abs(y_min + height / 2.0)[:, None]
    # Half a hundredth of ground is nothing that anybody sees.
    order = np.lexsort((usual.ravel(), -np.round(share.ravel() * 200.0)))
    row, column = divmod(int(order[0]), len(x_min))
    return _Window(
        float(x_min[column]), float(y_min[row]), width, height, 1.0 - float(share[row, column])
    )


def _places(scene: Scene, change: Modification) -> Iterator[FloatArray]:
    """The points (N, 2) of each place that a change touches."""
    touched = {agent.id for agent in change.moved} | set(change.removed)
    for agent in scene.agents:
        if agent.id in touched:
            yield _footprint(agent)
    for agent in change.changed:
        yield _footprint(agent)


def _footprint(agent: TrafficAgent) -> FloatArray:
    box = agent.box.corners_m
    return box if agent.walk_to_m is None else np.vstack([box, [agent.walk_to_m]])


def _distance_m(points_m: FloatArray) -> float:
    return float(np.hypot(points_m[:, 0], points_m[:, 1]).max())
