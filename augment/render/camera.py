"""Window of a scene's picture: the same for every contestant of a scenario.

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
from numpy.typing import ArrayLike
from PIL import Image, ImageDraw

from augment.geometry.polyline import FloatArray
from augment.render.shapes import lane_ring, sides
from augment.scene.entities import Modification, Point, Scene
from augment.scene.motion import Expectation, ego_spots, find_trails

WIDTH_PX = 1200
MARGIN_M = 5.0
# The widest window, 4 px/m: beyond it a car is a speck, and an arrow at the edge tells more.
MAX_WIDTH_M = 288.0
# How far from the ego the window follows what contestants changed.
FOLLOWED_M = 60.0
# What is only driven through widens it up to this: a car has 34 pixels still.
PASSED_WIDTH_M = 168.0
LEAST_WIDTH_M = 72.0
WIDTH_STEP_M = 6.0
# Of the picture, width to height. A street is long: a higher window shows more of what lies
# beside it, which maps mostly leave blank; and two of these, one above the other, fill a screen.
RATIO = 4.0
# Without a reference nothing says where a change may come: a view far ahead.
_OPEN_AHEAD_M = 40.0
_AHEAD_M, _BEHIND_M, _BESIDE_M = 15.0, 3.0, 3.0
# Cells of the raster on which the ground is counted, per metre.
_CELLS_PER_M = 2

LOOK = 3
"""Raised whenever pictures of old and new look must not stand side by side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A window of the ego frame and its scale, the same on both axes.

    Attributes:
        is_filmed: Whether its pictures have a film: all of a scenario or pair, or none.
        ticks_m: Distances ahead of the ego that are marked on its lane.
        inset: A part shown enlarged in the same picture, None without one.
    """

    x_min_m: float
    x_max_m: float
    y_min_m: float
    y_max_m: float
    px_per_m: float
    is_filmed: bool = False
    ticks_m: tuple[float, ...] = ()
    inset: Inset | None = None

    @classmethod
    def over(cls, low_m: ArrayLike, high_m: ArrayLike, px_per_m: float) -> Camera:
        """Return the plain window from its lower left corner (2,) to its upper right one (2,)."""
        (x_min_m, y_min_m), (x_max_m, y_max_m) = np.array([low_m, high_m], dtype=float).tolist()
        return cls(
            x_min_m=x_min_m, x_max_m=x_max_m, y_min_m=y_min_m, y_max_m=y_max_m, px_per_m=px_per_m
        )

    @property
    def width_px(self) -> int:
        """The picture's width."""
        return round((self.x_max_m - self.x_min_m) * self.px_per_m)

    @property
    def height_px(self) -> int:
        """The picture's height."""
        return round((self.y_max_m - self.y_min_m) * self.px_per_m)

    def at_width(self, width_px: int) -> Camera:
        """Return the same window as a picture of another width."""
        return replace(self, px_per_m=width_px / (self.x_max_m - self.x_min_m))

    @property
    def key(self) -> str:
        """Look and window in short: two pictures that share it can stand side by side."""
        edges: tuple[float, ...] = (self.x_min_m, self.x_max_m, self.y_min_m, self.y_max_m)
        edges += (self.px_per_m,)
        if self.inset is not None:
            edges += (*self.inset.box_px, self.inset.camera.x_min_m, self.inset.camera.y_min_m)
        shown = " ".join(f"{value:.6f}" for value in (*edges, *self.ticks_m))
        window = f"{LOOK}-{hashlib.sha256(shown.encode()).hexdigest()[:8]}"
        return f"{window}-film" if self.is_filmed else window

    def at(self, left_px: float, top_px: float) -> Inset:
        """Return the window as an inset whose upper left corner lies there."""
        box = (left_px, top_px, left_px + self.width_px, top_px + self.height_px)
        return Inset(camera=self, box_px=box)

    def to_pixels(self, points_m: FloatArray) -> FloatArray:
        """Return points (N, 2) of the ego frame as pixels (N, 2), also outside the picture."""
        scale = self.px_per_m
        # Left of the ego is up, and pixels count downwards.
        pixels = np.asarray(points_m, dtype=np.float64) * (scale, -scale)
        pixels += (-self.x_min_m * scale, self.y_max_m * scale)
        return pixels

    def shows(self, points_m: FloatArray, margin_m: float = 0.0) -> bool:
        """Return whether the bounding box of points (N, 2) touches the window with a margin."""
        low, high = np.min(points_m, axis=0), np.max(points_m, axis=0)
        return bool(
            high[0] >= self.x_min_m - margin_m
            and low[0] <= self.x_max_m + margin_m
            and high[1] >= self.y_min_m - margin_m
            and low[1] <= self.y_max_m + margin_m
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Inset:
    """A window of its own, and where it lies in the picture: left, top, right, bottom."""

    camera: Camera
    box_px: tuple[float, float, float, float]


AROUND_THE_EGO = Camera.over((-60.0, -60.0), (100.0, 60.0), 10.0)
"""The same for every scene, and wide: on it objects are placed by hand."""


def camera_for(
    scene: Scene,
    reference: Modification | None,
    changes: tuple[Modification, ...] = (),
    expect: Expectation = lambda scene, modification: None,
) -> Camera:
    """Return the window of a scenario, the same for all its contestants.

    The least of the windows in steps of 6 m that holds the ego, 15 m ahead of it and with 5 m
    around it all that the reference touches, and all that contestants touch within 60 m of the
    ego; of those on a raster of 1 m the one that shows most of the ground. Of places too far apart
    for the widest window the nearest to the ego are kept.

    Where anybody has a motion, it holds as well where they and the ego come within 60 m of where
    the ego is at t0, as far as it gets no wider than 168 m by that.

    Args:
        scene: The scene before the change; the old places of what is moved or removed belong
            into the picture as well.
        reference: The scenario's reference, None without one.
        changes: What the scenario's contestants made of it.
        expect: Returns what is expected after t0, for motions.
    """
    moving = [
        change for change in (reference, *changes) if change is not None and change.has_motion
    ]
    spots = [
        spot
        for change in moving
        for trail in find_trails(scene, change, expect(scene, change))
        for spot in trail.spots
    ]
    spots += ego_spots(scene, expect(scene, Modification())) if moving else ()
    boxes = [spot.box.corners_m for spot in spots]
    near = [box for box in boxes if _distance_m(box) <= FOLLOWED_M]
    places = [tuple(map(tuple, box.tolist())) for box in near]
    camera = _camera_for(scene, reference, changes, tuple(places))
    return replace(camera, is_filmed=True) if moving else camera


def changed_places(scene: Scene, change: Modification) -> Iterator[FloatArray]:
    """Yield the points (N, 2) of each place that a change touches."""
    touched = {agent.id for agent in change.moved} | set(change.removed)
    for agent in (*(agent for agent in scene.agents if agent.id in touched), *change.changed):
        box = agent.box.corners_m
        yield box if agent.walk_to_m is None else np.vstack([box, [agent.walk_to_m]])


# Private


@lru_cache(maxsize=16)
def _camera_for(
    scene: Scene,
    reference: Modification | None,
    changes: tuple[Modification, ...],
    passed: tuple[tuple[Point, ...], ...],
) -> Camera:
    """The window that holds what is changed and, as far as it goes, what is passed."""
    ahead_m = _OPEN_AHEAD_M if reference is None else _AHEAD_M
    behind_m = -math.ceil(scene.ego.length_m / 2.0 + _BEHIND_M)
    need = np.array([[behind_m, -_BESIDE_M], [ahead_m, _BESIDE_M]])
    places = [*changed_places(scene, reference or Modification())]
    followed = [place for change in changes for place in changed_places(scene, change)]
    places += [place for place in followed if _distance_m(place) <= FOLLOWED_M]
    need = _widen(need, places, MAX_WIDTH_M)
    widest_m = max(PASSED_WIDTH_M, _width_m(need))
    return _best(_widen(need, [np.array(place) for place in passed], widest_m), scene)


def _widen(need: FloatArray, places: list[FloatArray], widest_m: float) -> FloatArray:
    """Return the window (2, 2) widened by those places, the nearest first, up to a width."""
    for place in sorted(places, key=_distance_m):
        # Whole metres, as the raster of windows.
        low = np.floor(np.minimum(need[0], place.min(axis=0) - MARGIN_M))
        high = np.ceil(np.maximum(need[1], place.max(axis=0) + MARGIN_M))
        more = np.array([low, high])
        if _width_m(more) <= widest_m:
            need = more
    return need


def _width_m(need: FloatArray) -> float:
    """Return the least width in whole steps of a window that holds what is needed."""
    across, up = (need[1] - need[0]).tolist()
    return float(math.ceil(max(LEAST_WIDTH_M, across, up * RATIO) / WIDTH_STEP_M) * WIDTH_STEP_M)


def _ground_sums(scene: Scene, origin_m: FloatArray, size_m: FloatArray) -> np.ndarray:
    """Return sums over a coarse raster of road, walkways and crosswalks, (R + 1, C + 1)."""
    width, height = (int(side * _CELLS_PER_M) for side in size_m)
    raster = Image.new("L", (width, height))
    pen = ImageDraw.Draw(raster)
    for polygon in (
        *(lane_ring(*sides(lane)) for lane in scene.ways),
        *(np.array(area.boundary_m, dtype=np.float64) for area in scene.areas),
    ):
        cells = (polygon - origin_m) * _CELLS_PER_M
        pen.polygon([(x, y) for x, y in cells.tolist()], fill=1)
    # Sums over all cells left of and below: any window's are four reads away.
    sums = np.asarray(raster).astype(np.int64).cumsum(axis=0).cumsum(axis=1)
    return np.pad(sums, ((1, 0), (1, 0)))


def _best(need: FloatArray, scene: Scene) -> Camera:
    """Return the least window with most ground.

    Among equals the most usual one, with the ego in the middle of its height and a quarter
    behind its left edge.
    """
    width = _width_m(need)
    height = width / RATIO
    # The raster reaches past every window that holds what is needed.
    origin_m = need[1] - 1.5 * width
    sums = _ground_sums(scene, origin_m, need[0] - need[1] + 3.0 * width)
    # (X,), (Y,) lower left corners, a metre apart, of windows that hold what is needed.
    x_min = np.arange(need[1, 0] - width, need[0, 0] + 0.5)
    y_min = np.arange(math.ceil(need[1, 1] - height), math.floor(need[0, 1]) + 0.5)
    left = ((x_min - origin_m[0]) * _CELLS_PER_M).astype(int)[None, :]
    low = ((y_min - origin_m[1]) * _CELLS_PER_M).astype(int)[:, None]
    across, up = int(width * _CELLS_PER_M), int(height * _CELLS_PER_M)
    # (Y, X), from (Y, 1) and (1, X): a window's sum by the corners of the sums.
    covered = sums[low + up, left + across] - sums[low, left + across]
    share = (covered - sums[low + up, left] + sums[low, left]) / (across * up)
    usual = np.abs(x_min + width / 4.0)[None, :] + np.abs(y_min + height / 2.0)[:, None]
    # Half a hundredth of ground is nothing that anybody sees.
    order = np.lexsort((usual.ravel(), -np.round(share.ravel() * 200.0)))
    row, column = divmod(int(order[0]), len(x_min))
    x_m, y_m = float(x_min[column]), float(y_min[row])
    return Camera.over((x_m, y_m), (x_m + width, y_m + height), WIDTH_PX / width)


def _distance_m(points_m: FloatArray) -> float:
    return float(np.hypot(points_m[:, 0], points_m[:, 1]).max())
