"""The player of drives: it plays in step, jumps to events, and is usable by everybody."""

from typing import Any

import pytest
from django.conf import settings
from django.test import Client
from django.urls import reverse
from playwright.sync_api import Browser, Page, expect
from pytest_django.live_server_helper import LiveServer

from augment.models import Simulation
from tests.browser.chromium import PATIENCE_MS
from tests.drives import driven, finished
from tests.jobs import rows
from tests.web.cast import people

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def opened(browser: Browser, address: str, row: Simulation, **options: Any) -> Page:
    """The page of a drive, as a researcher sees it, with its traces loaded."""
    client = Client()
    client.force_login(people()["researcher"])
    context = browser.new_context(base_url=address, **options)
    context.set_default_timeout(PATIENCE_MS)
    cookie = client.cookies[settings.SESSION_COOKIE_NAME].value
    context.add_cookies([{"name": settings.SESSION_COOKIE_NAME, "value": cookie, "url": address}])
    page = context.new_page()
    page.goto(reverse("drive", args=[row.code]))
    expect(page.locator("#player[data-ready]")).to_be_attached()
    return page


def picture(page: Page, number: int) -> str:
    """What a canvas shows."""
    shown = page.locator("canvas").nth(number).evaluate("canvas => canvas.toDataURL()")
    return str(shown)


def test_the_player_fits_a_small_laptop(browser: Browser, live_server: LiveServer) -> None:
    row, laptop = driven(finished(rows.launch()))[-1], {"width": 1366, "height": 768}
    page = opened(browser, live_server.url, row, viewport=laptop)
    for number in (2, 1):  # before beside after, then one drive alone
        end = page.locator("#timeline").bounding_box()
        assert end is not None
        assert end["y"] + end["height"] <= laptop["height"], f"{number} drives"
        page.evaluate("document.querySelector('.views').className = 'views'")
        page.locator(".views figure").first.evaluate("figure => figure.remove()")
    page.context.close()


def test_both_drives_are_played_stepped_and_scrubbed_in_step(
    browser: Browser, live_server: LiveServer
) -> None:
    page = opened(browser, live_server.url, driven(finished(rows.launch()))[-1])
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
    page.context.close()
