"""Arrows for what lies outside: inside the picture, apart from each other, told in metres."""

from __future__ import annotations

import math
from itertools import combinations

import pytest

from augment.render.canvas import Box, Canvas
from augment.render.labels import Badge, place_badges
from augment.render.road import scale_box
from augment.scene.entities import TrafficAgent
from tests import scenes
from tests.render.pictures import WIDE

CAMERA = WIDE
GROUND = Canvas(CAMERA, (255, 255, 255))
SCALE = scale_box(CAMERA, (False, False))


def badges(*lost: TrafficAgent, seen: tuple[TrafficAgent, ...] = ()) -> list[Badge]:
    return place_badges(GROUND, list(lost), list(seen), taken=(SCALE,))


def apart(one: Box, other: Box) -> bool:
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


@pytest.mark.parametrize(
    ("x_m", "y_m", "side"),
    [(0.0, 90.0, "top"), (0.0, -90.0, "bottom"), (-90.0, 0.0, "left"), (90.0, 0.0, "right")],
)
def test_the_arrow_sits_on_the_side_where_the_agent_is(x_m: float, y_m: float, side: str) -> None:
    (badge,) = badges(scenes.vehicle("New1", x_m, y_m))
    left, top, right, bottom = badge.box_px
    gaps = {"left": left, "top": top, "right": 1200.0 - right, "bottom": 800.0 - bottom}
    assert min(gaps, key=lambda name: gaps[name]) == side


@pytest.mark.parametrize("count", [2, 30, 120])
def test_arrows_stay_inside_and_apart(count: int) -> None:
    crowd = [
        scenes.vehicle(f"New{index}", 100.0 * math.cos(index / 9.0), 90.0 * math.sin(index / 9.0))
        for index in range(count)
    ]
    found = badges(*crowd)
    assert len(found) == count
    boxes = [badge.box_px for badge in found] + [SCALE]
    assert all(apart(one, other) for one, other in combinations(boxes, 2))
    for left, top, right, bottom in boxes:
        assert left >= 0.0
        assert top >= 0.0
        assert right <= 1200.0
        assert bottom <= 800.0


def test_arrows_keep_clear_of_the_marks_that_are_seen() -> None:
    seen = scenes.vehicle("New2", 42.0, 0.0)
    (badge,) = badges(scenes.vehicle("New1", 500.0, 0.0), seen=(seen,))
    assert badge.box_px[3] < 400.0 - 20.0 or badge.box_px[1] > 400.0 + 20.0
