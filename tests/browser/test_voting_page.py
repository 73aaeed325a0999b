"""The voting page as it looks: fixed geometry, both themes, and phones."""

from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from django.conf import settings
from playwright.sync_api import Browser, Page, expect
from pytest_django.live_server_helper import LiveServer

from arena.studies.services.opening import close_study
from augment.services.scenarios.catalogue import read_catalogue
from tests import study_rows
from tests.browser.booth import PHONE, Booth, furnish, press, ready

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
RULES = {
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    "resultTypes": ["violations"],
}


def faults(page: Page) -> list[str]:
    """What axe-core finds, as rule: element."""
    found: list[dict[str, Any]] = Axe().run(page, options=RULES).response["violations"]
    return [f"{rule['id']}: {node['html'][:120]}" for rule in found for node in rule["nodes"]]


def test_axe_finds_nothing_on_any_page_of_voting(booth: Booth) -> None:
    booth.study.allow_both_miss = True
    booth.study.save()
    study_rows.vote(study_rows.matchups_of(booth.study, "eva")[0])
    page = booth.enter(color_scheme="dark", bypass_csp=True)
    assert faults(page) == []
    page.keyboard.press("u")
    ready(page)
    assert faults(page) == [], "a former pair"
    for key, opened in (("t", "#tools"), ("s", "#skip"), ("r", "#report"), ("c", "#comment")):
        page.keyboard.press(key)
        expect(page.locator(f"{opened}:popover-open")).to_be_visible()
        assert faults(page) == [], opened
        page.keyboard.press("Escape")
    page.keyboard.press("h")
    expect(page.locator("#help[open]")).to_be_visible()
    assert faults(page) == [], "help"
    for matchup in study_rows.matchups_of(booth.study, "eva")[1:]:
        study_rows.vote(matchup)
    page.goto(booth.path)
    assert faults(page) == [], "done"
    close_study(study=booth.study)
    page.goto(booth.path)
    assert faults(page) == [], "closed"


BLANK = """() => {
  const images = [...document.querySelectorAll(".scene > img")];
  const shown = images.map((one) => one.getBoundingClientRect());
  const seen = shown.reduce((sum, { width, height }) => sum + width * height, 0);
  return 1 - seen / (innerWidth * innerHeight);
}"""
"""The share of the window that is no picture: text, buttons, frames, bands and margins."""


@pytest.mark.parametrize("size", [(1280, 720), (1440, 900), (1920, 1080)])
def test_over_the_catalogue_a_quarter_at_most_is_no_picture_and_nothing_moves(
    live_server: LiveServer, browser: Browser, size: tuple[int, int]
) -> None:
    booth = Booth(address=live_server.url, browser=browser, study=furnish(scenarios=50, votes=9))
    entries = read_catalogue(settings.BASE_DIR / "fixtures")[1]
    for scenario, entry in zip(booth.study.scenarios.all(), entries, strict=True):
        scenario.instruction = entry.instruction
        scenario.save()
    page = booth.enter(viewport={"width": size[0], "height": size[1]})
    places = []
    for _ in range(3):
        places.append([panel.bounding_box() for panel in page.locator(".panel").all()])
        assert page.evaluate(
            "document.documentElement.scrollHeight <= innerHeight"
            " && document.documentElement.scrollWidth <= innerWidth"
        )
        assert page.evaluate(BLANK) <= 0.25
        press(page, "1")
    assert all(place == places[0] for place in places)
    for button in page.locator(".voting .button:visible").all():
        box = button.bounding_box()
        assert box is not None
        assert min(box["height"], box["width"]) >= 44, button.inner_text()
    booth.leave()


def test_a_phone_shows_one_above_the_other_and_a_bar_to_tap(booth: Booth) -> None:
    page = booth.enter(viewport=PHONE, has_touch=True, is_mobile=True)
    first, second = (panel.bounding_box() for panel in page.locator(".panel").all())
    assert first is not None
    assert second is not None
    assert second["y"] > first["y"] + first["height"]
    assert first["width"] > 0.9 * PHONE["width"]
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    bar = page.get_by_role("button", name="A is better").bounding_box()
    assert bar is not None
    assert bar["height"] >= 56
    assert bar["y"] + bar["height"] <= PHONE["height"]
    page.get_by_role("button", name="B is better").tap()
    expect(page.locator("#place")).to_have_text("2")
    ready(page)
    page.get_by_role("button", name="Tools").tap()
    page.get_by_role("button", name="Skip").tap()
    page.get_by_role("button", name="Instruction unclear").tap()
    expect(page.locator("#skipped")).to_have_text("Skipped: 1")
    expect(page.locator("#saved")).to_have_text("Saved 1. Nothing waiting.")
    assert booth.outcomes() == ["right", "skip"]
