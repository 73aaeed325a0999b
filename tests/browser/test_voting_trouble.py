"""Reloads, other tabs, ended sessions, closed studies: no vote is lost and none is doubled."""

import pytest
from django.contrib.sessions.models import Session
from playwright.sync_api import BrowserContext, Dialog, Page, Route, expect
from pytest_django import Settings

from arena.models import Vote
from arena.studies.services.opening import close_study
from tests import study_rows
from tests.browser.booth import Booth, all_sent, let_bounce, press, ready
from tests.held_lock import kept_busy

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True), pytest.mark.slow]
VOTES = "**/api/v1/votes"
BUSY = """
const { request } = LockManager.prototype;
LockManager.prototype.request = async function (...how) {
  await new Promise((done) => setTimeout(done, 1500));
  return request.apply(this, how);
};
"""
"""What a browser on a busy machine does: it says late that nobody else votes."""


def refuse(route: Route) -> None:
    route.abort("internetdisconnected")


def sign_in(context: BrowserContext) -> None:
    """In a tab of its own."""
    page = context.new_page()
    page.goto("/login/")
    page.fill("input[name=username]", "eva")
    page.fill("input[name=password]", "a password")
    page.get_by_role("button", name="Sign in").click()
    page.wait_for_url(lambda url: "/login/" not in url)
    page.close()


def test_a_reload_with_a_full_outbox_sends_it_first(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    asked: list[str] = []
    # Nothing goes out before the page is left, else there would be nothing to ask about.
    page.context.route(VOTES, lambda route: route.continue_() if asked else refuse(route))
    for key in "123":
        press(page, key)
    page.keyboard.press("c")

    def go_on(dialog: Dialog) -> None:
        asked.append(dialog.type)
        dialog.accept()

    page.on("dialog", go_on)
    page.reload()
    ready(page)
    assert asked == ["beforeunload"]  # only because something waited
    all_sent(page, 3)
    assert booth.outcomes() == ["left", "equal", "right"]
    assert page.inner_text("#place") == "4"
    page.keyboard.press("u")  # what was sent after the reload can be changed as well
    expect(page.locator("#question")).to_contain_text("Pair 3: B.")
    page.keyboard.press("Escape")
    page.reload()
    ready(page)
    assert asked == ["beforeunload"]


def test_votes_that_waited_survive_the_end_of_the_session(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    Session.objects.all().delete()
    press(page, "1")
    gate = page.get_by_role("dialog", name="Please sign in again")
    expect(gate).to_contain_text("1 answer is kept in this browser and sent afterwards.")
    gate.get_by_role("link", name="Sign in").click()
    page.fill("input[name=username]", "eva")
    page.fill("input[name=password]", "a password")
    page.get_by_role("button", name="Sign in").click()
    page.wait_for_url(f"**{booth.path}")
    ready(page)
    all_sent(page, 1)
    press(page, "3")
    all_sent(page, 2)
    assert booth.outcomes() == ["left", "right"]


def test_a_session_that_ended_with_no_pair_left_is_asked_for_again(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    page.context.route(VOTES, refuse)
    for _ in range(4):
        press(page, "1")
    page.keyboard.press("1")
    expect(page.locator("#veil-text")).to_have_text("Loading the next pair …")
    Session.objects.all().delete()
    page.context.unroute(VOTES)
    page.evaluate("dispatchEvent(new Event('online'))")
    gate = page.get_by_role("dialog", name="Please sign in again")
    expect(gate).to_contain_text("5 answers are kept in this browser")
    sign_in(page.context)
    page.evaluate("dispatchEvent(new Event('focus'))")
    expect(gate).to_be_hidden()
    ready(page)
    all_sent(page, 5)


def test_one_tab_votes_at_a_time(booth: Booth) -> None:
    first = booth.enter()
    second = first.context.new_page()
    second.goto(booth.path)
    gates = [
        page.get_by_role("dialog", name="Voting is open in another tab")
        for page in (first, second)
    ]
    expect(gates[1]).to_be_visible()
    second.keyboard.press("1")
    press(first, "2")
    all_sent(first, 1)
    gates[1].get_by_role("button", name="Use this one").click()
    expect(gates[0]).to_be_visible()
    ready(second)
    assert second.inner_text("#place") == "2"
    first.keyboard.press("1")
    press(second, "3")
    all_sent(second, 2)
    assert booth.outcomes() == ["equal", "right"]


def test_a_browser_that_is_slow_to_answer_is_no_other_tab(booth: Booth) -> None:
    page = booth.enter()
    page.add_init_script(BUSY)
    page.reload()
    ready(page)
    press(page, "1")
    all_sent(page, 1)


def test_back_and_forward_show_the_pair_that_is_open(booth: Booth) -> None:
    page = booth.enter()
    page.goto("/")
    page.goto(booth.path)
    ready(page)
    press(page, "1")
    press(page, "3")
    all_sent(page, 2)
    page.go_back()
    page.wait_for_url(f"{booth.address}/")
    page.go_forward()
    page.wait_for_url(f"**{booth.path}")
    ready(page)
    assert page.inner_text("#place") == "3"
    press(page, "2")
    all_sent(page, 3)
    assert booth.outcomes() == ["left", "right", "equal"]


def test_a_closing_is_said_with_what_came_too_late(booth: Booth) -> None:
    page = booth.enter()
    press(page, "1")
    all_sent(page, 1)
    booth.look_ahead(page)
    close_study(study=booth.study)
    press(page, "1")
    gate = page.get_by_role("dialog", name="This study takes no more votes")
    expect(gate).to_contain_text("1 answer came too late")
    gate.get_by_role("button", name="Go on").click()
    expect(page.get_by_role("heading", name="This study is closed")).to_be_visible()
    assert Vote.objects.count() == 1
    assert kept(page) == []


def test_a_vote_behind_a_long_writer_waits_in_the_browser_and_is_sent_again(
    booth: Booth, settings: Settings
) -> None:
    settings.VOTE_WAIT_S = 0.1
    page = booth.enter()
    booth.look_ahead(page)
    with kept_busy():
        with page.expect_response(VOTES) as refused:
            page.keyboard.press("1")
        assert refused.value.status == 503
        assert refused.value.headers["retry-after"] == "2"
        expect(page.locator("#place")).to_have_text("2")  # voting goes on
        expect(page.locator("#saved")).to_contain_text("1 answer is waiting")
        assert len(kept(page)) == 1
        assert not Vote.objects.exists()
    all_sent(page, 1)
    assert booth.outcomes() == ["left"]


def test_a_vote_that_is_not_accepted_brings_its_pair_again(booth: Booth) -> None:
    page = booth.enter()
    error = {"error": {"code": "invalid", "message": "No.", "fields": {}}}
    page.route(VOTES, lambda route: route.fulfill(status=422, json=error), times=1)
    page.keyboard.press("1")
    expect(page.locator("#note")).to_contain_text("Its pair comes again.")
    expect(page.locator("#place")).to_have_text("1")
    ready(page)
    press(page, "3")
    all_sent(page, 1)
    assert booth.outcomes() == ["right"]


def test_a_pair_whose_picture_does_not_show_takes_no_vote_until_it_does(booth: Booth) -> None:
    page = booth.enter()
    lost = [study_rows.matchups_of(booth.study, "eva")[place].left_token for place in (5, 6)]
    for token in lost:
        page.context.route(f"**/i/{token}", refuse)
    for _ in range(4):
        press(page, "1")
    page.keyboard.press("1")
    expect(page.locator("#veil-text")).to_contain_text("A picture does not show")
    let_bounce(page)
    page.keyboard.press("1")
    expect(page.get_by_role("button", name="Load it again")).to_be_visible()
    page.context.unroute(f"**/i/{lost[0]}")
    ready(page)  # it is asked for again by itself
    page.keyboard.press("2")
    expect(page.locator("#place")).to_have_text("7")
    all_sent(page, 6)
    expect(page.locator("#veil-text")).to_contain_text("A picture does not show")
    page.keyboard.press("s")
    press(page, "2")  # one that stays away can be skipped
    expect(page.locator("#skipped")).to_have_text("Skipped: 1")
    all_sent(page, 6)
    assert booth.outcomes() == [*["left"] * 5, "equal", "skip"]


def kept(page: Page) -> list[object]:
    found: list[object] = page.evaluate("Object.keys(localStorage)")
    return found
