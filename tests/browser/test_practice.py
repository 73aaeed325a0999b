"""The practice round in a browser: on every size of window."""

import pytest
from django.contrib.auth.models import User
from playwright.sync_api import expect

from arena.voting.services.practice import practice_pairs
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_checks, store
from tests.browser.booth import DESK, PHONE, Booth
from tests.browser.test_voting_page import faults
from tests.scenes import vehicle
from tests.study_rows import KINDS, contestant, picture
from tests.web.cast import png

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]
LOOKS = (("light", PHONE), ("dark", DESK))


@pytest.fixture
def wanted(booth: Booth) -> Booth:
    """The study of the booth with a practice round, on its own scenarios."""
    right = modification_to_document(Modification(added=(vehicle("car", 12.0, 1.0),)))
    Scenario.objects.update(reference=right)
    reference = contestant("reference", KINDS.REFERENCE)
    made = [picture(place, reference) for place in Scenario.objects.all()]
    made += draw_checks(scenarios=list(Scenario.objects.values_list("slug", flat=True)))
    for number, row in enumerate(made):
        image = store(png(100 + number, width=4, height=1))
        Augmentation.objects.filter(pk=row.pk).update(image=image)
    booth.study.practice = True
    booth.study.save()
    return booth


def test_practice_is_answered_by_the_keys_that_answer_pairs(wanted: Booth) -> None:
    page = wanted.visit("eva", wanted.path, {})
    pair = practice_pairs(wanted.study, User.objects.get(username="eva"))[0]
    expect(page.locator(".answers kbd:visible")).to_have_count(3)
    page.wait_for_load_state("networkidle")
    page.keyboard.press("1" if pair.good_is_left else "3")
    expect(page.locator("#feedback-title")).to_contain_text("Right.")
    page.keyboard.press("Enter")
    expect(page.locator("#question")).to_contain_text("Practice 2 of 5.")


@pytest.mark.parametrize(("theme", "size"), LOOKS)
def test_practice_is_whole_on_every_window_and_axe_finds_nothing(
    wanted: Booth, theme: str, size: dict[str, int]
) -> None:
    looks = {"viewport": size, "color_scheme": theme, "bypass_csp": True}
    page = wanted.visit("eva", wanted.path, looks)
    for step in ("question", "feedback"):
        assert faults(page) == [], step
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
        for box in [panel.bounding_box() for panel in page.locator(".panel").all()]:
            assert box is not None
            assert box["width"] > 300
        if step == "question":
            page.get_by_role("button", name="Equal").click()
            expect(page.locator("#feedback-title")).to_contain_text("Not quite.")
    page.get_by_role("link", name="Next practice pair").click()
    page.get_by_role("button", name="Skip the practice").click()
    expect(page.locator("#place")).to_have_text("1")
