"""D plays how a planner drove both scenes, under their pictures, and the vote says so."""

import pytest
from playwright.sync_api import Page, expect

from tests.browser.booth import Booth, all_sent, hang, press
from tests.web.test_replay import a_replayed_study

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


@pytest.fixture
def played(bare_booth: Booth) -> Booth:
    """A booth whose study plays drives."""
    bare_booth.study = hang(a_replayed_study(experts=("eva",)))
    return bare_booth


def picture(page: Page, number: int) -> str:
    shown = page.locator(".side canvas").nth(number).evaluate("canvas => canvas.toDataURL()")
    return str(shown)


def test_d_plays_both_drives_in_step_and_the_next_pair_ends_it(played: Booth) -> None:
    page = played.enter(reduced_motion="reduce")
    switch = page.locator("#replay-switch")
    assert not page.evaluate("performance.getEntriesByType('resource')").count("film")
    page.keyboard.press("d")
    expect(page.locator(".side canvas")).to_have_count(2)
    expect(switch).to_have_attribute("aria-pressed", "true")
    first = [picture(page, number) for number in (0, 1)]
    time = page.get_by_role("slider", name="Time")
    # On the page an arrow would vote; here it moves in time.
    time.focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator(".replay-bar output")).to_have_text("0.1 s")
    assert [picture(page, n) != first[n] for n in (0, 1)] == [True, True]
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".replay-bar output")).to_have_text("1.2 s")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.locator("body").click(position={"x": 5, "y": 400})
    press(page, "1")
    expect(page.locator(".side canvas")).to_have_count(0)
    expect(switch).to_have_attribute("aria-pressed", "false")
    press(page, "3")
    all_sent(page, 2)
    assert [vote.aids for vote in played.votes()] == ["replay", ""]
