"""From a recording to a drawn reference, and from a result to its correction, without a shell.

The workers are real: what is read, drawn and kept is their work.
"""

import io
import json
import re
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from playwright.sync_api import Locator, Page, expect

from tests.browser.chromium import chromium
from tests.browser.hand import Hand
from tests.formats.av2_logs import write_log
from tests.processes import wait_until
from tests.stack import Home

pytestmark = [pytest.mark.browser, pytest.mark.redis, pytest.mark.slow, pytest.mark.timeout(600)]
RED = (218, 30, 40)


def test_a_recording_becomes_a_reference_and_a_result_is_corrected(tmp_path: Path) -> None:
    home = Home.at(tmp_path / "h")
    home.folder.mkdir()
    packed = tmp_path / "log.zip"
    folder = write_log(tmp_path / "log")
    with zipfile.ZipFile(packed, "w") as made:
        for file in sorted(folder.rglob("*")):
            made.write(file, file.relative_to(tmp_path))
    with home.serving() as address, ThreadPoolExecutor(1) as pool:
        # Playwright wants a thread without an event loop.
        pool.submit(_work, home, address, packed).result()


def _work(home: Home, address: str, packed: Path) -> None:
    with chromium() as browser:
        ada = Hand.at(browser, address)
        ada.become_admin(home)
        page = ada.page
        page.goto("/scenarios/")
        page.click("button[value=paper]")  # and the contestants that ask nobody
        expect(page.get_by_text("50 added")).to_be_visible()
        _keep_a_moment(page, packed)
        _draw_scenario(page)
        _run_reference(page)
        _correct(page)


def _keep_a_moment(page: Page, packed: Path) -> None:
    page.goto("/scenes/")
    page.set_input_files("[name=file]", packed)
    page.fill("[name=name]", "Recorded")
    page.get_by_role("button", name="Use this moment").click()
    expect(page.get_by_role("heading", name="recorded")).to_be_visible()


def _draw_scenario(page: Page) -> None:
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
    page.locator("summary", has_text="Advanced").click()
    page.fill("[name=slug]", "parked-ahead")
    page.get_by_role("button", name="Save the scenario").click()
    expect(page.get_by_text("“parked-ahead” is added")).to_be_visible()
    expect(page.locator("img[src*='/pictures/reference/']")).to_be_visible()


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


def _run_reference(page: Page) -> None:
    page.goto("/jobs/new/")
    page.fill("[name=name]", "Round 1")
    # Scenarios are folded away with the others of their type.
    for name, value in {"contestants": "reference", "scenarios": "parked-ahead"}.items():
        page.locator(f"[name={name}]").evaluate_all(
            "(boxes, one) => boxes.forEach((b) => b.checked === (b.value === one) || b.click())",
            value,
        )
    page.click("[data-launch]")
    expect(page.get_by_text("Finished").first).to_be_visible(timeout=240_000)


def _correct(page: Page) -> None:
    page.goto("/scenarios/?set=own")
    page.get_by_text("parked-ahead").click()
    page.locator("a[href*='/augmentations/']").first.click()
    original = page.url
    page.get_by_role("link", name="Correct by hand").click()
    stage = page.locator("svg.stage")
    page.wait_for_load_state("networkidle")
    page.locator("[data-pick=Added1]").click()
    stage.press("Shift+ArrowUp")
    left = float(page.input_value("#n-y_m"))
    page.fill("#notes", "too far right")
    page.get_by_role("button", name="Keep the correction").click()
    expect(page.get_by_text("Corrected by hand by ada")).to_be_visible()

    def drawn() -> bool:
        page.reload()
        return page.locator("img[src*='/pictures/augmentation/']").count() == 1

    wait_until(drawn, what="a worker draws the correction")
    assert f"{left:.2f}" in page.get_by_role("table").last.inner_text()
    expect(page.get_by_text("from the reference on average")).to_be_visible()
    page.goto(original)
    expect(page.get_by_text("Corrected by hand:")).to_be_visible()
    assert f"{left:.2f}" not in page.get_by_role("table").last.inner_text()
