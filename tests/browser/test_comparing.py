"""X holds B in the place of A, V shows what only one of them has, a zoomed picture has a scale."""

import pytest
from playwright.sync_api import expect

from augment.models import Augmentation
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_picture, load_camera
from augment.services.scenarios.scenes import LoadedScenario
from tests.browser.booth import Booth, all_sent, press
from tests.scenes import vehicle
from tests.study_rows import a_study, hang

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

ADDRESSES = "() => [...document.querySelectorAll('.side img')].map((image) => image.src)"
# How many pixels of the first canvas are about orange, and how many about blue.
MARKED = """() => {
  const canvas = document.querySelector(".side canvas");
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const found = [0, 0];
  for (let at = 0; at < data.length; at += 4) {
    if (data[at] === 190 && data[at + 2] === 0) found[0] += 1;
    if (data[at] === 0 && data[at + 2] === 200) found[1] += 1;
  }
  return found;
}"""


@pytest.fixture
def drawn(bare_booth: Booth) -> Booth:
    """A booth with drawn pictures: every contestant has put a car in another place."""
    study = a_study(scenarios=3, votes_per_expert=3, experts=("eva",))
    places = {slug: 8.0 + 6.0 * n for n, slug in enumerate(("ann", "bob", "cid"))}
    for row in Augmentation.objects.select_related("scenario", "contestant"):
        car = vehicle("New1", places[row.contestant.slug], 0.0)
        camera = load_camera(row.scenario)
        loaded = LoadedScenario(row.scenario)
        hang(row, draw_picture(loaded, Modification(added=(car,)), camera))
        unchanged = draw_picture(loaded, Modification(), camera)
        row.scenario.matchups.update(original_image=unchanged)
    bare_booth.study = study
    return bare_booth


def test_x_holds_b_in_the_place_of_a_and_v_marks_what_differs(drawn: Booth) -> None:
    page = drawn.enter()
    a, b = page.evaluate(ADDRESSES)
    page.keyboard.down("x")
    expect(page.locator(".reading").first).to_have_text("B stands in both places")
    assert page.evaluate(ADDRESSES) == [b, b]
    page.keyboard.up("x")
    expect(page.locator(".reading").first).to_have_text("")
    assert page.evaluate(ADDRESSES) == [a, b]
    page.keyboard.press("v")
    expect(page.locator(".side canvas")).to_have_count(2)
    orange, blue = page.evaluate(MARKED)
    assert min(orange, blue) > 500
    assert 0.5 < orange / blue < 2.0
    page.keyboard.press("v")
    expect(page.locator(".side canvas")).to_have_count(0)
    page.keyboard.press("z")
    expect(page.locator(".side .scale-bar").first).to_be_visible()
    press(page, "1")
    page.keyboard.press("v")
    expect(page.locator(".side canvas")).to_have_count(2)
    press(page, "1")
    expect(page.locator(".side canvas")).to_have_count(0)
    all_sent(page, 2)
    assert [vote.aids for vote in drawn.votes()] == ["zoom blink difference", "difference"]
