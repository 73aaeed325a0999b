"""T shows what was changed in words, beside pictures and answers, and the vote says so."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from django.contrib.auth.models import User
from playwright.sync_api import Browser, Page, expect
from pytest_django.live_server_helper import LiveServer

from arena.models import Study, Vote
from arena.services.preferences import keep_voting
from tests import study_rows
from tests.browser.booth import PHONE, Booth, all_sent, hang, press, ready
from tests.browser.test_voting_page import faults
from tests.described import a_described_study, said_of

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
COVERED = """button => {
    const { left, top, width, height } = button.getBoundingClientRect();
    return !button.contains(document.elementFromPoint(left + width / 2, top + height / 2));
}"""
SCROLLS = """() => document.documentElement.scrollHeight > innerHeight
    || document.documentElement.scrollWidth > innerWidth"""


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


def test_where_its_key_was_given_away_the_keys_can_still_be_saved(told: Booth) -> None:
    keep_voting(user=User.objects.get(username="eva"), switches={}, keys={"zoom": "t"})
    page = told.enter()
    page.keyboard.press("h")
    own = page.locator("#keys")
    expect(own.get_by_label("Text description")).to_have_value("")
    own.get_by_role("button", name="Save").click()
    expect(page.locator("#keys-told")).to_have_text("Saved.")


def test_with_other_aids_it_keeps_its_place_in_the_list(told: Booth) -> None:
    page = told.enter()
    for key in ("t", "z", "t"):
        page.keyboard.press(key)
    press(page, "1")
    all_sent(page, 1)
    assert Vote.objects.get().aids == "zoom text"


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


@pytest.mark.layout
@pytest.mark.parametrize("size", [(1280, 720), (1366, 650), (1920, 1080)])
def test_open_or_closed_nothing_scrolls_or_moves_and_every_button_is_free(
    told: Booth, size: tuple[int, int]
) -> None:
    first = study_rows.matchups_of(told.study, "eva")[0]
    first.descriptions = [side * 40 for side in first.descriptions or []]
    first.save()
    page = told.enter(viewport={"width": size[0], "height": size[1]})
    closed = [panel.bounding_box() for panel in page.locator(".panel, .answers, .tools").all()]
    assert not page.evaluate(SCROLLS)
    page.keyboard.press("t")
    assert len(lists(page)[0]) == 40
    assert not page.evaluate(SCROLLS)
    opened = [panel.bounding_box() for panel in page.locator(".panel, .answers, .tools").all()]
    assert opened == closed
    for button in page.locator(".answers button, .tools .button:visible").all():
        assert not button.evaluate(COVERED), button.inner_text()
    page.keyboard.press("s")
    expect(page.locator("#skip[open]")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#skip[open]")).to_be_hidden()
    expect(page.locator("#text > div")).to_be_visible()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_nothing_with_the_lists_open(told: Booth, theme: str) -> None:
    page = told.enter(color_scheme=theme, bypass_csp=True)
    assert faults(page) == []
    page.keyboard.press("t")
    assert faults(page) == []


@pytest.mark.layout
def test_a_phone_shows_the_lists_below_the_pictures(told: Booth) -> None:
    page = told.enter(viewport=PHONE, has_touch=True, is_mobile=True)
    page.locator("#text-switch").tap()
    panel, picture = page.locator("#text > div"), page.locator(".panel").last
    expect(panel).to_be_visible()
    below, above = panel.bounding_box(), picture.bounding_box()
    assert below is not None
    assert above is not None
    assert below["y"] >= above["y"] + above["height"]
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    assert not page.get_by_role("button", name="A is better").evaluate(COVERED)


def test_without_a_script_the_same_lists_open_by_themselves(told: Booth) -> None:
    page = told.enter(java_script_enabled=False)
    page.get_by_text("Text description").first.click()
    expect(page.get_by_role("region", name="Text description")).to_be_visible()
    assert lists(page) == right_for(told.study, 1)
    for name in ("A is better", "Equal", "B is better"):
        assert not page.get_by_role("button", name=name).evaluate(COVERED)
    page.get_by_role("button", name="A is better").click()
    page.get_by_text("Text description").first.click()
    assert lists(page) == right_for(told.study, 2)


def test_its_key_can_be_changed_and_gives_way_to_another(told: Booth) -> None:
    page = told.enter()
    page.keyboard.press("h")
    own = page.locator("#keys")
    own.locator("input[name=text]").fill("k")
    own.get_by_role("button", name="Save").click()
    expect(page.locator("#keys-told")).to_have_text("Saved.")
    page.keyboard.press("Escape")
    page.keyboard.press("t")
    expect(page.locator("#text > div")).to_be_hidden()
    page.keyboard.press("k")
    expect(page.locator("#text > div")).to_be_visible()


def test_an_account_that_gave_t_to_the_zoom_has_the_button_alone(told: Booth) -> None:
    person = study_rows.matchups_of(told.study, "eva")[0].expert.person
    person.preferences = {"voting": {"keys": {"zoom": "t"}}}
    person.save()
    page = told.enter()
    page.keyboard.press("t")
    expect(page.locator("#text > div")).to_be_hidden()
    expect(page.locator(".panel").first).to_have_class("panel is-zoomed")
    expect(page.locator("#text-switch kbd")).to_be_hidden()
    page.locator("#text-switch").click()
    expect(page.locator("#text > div")).to_be_visible()


def test_where_the_study_has_none_t_does_nothing(booth: Booth) -> None:
    page = booth.enter()
    page.keyboard.press("t")
    assert page.locator("#text, #text-switch, [data-key=text], [name=text]").count() == 0
    press(page, "1")
    all_sent(page, 1)
    assert Vote.objects.get().aids == ""
