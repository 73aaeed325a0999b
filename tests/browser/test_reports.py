"""A report from the voting page: which picture, where in it, and what an admin then sees."""

import pytest
from django.urls import reverse
from playwright.sync_api import Locator, Position, expect

from arena.models import Report
from arena.people.services import create_person
from tests.browser.booth import DESK, PHONE, Booth, press
from tests.browser.test_voting_page import faults

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def place_in(panel: Locator, across: float, down: float) -> Position:
    box = panel.bounding_box()
    assert box is not None
    return Position(x=across * box["width"], y=down * box["height"])


def told(page_note: Locator) -> Report:
    expect(page_note).to_have_text("Reported, thank you.")
    return Report.objects.latest("pk")


def test_a_press_in_a_picture_marks_the_place_and_names_the_picture(booth: Booth) -> None:
    page = booth.enter(bypass_csp=True)
    page.keyboard.press("r")
    second = page.locator(".panel").nth(1)
    second.click(position=place_in(second, 0.75, 0.25))
    expect(page.locator("#report[open]")).to_be_visible()
    expect(page.get_by_role("radio", name="B", exact=True)).to_be_checked()
    drawn = page.locator(".spot:not([d=''])")
    expect(drawn).to_have_count(1)
    assert faults(page) == []
    page.get_by_role("radio", name="both").check()
    expect(drawn).to_have_count(2)
    page.get_by_role("radio", name="B", exact=True).check()
    page.keyboard.press("1")
    row = told(page.locator("#note"))
    assert (row.side, row.reason) == ("right", "picture_wrong")
    assert row.mark_x == pytest.approx(0.75, abs=0.01)
    assert row.mark_y == pytest.approx(0.25, abs=0.01)
    assert booth.votes() == []
    expect(drawn).to_have_count(0)
    # The next report starts from nothing, here and on the next pair.
    press(page, "1")
    page.keyboard.press("r")
    expect(page.get_by_role("radio", name="both")).to_be_checked()
    page.keyboard.press("3")
    row = told(page.locator("#note"))
    assert (row.side, row.mark_x, row.mark_y) == ("both", None, None)


def test_a_tap_marks_on_a_phone_and_the_admin_sees_the_mark(booth: Booth) -> None:
    page = booth.enter(viewport=PHONE, has_touch=True, is_mobile=True)
    page.locator("#report > summary").tap()
    page.get_by_role("button", name="Mark the place in an image").tap()
    first = page.locator(".panel").first
    first.tap(position=place_in(first, 0.5, 0.5))
    page.get_by_role("button", name="Something is wrong with an image").tap()
    row = told(page.locator("#note"))
    assert row.side == "left"
    assert row.mark_x == pytest.approx(0.5, abs=0.01)
    create_person(username="ada", password="a password", role="admin")
    for theme in ("light", "dark"):
        looks = {"viewport": DESK, "color_scheme": theme, "bypass_csp": True}
        path = reverse("report", args=[booth.study.code, row.key])
        office = booth.visit("ada", path, looks)
        expect(office.locator("figure.reported svg")).to_have_count(1)
        assert faults(office) == []
