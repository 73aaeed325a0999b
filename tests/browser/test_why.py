"""What is wrong, in studies that ask it: by a click and by keys, before an answer and after it."""

import pytest
from playwright.sync_api import expect

from arena.models import Study, Vote
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from tests.browser.booth import Booth, all_sent, let_bounce, press
from tests.browser.test_voting_page import faults
from tests.scenes import vehicle

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_an_object_is_marked_before_an_answer_or_after_it_and_goes_with_the_vote(
    booth: Booth,
) -> None:
    cars = (vehicle("near", 5.0, -1.0), vehicle("far", 22.0, 2.0))
    Augmentation.objects.update(modification=modification_to_document(Modification(added=cars)))
    Study.objects.update(ask_why=True)
    page = booth.enter(bypass_csp=True)
    image = page.locator(".scene").nth(1).bounding_box()
    assert image is not None
    scale = image["width"] / 1200.0  # as VIEW has it: 20 px a metre, the ego at 300, 150
    across, down = (300.0 + 20.0 * 22.0) * scale, (150.0 - 20.0 * 2.0) * scale
    page.mouse.click(image["x"] + across, image["y"] + down)
    expect(page.locator("#why-of")).to_have_text("What is wrong in B, object 2 of 2?")
    assert faults(page) == []
    page.keyboard.press("2")
    expect(page.locator(".why text")).to_have_text("Heading")
    press(page, "1")
    all_sent(page, 1)
    assert booth.votes()[0].faults == [["right", "far", "heading"]]
    expect(page.locator(".why text")).to_have_count(0)
    # After the answer, by keys alone: the second object, after the first.
    page.keyboard.press("u")
    expect(page.locator(".why text")).to_have_text("Heading")
    let_bounce(page)
    page.keyboard.press("w")
    expect(page.locator("#why-of")).to_have_text("What is wrong in A, object 1 of 2?")
    page.keyboard.press("w")
    with page.expect_response("**/api/v1/votes"):
        page.keyboard.press("1")
    expect(page.locator("#place")).to_have_text("2")
    (vote,) = booth.votes()
    assert sorted(vote.faults) == [["left", "far", "position"], ["right", "far", "heading"]]
    first = Vote.objects.get(superseded_by=vote)
    assert (
        (vote.outcome, vote.ms_visible)
        == (first.outcome, first.ms_visible)
        == ("left", first.ms_visible)
    )
