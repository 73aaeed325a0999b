"""Pairs that were skipped: listed, opened again, and no votes anywhere on the page."""

import pytest
from playwright.sync_api import expect

from arena.voting import screen
from tests.browser.booth import Booth, all_sent, let_bounce, press
from tests.browser.test_voting_page import faults

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_a_skip_moves_no_bar_and_its_pair_comes_back_from_the_list(booth: Booth) -> None:
    page = booth.enter(bypass_csp=True)
    press(page, "1")
    page.keyboard.press("s")
    page.keyboard.press("3")
    expect(page.locator("#skipped")).to_have_text("Skipped: 1")
    all_sent(page, 1)
    assert page.locator("#bar").evaluate("bar => bar.value") == 1
    page.locator("#skipped").click()
    expect(page.get_by_role("heading", name="Skipped pairs")).to_be_visible()
    assert faults(page) == []
    page.get_by_role("link", name="Open pair 2 again").click()
    expect(page.locator("#question")).to_have_text("Pair 2: skipped. Choose now?")
    page.wait_for_selector("body.is-live #vote:not([inert]) #answers:not([inert])")
    let_bounce(page)
    page.keyboard.press("3")
    all_sent(page, 2)
    expect(page.locator("#skipped")).to_be_hidden()
    expect(page.locator("#place")).to_have_text("3")
    assert booth.outcomes() == ["left", "right"]


def test_a_pair_skipped_long_ago_is_asked_about_once(
    booth: Booth, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(screen, "UNDOABLE", 1)  # the skip is none of the last votes
    page = booth.enter(bypass_csp=True)
    page.keyboard.press("s")
    page.keyboard.press("3")
    expect(page.locator("#skipped")).to_have_text("Skipped: 1")
    let_bounce(page)
    for _ in range(2):
        press(page, "1")
    all_sent(page, 2)
    page.locator("#skipped").click()
    page.get_by_role("link", name="Open pair 1 again").click()
    page.wait_for_selector("body.is-live #vote:not([inert]) #answers:not([inert])")
    let_bounce(page)
    page.keyboard.press("3")
    all_sent(page, 3)
    expect(page.locator("#skipped")).to_be_hidden()
    expect(page.locator("#place")).to_have_text("4")
    assert sorted(booth.outcomes()) == ["left", "left", "right"]
