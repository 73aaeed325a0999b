"""What once looked wrong while voting: panels, looking back, taps, and a network that is gone."""

from __future__ import annotations

from typing import Any

import pytest
from django.contrib.auth.models import User
from playwright.sync_api import Page, expect

from arena.queries.profiles import Language
from arena.services.preferences import choose_language
from tests.browser.booth import PHONE, Booth, all_sent, press, ready

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

REACHES_OUT = """pop => {
    const box = pop.lastElementChild;
    const room = parseFloat(getComputedStyle(box).paddingRight);
    const inner = box.getBoundingClientRect().right - room;
    return [...box.querySelectorAll("*")].filter(
        (one) => one.getBoundingClientRect().right > inner + 1).map((one) => one.textContent);
}"""


def in_language(booth: Booth, language: Language, **how: Any) -> Page:
    choose_language(user=User.objects.get(username="eva"), language=language)
    return booth.enter(**how)


@pytest.mark.layout
@pytest.mark.parametrize("language", list(Language))
def test_nothing_reaches_out_of_a_panel(booth: Booth, language: Language) -> None:
    page = in_language(booth, language)
    for key, name in (("s", "skip"), ("r", "report"), ("c", "comment")):
        page.keyboard.press(key)
        expect(page.locator(f"#{name}[open]")).to_be_visible()
        assert page.locator(f"#{name}").evaluate(REACHES_OUT) == []
        page.keyboard.press("Escape")


@pytest.mark.layout
@pytest.mark.parametrize("language", list(Language))
def test_looking_back_at_a_vote_moves_no_picture(booth: Booth, language: Language) -> None:
    page = in_language(booth, language)
    before = [panel.bounding_box() for panel in page.locator(".panel").all()]
    press(page, "1")
    page.keyboard.press("u")
    expect(page.locator("#leave")).to_be_visible()
    assert [panel.bounding_box() for panel in page.locator(".panel").all()] == before


def test_a_tapped_answer_does_not_stay_coloured_for_the_next_pair(booth: Booth) -> None:
    page = booth.enter(viewport=PHONE, has_touch=True, is_mobile=True)
    page.get_by_role("button", name="A is better").tap()
    expect(page.locator("#place")).to_have_text("2")
    ready(page)
    colours = {
        button.evaluate("e => getComputedStyle(e).backgroundColor")
        for button in page.locator(".answers button").all()
    }
    assert len(colours) == 1


def test_the_pointer_over_an_answer_does_not_look_like_a_choice(booth: Booth) -> None:
    page = booth.enter()
    page.get_by_role("button", name="A is better").click()
    expect(page.locator("#place")).to_have_text("2")
    ready(page)
    chosen = page.locator("#ask").evaluate(
        "e => getComputedStyle(e).getPropertyValue('--accent').trim()"
    )
    found = page.locator(".answers button").first.evaluate(
        "(e, colour) => { const made = document.createElement('i'); made.style.color = colour;"
        " document.body.append(made); const same = getComputedStyle(made).color;"
        " return getComputedStyle(e).backgroundColor === same; }",
        chosen,
    )
    assert not found


def test_offline_is_said_as_soon_as_it_is_so_and_no_longer(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    told = page.locator("#saved")
    page.context.set_offline(True)
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 0.")
    expect(page.locator("#said")).to_contain_text("Offline.")
    press(page, "1")
    expect(told).to_have_text("Offline. Kept in this browser and sent later: 1.")
    page.context.set_offline(False)
    all_sent(page, 1)
    assert booth.outcomes() == ["left"]


def test_a_server_that_answers_nothing_is_offline_too(booth: Booth) -> None:
    page = booth.enter()
    booth.look_ahead(page)
    page.context.route("**/api/v1/votes", lambda route: route.abort("connectionrefused"))
    press(page, "1")
    expect(page.locator("#saved")).to_have_text("Offline. Kept in this browser and sent later: 1.")
    page.context.unroute("**/api/v1/votes")
    page.evaluate("dispatchEvent(new Event('focus'))")
    all_sent(page, 1)
