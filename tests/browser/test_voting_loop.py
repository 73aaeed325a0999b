"""Votes are cast as fast as a person can and kept once, whatever the network does."""

import pytest
from playwright.sync_api import Page, expect
from pytest_django import Settings

from arena.models import Vote
from arena.voting import screen
from tests import study_rows
from tests.browser.booth import BOUNCE_MS, Booth, all_sent, furnish, let_bounce, press, ready
from tests.browser.test_voting_page import faults

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

ANSWERS = {"1": "left", "2": "equal", "3": "right"}


@pytest.mark.slow
def test_fifty_votes_with_the_network_cut_twice_are_fifty_rows(
    bare_booth: Booth, settings: Settings
) -> None:
    settings.VOTES_PER_S = 100  # nobody holds the test back
    booth = bare_booth
    booth.study = furnish(scenarios=20, votes=50)
    page = booth.enter()
    given = []
    for number in range(50):
        if number in (12, 31):
            all_sent(page, number)
            booth.look_ahead(page)
            page.context.set_offline(True)
        if number in (16, 35):  # the four that were ready are voted; nothing is lost
            assert Vote.objects.count() == number - 4
            page.context.set_offline(False)
        key = "123"[number % 3]
        given.append(ANSWERS[key])
        if number < 49:
            press(page, key)
            if number == 39:
                expect(page.locator("#pause")).to_contain_text("40 pairs in")
                page.get_by_role("button", name="Go on").click()
        else:
            page.keyboard.press(key)
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    assert Vote.objects.count() == 50
    assert booth.outcomes() == given
    assert len({vote.matchup_id for vote in booth.votes()}) == 50


def test_a_held_key_is_one_vote(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page, pairs=2)
    hold_down(page, "1")
    all_sent(page, 1)
    assert booth.outcomes() == ["left"]


def hold_down(page: Page, key: str) -> None:
    """Until the next pair takes an answer, and on; from the second on the presses are repeats."""
    page.keyboard.down(key)
    expect(page.locator("#place")).to_have_text("2")
    ready(page)
    for _ in range(3):
        page.keyboard.down(key)
    page.keyboard.up(key)
    assert page.inner_text("#place") == "2"


def test_the_second_half_of_a_double_click_judges_nothing(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page, pairs=3)
    page.clock.install()  # from here on the page's time passes as the test says
    page.clock.pause_at(page.evaluate("Date.now() / 1000 + 3600"))
    button = page.get_by_role("button", name="Equal")
    button.click()
    page.clock.run_for(BOUNCE_MS - 30)  # of which the next pair was painted for less
    button.click()
    assert page.inner_text("#place") == "2"
    page.clock.run_for(BOUNCE_MS)
    button.click()
    expect(page.locator("#place")).to_have_text("3")
    page.clock.resume()
    all_sent(page, 2)
    assert booth.outcomes() == ["equal"] * 2


def test_the_next_four_pairs_are_there_before_they_are_needed(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    told = page.locator("#saved")
    page.context.set_offline(True)
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 0.")
    expect(page.locator("#said")).to_contain_text("Offline.")
    for _ in range(4):
        press(page, "1")
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 4.")
    page.context.set_offline(False)
    all_sent(page, 4)


def test_the_end_is_the_page_of_thanks_and_the_last_vote_can_still_be_changed(
    booth: Booth,
) -> None:
    for matchup in study_rows.matchups_of(booth.study, "eva")[:8]:
        study_rows.vote(matchup)
    page = booth.enter()
    page.keyboard.press("3")
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    page.get_by_role("link", name="Pair 9").click()
    ready(page)
    expect(page.locator("#question")).to_contain_text("Pair 9: B.")
    page.keyboard.press("1")
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    assert booth.outcomes()[-1] == "left"
    assert Vote.objects.count() == 10


def test_the_first_vote_counts_where_the_pair_was_decided_elsewhere(booth: Booth) -> None:
    page = booth.enter()
    study_rows.vote(study_rows.matchups_of(booth.study, "eva")[0], "right")
    press(page, "1")
    expect(page.locator("#note")).to_contain_text("your first vote counts: B.")
    assert booth.outcomes() == ["right"]


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
    ready(page)
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
    ready(page)
    page.keyboard.press("3")
    all_sent(page, 3)
    expect(page.locator("#skipped")).to_be_hidden()
    expect(page.locator("#place")).to_have_text("4")
    assert sorted(booth.outcomes()) == ["left", "left", "right"]
