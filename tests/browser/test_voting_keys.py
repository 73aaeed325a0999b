"""Everything goes by keys alone, and no key votes by accident."""

import pytest
from playwright.sync_api import Page, expect

from arena.models import Report, Vote
from tests.browser.booth import Booth, all_sent, press, ready

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_every_vote_key_means_what_the_help_says(booth: Booth) -> None:
    page = booth.enter()
    for key in ("1", "ArrowLeft", "a", "2", "ArrowDown", "e", "3", "ArrowRight"):
        press(page, key)
    page.keyboard.press("b")
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    assert booth.outcomes() == [*["left"] * 3, *["equal"] * 3, *["right"] * 3]


def test_no_modified_key_votes_and_none_while_typing(booth: Booth) -> None:
    page = booth.enter()
    for key in ("Control+1", "Alt+2", "Meta+3", "Shift+A", "Shift+ArrowLeft", "Shift+Digit2"):
        page.keyboard.press(key)
    page.keyboard.press("c")
    page.keyboard.type("1 and 2 abe")
    page.keyboard.press("Control+Enter")
    page.keyboard.press("h")
    expect(page.get_by_role("dialog", name="How to vote")).to_be_visible()
    page.keyboard.press("2")
    page.keyboard.press("Escape")
    assert not kept(page)
    press(page, "3")
    all_sent(page, 1)
    vote = Vote.objects.get()
    assert (vote.outcome, vote.comment) == ("right", "1 and 2 abe")


def test_the_whole_loop_without_a_mouse(booth: Booth) -> None:
    booth.study.allow_both_miss = booth.study.ask_strength = True
    booth.study.save()
    page = booth.enter()
    press(page, "Shift+Digit1")
    press(page, "4")
    page.keyboard.press("s")
    press(page, "4")  # the fourth reason
    page.keyboard.press("r")
    page.keyboard.press("2")
    expect(page.locator("#note")).to_have_text("Reported, thank you.")
    page.keyboard.press("u")
    page.keyboard.press("Backspace")
    page.keyboard.press("Control+z")
    expect(page.locator("#question")).to_contain_text("Pair 1: A, clearly.")
    expect(page.get_by_role("button", name="A clearly")).to_have_attribute("aria-pressed", "true")
    ready(page)
    press(page, "3")  # replaces it and returns to the pair that was open
    page.keyboard.press("u")
    expect(page.locator("#question")).to_contain_text("Pair 3: skipped.")
    page.keyboard.press("Escape")
    expect(page.locator("#question")).to_contain_text("Which image")
    ready(page)
    page.get_by_role("button", name="Equal").focus()
    press(page, "Enter")
    all_sent(page, 3)
    votes = booth.votes()
    assert [vote.outcome for vote in votes] == ["right", "equal", "skip", "equal"]
    assert [vote.both_miss for vote in votes] == [False, True, False, False]
    assert [vote.strength for vote in votes] == ["slightly", "", "", ""]
    assert votes[2].reason == "recognised"
    assert Vote.objects.count() == 5
    report = Report.objects.get()
    assert (report.matchup.position, report.reason) == (4, "instruction_wrong")


def test_looking_closely_by_keys_moves_both_pictures_and_is_kept_with_the_vote(
    booth: Booth,
) -> None:
    page = booth.enter()
    booth.look_ahead(page, pairs=1)
    shown = page.locator(".side img").first
    page.keyboard.down("o")
    expect(shown).to_have_attribute("alt", "The scene before the edit")
    page.keyboard.up("o")
    expect(shown).to_have_attribute("alt", "Image A, edited scene")
    page.keyboard.press("z")
    expect(page.locator("#zoom")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("Shift+ArrowRight")
    moved = [scene.get_attribute("style") for scene in page.locator(".scene").all()]
    assert moved[0] == moved[1]
    assert "scale(1.5)" in str(moved[0])
    page.keyboard.down("m")
    for key in ("ArrowRight", "ArrowRight", "ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    for reading in page.locator(".reading").all():
        expect(reading).to_have_text("3.0 m ahead, 1.0 m left (3.2 m)")
    page.keyboard.up("m")
    page.keyboard.press("g")
    expect(page.locator(".rings").first).to_be_hidden()
    page.keyboard.press("t")
    expect(page.locator("#pace")).to_have_text("")
    page.keyboard.press("0")
    assert page.locator(".scene").first.get_attribute("style") == ""
    press(page, "1")
    all_sent(page, 1)
    assert Vote.objects.get().aids == "zoom ruler flip"
    page.keyboard.press("t")
    expect(page.locator("#pace")).to_contain_text("1 done today")


def test_single_keys_can_be_switched_off_for_good(booth: Booth) -> None:
    page = booth.enter()
    page.keyboard.press("?")
    expect(page.get_by_label("Single keys work")).to_be_checked()  # the panel is there
    page.get_by_label("Single keys work").uncheck()
    expect(page.locator("#preferences-told")).to_have_text("Saved.")
    page.reload()
    ready(page)
    for key in ("1", "2", "s", "?"):
        page.keyboard.press(key)
    assert not kept(page)
    press(page, "ArrowRight")
    all_sent(page, 1)
    assert booth.outcomes() == ["right"]


def kept(page: Page) -> bool:
    """Whether a vote waits in the browser, or has come and gone."""
    waits: int = page.evaluate("localStorage.length")
    return waits > 0 or page.inner_text("#place") != str(Vote.objects.count() + 1)
