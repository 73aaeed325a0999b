"""Arrows for what lies outside: inside the picture, apart from each other, told in metres."""

from __future__ import annotations

import math
from itertools import combinations

import pytest

from augment.render.bev import draw
from augment.render.canvas import Box, Canvas, MetricCanvas
from augment.render.edges import Badge, distance_text, outside, place_badges
from augment.render.scale import scale_box
from augment.scene.entities import TrafficAgent
from augment.scene.modification import Modification
from tests import scenes
from tests.render.pictures import WIDE, draw_original, opened

CAMERA = WIDE
GROUND = MetricCanvas(Canvas(1200, 800, (255, 255, 255)), CAMERA)
SCALE = scale_box(CAMERA, (False, False))


def badges(*lost: TrafficAgent, seen: tuple[TrafficAgent, ...] = ()) -> list[Badge]:
    return place_badges(GROUND, list(lost), list(seen), taken=(SCALE,))


def apart(one: Box, other: Box) -> bool:
    return one[2] <= other[0] or other[2] <= one[0] or one[3] <= other[1] or other[3] <= one[1]


def test_an_agent_far_ahead_gets_an_arrow_at_the_right_edge() -> None:
    (badge,) = badges(scenes.vehicle("New1", 500.0, 0.0))
    assert badge.text == "500 m"
    assert badge.middle_px[0] > 1100.0
    assert badge.middle_px[1] == pytest.approx(400.0, abs=3.0)


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


def test_only_changed_agents_get_an_arrow() -> None:
    far = scenes.vehicle("Agent2", 500.0, 0.0)
    assert outside(GROUND, far)
    with_traffic, without = scenes.scene(agents=(far,)), scenes.scene()
    assert draw_original(with_traffic, CAMERA) == draw_original(without, CAMERA)
    change = Modification(added=(scenes.vehicle("New1", 500.0, 0.0),))
    picture = draw(without, change, CAMERA)
    assert picture != draw_original(without, CAMERA)
    assert opened(picture).size == (2400, 1600)


@pytest.mark.parametrize("place_m", [1e4, 1e9, -1e12])
def test_absurd_places_are_drawn_as_arrows_too(place_m: float) -> None:
    change = Modification(added=(scenes.vehicle("New1", place_m, place_m),))
    assert opened(draw(scenes.scene(), change, CAMERA)).size == (2400, 1600)


@pytest.mark.parametrize(
    ("distance_m", "expected"),
    [(46.4, "46 m"), (999.4, "999 m"), (999.6, "1 km"), (12345.0, "12.3 km"), (2e9, "> 999 km")],
)
def test_distances_are_whole_metres_then_kilometres(distance_m: float, expected: str) -> None:
    assert distance_text(distance_m) == expected
