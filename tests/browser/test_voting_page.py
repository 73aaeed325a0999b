"""The voting page as it looks: fixed geometry, both themes, and phones."""

from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from django.conf import settings
from playwright.sync_api import Page, ViewportSize, expect

from arena.studies.services.opening import close_study
from arena.voting.screen import LONGEST
from augment.services.scenarios.catalogue import read_catalogue
from tests import study_rows
from tests.browser.booth import PHONE, Booth, furnish, press, ready
from tests.moving import a_moving_study

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
RULES: dict[str, Any] = {
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    "resultTypes": ["violations"],
}

SIZES = ((1280, 720), (1440, 900), (1920, 1080))
FRAMES = """async () => {
    for (let frame = 0; frame < 3; frame += 1) await new Promise(requestAnimationFrame);
}"""
HIDE_BARS = "for (const bar of document.querySelectorAll('.film-bar')) bar.hidden = true"


def faults(page: Page, rules: dict[str, Any] = RULES) -> list[str]:
    """What axe-core finds, as rule: element."""
    found: list[dict[str, Any]] = Axe().run(page, options=rules).response["violations"]
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


@pytest.mark.parametrize("films", [0, 2])
def test_over_the_catalogue_everything_fits_and_nothing_moves(
    bare_booth: Booth, films: int
) -> None:
    # The longest instructions alone settle how high the text is.
    bare_booth.study = (a_moving_study if films else furnish)(scenarios=LONGEST, votes=9)
    entries = read_catalogue(settings.BASE_DIR / "fixtures")[1]
    texts = sorted((entry.instruction for entry in entries), key=len, reverse=True)
    for scenario, text in zip(bare_booth.study.scenarios.all(), texts, strict=False):
        scenario.instruction = text
        scenario.save()
    page = bare_booth.enter()
    places: dict[tuple[int, int], list[Any]] = {size: [] for size in SIZES}
    for number in range(4):
        expect(page.locator(".film-bar:visible")).to_have_count(films // 2)
        expect(page.locator("canvas.reel")).to_have_count(films)
        if number == 3:  # as of a pair without films
            page.evaluate(HIDE_BARS)
        for width, height in SIZES:
            page.set_viewport_size(ViewportSize(width=width, height=height))
            page.evaluate(FRAMES)
            _fits(page)
            standing = page.locator(".panel, .answers .button").all()
            places[width, height].append([one.bounding_box() for one in standing])
        if number < 3:
            press(page, "1")
    for size, boxes in places.items():
        assert boxes == [boxes[0]] * 4, size


def _fits(page: Page) -> None:
    """Nothing scrolls, and every button can be hit."""
    assert page.evaluate(
        "document.documentElement.scrollHeight <= innerHeight"
        " && document.documentElement.scrollWidth <= innerWidth"
    )
    for button in page.locator(".voting .button:visible").all():
        box = button.bounding_box()
        assert box is not None
        assert min(box["height"], box["width"]) >= 44, button.inner_text()


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
