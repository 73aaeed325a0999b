"""The pictures of reviewers: labels, lanes over boxes, edges, an enlargement and a legend."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from augment.render import legend, palette
from augment.render.bev import draw_for_review, lanes_near
from augment.render.camera import Camera, camera_for
from augment.render.canvas import Canvas
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from tests.scenes import cone, junction, pedestrian, scene, vehicle


def added(*agents: TrafficAgent) -> Modification:
    return Modification(added=agents)


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
    _, said = reviewed(monkeypatch, base, added(*crowd))
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
    assert (
        len(draw_for_review(base, added(vehicle("Agent2", 15.0, 0.0)), camera_for(base, None)))
        == 1
    )
    bicycle = replace(
        vehicle("Agent2", 15.0, 0.0), type=AgentType.BICYCLE, length_m=1.8, width_m=0.6
    )
    change = added(bicycle)
    whole, closer = (pixels(png) for png in draw_for_review(base, change, camera_for(base, None)))
    blue = [
        (np.abs(one.astype(int) - palette.CHANGED_MARK.fill).sum(axis=2) < 30).sum()
        for one in (whole, closer)
    ]
    assert blue[1] > 2 * blue[0]


def test_the_legend_names_what_is_drawn_and_what_is_not_to_scale(monkeypatch: object) -> None:
    base = replace(junction(), agents=(vehicle("Agent2", 8.0, 4.0),))
    change = added(pedestrian("Agent3", 10.0, -3.0, (10.0, 3.0)), cone("Agent4", 12.0, 1.0))
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
