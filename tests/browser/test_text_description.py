"""T shows what was changed in words, beside pictures and answers, and the vote says so."""

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect
from pytest_django.live_server_helper import LiveServer

from arena.models import Study
from tests import study_rows
from tests.browser.booth import Booth, all_sent, hang, press, ready
from tests.described import a_described_study, said_of

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


@pytest.fixture
def told(live_server: LiveServer, browser: Browser) -> Iterator[Booth]:
    """A booth whose study has the text description."""
    study = hang(a_described_study(experts=("eva",)))
    made = Booth(address=live_server.url, browser=browser, study=study)
    yield made
    made.leave()


def lists(page: Page) -> list[list[str]]:
    return [page.locator(f"#text-{side} li").all_inner_texts() for side in "ab"]


def right_for(study: Study, position: int) -> list[list[str]]:
    row = study_rows.matchups_of(study, "eva")[position - 1]
    return [said_of(row.left), said_of(row.right)]


def test_t_shows_and_hides_the_lists_and_pairs_bring_their_own(told: Booth) -> None:
    page = told.enter()
    panel = page.get_by_role("region", name="Text description")
    switch = page.get_by_role("button", name="Text T")
    expect(panel).to_be_hidden()
    expect(switch).to_have_attribute("aria-pressed", "false")
    press(page, "1")
    page.keyboard.press("t")
    expect(panel).to_be_visible()
    expect(switch).to_have_attribute("aria-pressed", "true")
    assert lists(page) == right_for(told.study, 2)
    press(page, "2")
    assert lists(page) == right_for(told.study, 3)
    expect(panel).to_be_visible()
    page.keyboard.press("u")
    ready(page)
    assert lists(page) == right_for(told.study, 2)
    page.keyboard.press("Escape")
    ready(page)
    switch.click()
    expect(panel).to_be_hidden()
    press(page, "3")
    all_sent(page, 3)
    aids = [vote.aids for vote in told.votes()]
    assert aids == ["", "text", "text"], "the third pair came while the lists were open"
    press(page, "1")
    all_sent(page, 4)
    assert told.votes()[3].aids == ""


def test_arrows_scroll_the_lists_that_have_the_focus_and_do_not_vote(told: Booth) -> None:
    first = study_rows.matchups_of(told.study, "eva")[0]
    first.descriptions = [side * 40 for side in first.descriptions or []]
    first.save()
    page = told.enter()
    page.keyboard.press("t")
    panel = page.get_by_role("region", name="Text description")
    panel.focus()
    page.keyboard.press("ArrowDown")
    page.wait_for_function("() => document.querySelector('#text > div').scrollTop > 0")
    assert page.inner_text("#place") == "1"
    press(page, "2")
    all_sent(page, 1)
