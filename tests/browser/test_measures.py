"""Measures over both pictures: lines that stay put and stay thin, lane edges under the ruler."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect
from pytest_django.live_server_helper import LiveServer

from augment.models import Scenario
from augment.scene.codec import intent_to_document
from tests.browser.booth import BOUNCE_MS, Booth, furnish, ready
from tests.browser.test_voting_page import faults
from tests.intents import LEFT_EDGE, parked, towards

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

WIDTHS = """() => [...document.querySelectorAll(".measures [data-asked]")].map(
    (line) => parseFloat(line.style.strokeWidth) * line.getScreenCTM().a
)"""


@pytest.fixture
def measured(live_server: LiveServer, browser: Browser) -> Iterator[Booth]:
    made = Booth(address=live_server.url, browser=browser, study=furnish())
    intent = intent_to_document(parked(15.0, lateral=towards(LEFT_EDGE, 1.2)))
    Scenario.objects.update(intent=intent, intent_origin="authored")
    yield made
    made.leave()


def line_widths(page: Page) -> list[float]:
    return [round(float(width), 1) for width in page.evaluate(WIDTHS)]


def test_g_lays_lines_over_both_and_the_ruler_says_how_far_the_edges_are(measured: Booth) -> None:
    page = measured.enter(bypass_csp=True)
    switch = page.get_by_role("button", name="Measures G")
    page.keyboard.press("g")
    layers = page.locator(".measures")
    expect(layers).to_have_count(2)
    expect(switch).to_have_attribute("aria-pressed", "true")
    expect(page.locator("#said")).to_have_text("15 m ahead, 1.2 m left")
    first, second = (layers.nth(number).inner_html() for number in (0, 1))
    assert first == second, "drawn over both the same"
    assert line_widths(page) == [2.0] * 4
    assert faults(page) == [], "axe"
    page.mouse.move(200, 300)
    page.keyboard.press("z")
    assert line_widths(page) == [2.0] * 4, "as thin when zoomed"
    page.keyboard.press("0")
    page.get_by_role("button", name="Ruler M").click()
    tag = page.locator(".edges")
    expect(tag.first).to_have_text("1.8 m from the left edge of its lane, 1.8 m from the right")
    page.keyboard.press("ArrowDown")
    expect(tag.last).to_have_text("2.8 m from the left edge of its lane, 0.8 m from the right")
    page.wait_for_timeout(BOUNCE_MS)
    page.keyboard.press("1")
    expect(layers).to_have_count(0)
    expect(switch).to_have_attribute("aria-pressed", "false")
    ready(page)
    page.wait_for_timeout(BOUNCE_MS)
    page.keyboard.press("2")
    expect(page.locator("#saved")).to_contain_text("Saved 2.")
    assert [vote.aids for vote in measured.votes()] == ["zoom ruler measures", ""]
