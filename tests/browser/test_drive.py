"""The player of drives: it plays in step, jumps to events, and is usable by everybody."""

from typing import Any

import pytest
from django.urls import reverse
from playwright.sync_api import Page, expect

from augment.models import Simulation
from tests.browser.booth import Booth
from tests.drives import driven, finished
from tests.jobs import rows
from tests.web.cast import people

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def opened(booth: Booth, row: Simulation, **options: Any) -> Page:
    """The page of a drive, as a researcher sees it, with its traces loaded."""
    people()
    page = booth.visit("the-researcher", reverse("drive", args=[row.code]), options)
    expect(page.locator("#player[data-ready]")).to_be_attached()
    return page


def picture(page: Page, number: int) -> str:
    """What a canvas shows."""
    shown = page.locator("canvas").nth(number).evaluate("canvas => canvas.toDataURL()")
    return str(shown)


def test_the_player_fits_a_small_laptop(bare_booth: Booth) -> None:
    row, laptop = driven(finished(rows.launch()))[-1], {"width": 1366, "height": 768}
    page = opened(bare_booth, row, viewport=laptop)
    for number in (2, 1):  # before beside after, then one drive alone
        end = page.locator("#timeline").bounding_box()
        assert end is not None
        assert end["y"] + end["height"] <= laptop["height"], f"{number} drives"
        page.evaluate("document.querySelector('.views').className = 'views'")
        page.locator(".views figure").first.evaluate("figure => figure.remove()")


def test_both_drives_are_played_stepped_and_scrubbed_in_step(bare_booth: Booth) -> None:
    page = opened(bare_booth, driven(finished(rows.launch()))[-1])
    clock = page.locator("#clock")
    first = [picture(page, number) for number in (0, 1)]
    page.get_by_role("button", name="One step on").click()
    expect(clock).to_have_text("0.1 s")
    assert [picture(page, number) != first[number] for number in (0, 1)] == [True, True]
    page.get_by_role("button", name="One step back").click()
    expect(clock).to_have_text("0.0 s")
    assert [picture(page, number) for number in (0, 1)] == first
    page.locator("#scrub").fill("6")
    expect(clock).to_have_text("0.6 s")
    page.get_by_label("Speed").select_option("4")
    page.get_by_role("button", name="Play").click()
    expect(clock).to_have_text("1.2 s")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    near = picture(page, 1)
    page.get_by_label("Follow the ego").uncheck()
    assert picture(page, 1) != near
