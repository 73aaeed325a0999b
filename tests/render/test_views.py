"""Arrows to who is outside, and what reviewers are shown beside the picture: names, a legend."""

import io
import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from augment.render import legend, palette
from augment.render.bev import draw_for_review, lanes_near
from augment.render.camera import Camera, camera_for
from augment.render.canvas import Box, Canvas
from augment.render.labels import Badge, place_badges
from augment.render.road import scale_box
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from tests import scenes
from tests.render.pictures import WIDE
from tests.scenes import cone, junction, pedestrian, scene, vehicle

GROUND = Canvas(WIDE, (255, 255, 255))
SCALE = scale_box(WIDE, (False, False))


def badges(*lost: TrafficAgent, seen: tuple[TrafficAgent, ...] = ()) -> list[Badge]:
    return place_badges(GROUND, scenes.scene().ego, (*lost, *seen), taken=(SCALE,))


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


@pytest.mark.slow
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
        assert 0.0 <= left < right <= 1200.0
        assert 0.0 <= top < bottom <= 800.0


def test_arrows_keep_clear_of_the_marks_that_are_seen() -> None:
    seen = scenes.vehicle("New2", 42.0, 0.0)
    (badge,) = badges(scenes.vehicle("New1", 500.0, 0.0), seen=(seen,))
    assert badge.box_px[3] < 400.0 - 20.0 or badge.box_px[1] > 400.0 + 20.0


def reviewed(
    monkeypatch: object, base: Scene, change: Modification, camera: Camera | None = None
) -> tuple[tuple[bytes, ...], list[tuple[float, float, str]]]:
    """The pictures, and every text with its place, of the first picture and its legend first."""
    said: list[tuple[float, float, str]] = []
    original = Canvas.text

    def text(
        self: Canvas, at_px: tuple[float, float], words: str, *args: object, **more: object
    ) -> None:
        said.append((*at_px, words))
        original(self, at_px, words, *args, **more)  # type: ignore[arg-type]

    monkeypatch.setattr(Canvas, "text", text)  # type: ignore[attr-defined]
    return draw_for_review(base, change, camera or camera_for(base, change)), said


def pixels(png: bytes) -> NDArray[np.uint8]:
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))


def test_every_edited_object_and_every_lane_near_it_carries_its_label(monkeypatch: object) -> None:
    crowd = [cone(f"Agent{n}", 24.0 + 0.25 * (n % 4), 0.3 * (n // 4)) for n in range(2, 14)]
    base = junction()
    _, said = reviewed(monkeypatch, base, Modification(added=tuple(crowd)))
    words = [one[2] for one in said]
    assert {agent.id for agent in crowd} <= set(words)
    near = {lane.id for lane in lanes_near(base, tuple(crowd))}
    assert {"Connector1", "Connector2", "Lane1"} <= near <= set(words)
    ids = [one for one in said if one[2].startswith(("Agent", "Lane", "Connector"))]
    for number, (x, y, word) in enumerate(ids):
        half = 4.2 * len(word)
        for other_x, other_y, other in ids[number + 1 :]:
            apart = abs(x - other_x) > half + 4.2 * len(other) - 12.0 or abs(y - other_y) > 14.0
            assert apart, (word, other)


def test_what_is_small_is_shown_enlarged_as_well() -> None:
    base = scene()
    large = Modification(added=(vehicle("Agent2", 15.0, 0.0),))
    assert len(draw_for_review(base, large, camera_for(base, None))) == 1
    bicycle = vehicle("Agent2", 15.0, 0.0, type=AgentType.BICYCLE, length_m=1.8, width_m=0.6)
    change = Modification(added=(bicycle,))
    whole, closer = (pixels(png) for png in draw_for_review(base, change, camera_for(base, None)))
    blue = [
        (np.abs(one.astype(int) - palette.CHANGED_MARK.fill).sum(axis=2) < 30).sum()
        for one in (whole, closer)
    ]
    assert blue[1] > 2 * blue[0]


def test_the_legend_names_what_is_drawn_and_what_is_not_to_scale(monkeypatch: object) -> None:
    base = replace(junction(), agents=(vehicle("Agent2", 8.0, 4.0),))
    things = (pedestrian("Agent3", 10.0, -3.0, (10.0, 3.0)), cone("Agent4", 12.0, 1.0))
    change = Modification(added=things)
    _, said = reviewed(monkeypatch, base, change)
    words = " | ".join(one[2] for one in said)
    for wanted in (
        "ego; arrow: front",
        "changed: pedestrian, beak where he faces, not to scale",
        "changed: cone, not to scale, no front",
        "other vehicle, true size",
        "to where a walk ends",
        "edge of a connector at the edit",
        "bar in red, yellow or green: light",
    ):
        assert wanted in words
    assert "sign" not in words
    assert legend.draw_legend(base, change, 600).height_px > 100
