"""A reference is drawn on its scene's picture: by a click, by keys, by dragging, by numbers."""

import io
import json
import re

import numpy as np
import pytest
from django.urls import reverse
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from augment.services.scenarios.pictures import draw_scene
from tests.browser.booth import Booth
from tests.jobs.rows import add_scenario
from tests.scenes import scene
from tests.web.cast import people

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True), pytest.mark.slow]
RED = (218, 30, 40)


def test_what_is_drawn_lies_where_it_was_put_and_is_told(bare_booth: Booth) -> None:
    people()
    scenario = add_scenario("street", scene=scene(), reference=None)
    draw_scene(scenario.base_scene_id)
    page = bare_booth.visit("the-researcher", reverse("scenario-edit", args=[scenario.code]), {})
    stage = page.locator("svg.stage")
    expect(stage.locator("image")).to_be_attached()
    page.wait_for_load_state("networkidle")
    _lies_on_the_ego(page, stage)
    # By a click, 15 m ahead: what the numbers then say is where it was clicked.
    page.get_by_role("button", name="Place by a click").click()
    at = stage.evaluate(
        "(svg) => { const p = new DOMPoint(15, 0.5).matrixTransform("
        "svg.getScreenCTM()); return [p.x, p.y]; }"
    )
    page.mouse.click(*at)
    assert float(page.input_value("#n-x_m")) == pytest.approx(15.0, abs=0.1)
    assert float(page.input_value("#n-y_m")) == pytest.approx(-0.5, abs=0.1)
    # By keys and by the server's lane.
    stage.press("Shift+ArrowRight")
    assert float(page.input_value("#n-x_m")) == pytest.approx(16.0, abs=0.1)
    page.get_by_role("button", name="Undo").click()
    assert float(page.input_value("#n-x_m")) == pytest.approx(15.0, abs=0.1)
    page.get_by_role("button", name="Onto the centreline").click()
    expect(page.locator("#n-y_m")).to_have_value(re.compile(r"^-?0(\.0\d*)?$"))
    # By dragging, and by its handle.
    car = stage.locator("[data-agent=Added1]")
    _drag(page, car, dx=40)
    moved = float(page.input_value("#n-x_m"))
    assert moved > 16.0
    _drag(page, stage.locator("[data-handle=turn]"), dy=-60)
    assert float(page.input_value("#n-heading_deg")) > 20.0
    page.fill("#n-heading_deg", "0")
    page.press("#n-heading_deg", "Enter")
    expect(page.locator("[data-findings] li").first).to_be_visible()
    expect(page.locator("[data-statements]")).to_contain_text("in the own lane")


def _lies_on_the_ego(page: Page, stage: Locator) -> None:
    """A box of the ego's size at the ego's place covers the ego of the worker's picture."""
    page.locator("summary", has_text="As JSON").click()
    before = _red(stage)
    ego = {"id": "Added1", "type": "VEHICLE", "x_m": 0, "y_m": 0, "heading_rad": 0}
    size = {"width_m": 2.297, "length_m": 5.176}
    change = {"format": "scenario-arena/modification", "version": 1, "add": [ego | size]}
    field = page.locator("[name=modification]")
    field.fill(json.dumps(change))
    field.blur()
    placed, box = stage.locator("[data-agent=Added1] .body").bounding_box(), stage.bounding_box()
    assert placed is not None
    assert box is not None
    # The arrow of its speed, ahead of it, is red as well.
    front = int(placed["x"] + placed["width"] - box["x"])
    assert before[:, :front].sum() > 1_000
    assert _red(stage)[:, :front].sum() < 0.02 * before[:, :front].sum()
    page.get_by_role("button", name="Undo").click()
    expect(stage.locator("[data-agent=Added1]")).to_have_count(0)


def _red(stage: Locator) -> np.ndarray:
    """Which pixels of the stage are the ego's, (H, W)."""
    seen = np.asarray(Image.open(io.BytesIO(stage.screenshot())).convert("RGB")).astype(int)
    return np.asarray((abs(seen - RED) < 40).all(axis=2))


def _drag(page: Page, what: Locator, *, dx: float = 0.0, dy: float = 0.0) -> None:
    box = what.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + dx, y + dy, steps=4)
    page.mouse.up()
