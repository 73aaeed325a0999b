"""Three questions about each pair, by keyboard: one pair, one place, a key for each."""

import pytest
from playwright.sync_api import Page, expect

from arena.models import Study, Vote
from tests.browser.booth import Booth, all_sent, ready

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

ASKED = ["instruction", "realism", "difficulty"]


def answer(page: Page, key: str, *, then: str) -> None:
    """Press a key; `then` is the place of the pair and of the question that follow."""
    page.keyboard.press(key)
    sees(page, then)


def sees(page: Page, place: str) -> None:
    pair, step = place.split("/")
    expect(page.locator("#place")).to_have_text(pair)
    expect(page.locator("#step")).to_have_text(f"{step} of 3")
    ready(page)


def test_three_questions_by_keyboard(booth: Booth) -> None:
    Study.objects.update(questions=ASKED)
    page = booth.enter()
    sees(page, "1/1")
    picture, original = page.locator(".side img").first, page.locator("#original")
    booth.look_ahead(page)
    page.keyboard.press("Shift+O")
    before = picture.get_attribute("src")
    answer(page, "1", then="1/2")
    expect(page.locator("#question")).to_have_text("Which image is more realistic?")
    expect(page.locator("#said")).to_have_text("2 of 3. Which image is more realistic?")
    expect(original).to_have_attribute("aria-pressed", "true")
    assert picture.get_attribute("src") == before, "pictures stay"
    answer(page, "3", then="1/3")
    answer(page, "u", then="1/2")
    expect(page.locator("#question")).to_contain_text("Pair 1: B. Choose again?")
    answer(page, "2", then="1/3")
    answer(page, "1", then="2/1")
    answer(page, "1", then="2/2")
    all_sent(page, 1)
    page.reload()
    sees(page, "2/2")
    page.keyboard.press("s")
    answer(page, "1", then="3/1")
    all_sent(page, 1)
    page.keyboard.press("u")
    expect(page.locator("#question")).to_contain_text("Pair 2: skipped.")
    ready(page)
    answer(page, "3", then="2/2")
    answer(page, "2", then="2/3")
    answer(page, "2", then="3/1")
    all_sent(page, 2)
    found = [(vote.question, vote.outcome) for vote in booth.votes()]
    outcomes = ["left", "equal", "left", "right", "equal", "equal"]
    assert sorted(found[:3]) == sorted(zip(ASKED, outcomes[:3], strict=True))
    assert sorted(found[3:]) == sorted(zip(ASKED, outcomes[3:], strict=True))
    assert Vote.objects.exclude(supersedes=None).count() == 3
