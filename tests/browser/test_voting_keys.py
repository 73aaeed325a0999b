"""Everything goes by keys alone, and no key votes by accident: answers, aids, faults."""

import pytest
from playwright.sync_api import Page, expect

from arena.models import Report, Study, Vote
from augment.models import Augmentation
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.pictures import draw_picture, load_camera, picture_view
from augment.services.scenarios.scenes import LoadedScenario
from tests.browser import booth as booths
from tests.browser.booth import Booth, all_sent, let_bounce, press, ready
from tests.browser.test_voting_page import faults
from tests.scenes import vehicle
from tests.study_rows import a_study, hang
from tests.web.test_voting import a_replayed_study

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


def test_every_vote_key_means_what_the_help_says(booth: Booth) -> None:
    page = booth.enter()
    for key in ("1", "ArrowLeft", "a", "2", "ArrowDown", "e", "3", "ArrowRight"):
        press(page, key)
    page.keyboard.press("b")
    expect(page.get_by_role("heading", name="You are done.")).to_be_visible()
    assert booth.outcomes() == [*["left"] * 3, *["equal"] * 3, *["right"] * 3]


@pytest.mark.slow
def test_no_modified_key_votes_and_none_while_typing(booth: Booth) -> None:
    page = booth.enter()
    for key in ("Control+1", "Alt+2", "Meta+3", "Shift+A", "Shift+ArrowLeft", "Shift+Digit2"):
        page.keyboard.press(key)
    page.keyboard.press("c")
    page.keyboard.type("1 and 2 abe")
    page.keyboard.press("Control+Enter")
    page.keyboard.press("h")
    expect(page.get_by_role("dialog", name="How to vote")).to_be_visible()
    page.keyboard.press("2")
    page.keyboard.press("Escape")
    assert not kept(page)
    press(page, "3")
    all_sent(page, 1)
    vote = Vote.objects.get()
    assert (vote.outcome, vote.comment) == ("right", "1 and 2 abe")


def test_the_whole_loop_without_a_mouse(booth: Booth) -> None:
    booth.study.allow_both_miss = booth.study.ask_strength = True
    booth.study.save()
    page = booth.enter()
    press(page, "Shift+Digit1")
    press(page, "4")
    page.keyboard.press("s")
    press(page, "4")  # the fourth reason
    page.keyboard.press("r")
    page.keyboard.press("2")
    expect(page.locator("#note")).to_have_text("Reported, thank you.")
    page.keyboard.press("u")
    page.keyboard.press("Backspace")
    page.keyboard.press("Control+z")
    expect(page.locator("#question")).to_contain_text("Pair 1: A, clearly.")
    expect(page.get_by_role("button", name="A clearly")).to_have_attribute("aria-pressed", "true")
    ready(page)
    press(page, "3")  # replaces it and returns to the pair that was open
    page.keyboard.press("u")
    expect(page.locator("#question")).to_contain_text("Pair 3: skipped.")
    page.keyboard.press("Escape")
    expect(page.locator("#question")).to_contain_text("Which image")
    ready(page)
    page.get_by_role("button", name="Equal").focus()
    press(page, "Enter")
    all_sent(page, 3)
    votes = booth.votes()
    assert [vote.outcome for vote in votes] == ["right", "equal", "skip", "equal"]
    assert [vote.both_miss for vote in votes] == [False, True, False, False]
    assert [vote.strength for vote in votes] == ["slightly", "", "", ""]
    assert votes[2].reason == "recognised"
    assert Vote.objects.count() == 5
    report = Report.objects.get()
    assert (report.matchup.position, report.reason) == (4, "instruction_wrong")


def test_looking_closely_by_keys_moves_both_pictures_and_is_kept_with_the_vote(
    booth: Booth,
) -> None:
    page = booth.enter()
    booth.look_ahead(page, pairs=1)
    shown = page.locator(".side img").first
    page.keyboard.down("o")
    expect(shown).to_have_attribute("alt", "The scene before the edit")
    page.keyboard.up("o")
    expect(shown).to_have_attribute("alt", "Image A, edited scene")
    page.keyboard.press("z")
    expect(page.locator("#zoom")).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("Shift+ArrowRight")
    moved = [scene.get_attribute("style") for scene in page.locator(".scene").all()]
    assert moved[0] == moved[1]
    assert "scale(1.5)" in str(moved[0])
    page.keyboard.down("m")
    for key in ("ArrowRight", "ArrowRight", "ArrowRight", "ArrowUp"):
        page.keyboard.press(key)
    for reading in page.locator(".reading").all():
        expect(reading).to_have_text("3.0 m ahead, 1.0 m left (3.2 m)")
    page.keyboard.up("m")
    page.keyboard.press("g")
    expect(page.locator(".rings").first).to_be_hidden()
    page.keyboard.press("t")
    expect(page.locator("#pace")).to_have_text("")
    page.keyboard.press("0")
    assert page.locator(".scene").first.get_attribute("style") == ""
    press(page, "1")
    all_sent(page, 1)
    assert Vote.objects.get().aids == "zoom ruler flip"
    page.keyboard.press("t")
    expect(page.locator("#pace")).to_contain_text("1 done today")


@pytest.mark.slow
def test_single_keys_can_be_switched_off_for_good(booth: Booth) -> None:
    page = booth.enter()
    page.keyboard.press("?")
    expect(page.get_by_label("Single keys work")).to_be_checked()  # the panel is there
    page.get_by_label("Single keys work").uncheck()
    expect(page.locator("#preferences-told")).to_have_text("Saved.")
    page.reload()
    ready(page)
    for key in ("1", "2", "s", "?"):
        page.keyboard.press(key)
    assert not kept(page)
    press(page, "ArrowRight")
    all_sent(page, 1)
    assert booth.outcomes() == ["right"]


def kept(page: Page) -> bool:
    """Whether a vote waits in the browser, or has come and gone."""
    waits: int = page.evaluate("localStorage.length")
    return waits > 0 or page.inner_text("#place") != str(Vote.objects.count() + 1)


ASKED = ["instruction", "realism", "difficulty"]


def answer_one(page: Page, key: str, *, then: str) -> None:
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
    answer_one(page, "1", then="1/2")
    expect(page.locator("#question")).to_have_text("Which image is more realistic?")
    expect(page.locator("#said")).to_have_text("2 of 3. Which image is more realistic?")
    expect(original).to_have_attribute("aria-pressed", "true")
    assert picture.get_attribute("src") == before, "pictures stay"
    answer_one(page, "3", then="1/3")
    answer_one(page, "u", then="1/2")
    expect(page.locator("#question")).to_contain_text("Pair 1: B. Choose again?")
    answer_one(page, "2", then="1/3")
    answer_one(page, "1", then="2/1")
    answer_one(page, "1", then="2/2")
    all_sent(page, 1)
    page.reload()
    sees(page, "2/2")
    page.keyboard.press("s")
    answer_one(page, "1", then="3/1")
    all_sent(page, 1)
    page.keyboard.press("u")
    expect(page.locator("#question")).to_contain_text("Pair 2: skipped.")
    ready(page)
    answer_one(page, "3", then="2/2")
    answer_one(page, "2", then="2/3")
    answer_one(page, "2", then="3/1")
    all_sent(page, 2)
    found = [(vote.question, vote.outcome) for vote in booth.votes()]
    outcomes = ["left", "equal", "left", "right", "equal", "equal"]
    assert sorted(found[:3]) == sorted(zip(ASKED, outcomes[:3], strict=True))
    assert sorted(found[3:]) == sorted(zip(ASKED, outcomes[3:], strict=True))
    assert Vote.objects.exclude(supersedes=None).count() == 3


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


SCALE_PX = [8, 8, 60, 30]
"""Where the drawn pictures have their own scale."""


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
        view = picture_view(camera) | {"covered_px": [SCALE_PX]}
        row.scenario.matchups.update(original_image=unchanged, view=view)
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
    page.locator(".side .panel").first.hover(position={"x": 2, "y": 2})
    page.mouse.wheel(0, -50)  # the picture's own scale stays in sight
    expect(page.locator(".side .scale-bar")).to_have_count(2)
    expect(page.locator(".side .scale-bar").first).to_be_hidden()
    page.keyboard.press("z")
    page.keyboard.press("z")
    expect(page.locator(".side .scale-bar").first).to_be_visible()
    press(page, "1")
    page.keyboard.press("v")
    expect(page.locator(".side canvas")).to_have_count(2)
    press(page, "1")
    expect(page.locator(".side canvas")).to_have_count(0)
    all_sent(page, 2)
    assert [vote.aids for vote in drawn.votes()] == ["zoom blink difference", "difference"]


@pytest.fixture
def played(bare_booth: Booth) -> Booth:
    """A booth whose study plays drives."""
    bare_booth.study = booths.hang(a_replayed_study(experts=("eva",)))
    return bare_booth


def picture_of(page: Page, number: int) -> str:
    shown = page.locator(".side canvas").nth(number).evaluate("canvas => canvas.toDataURL()")
    return str(shown)


def test_d_plays_both_drives_in_step_and_the_next_pair_ends_it(played: Booth) -> None:
    page = played.enter(reduced_motion="reduce")
    switch = page.locator("#replay-switch")
    assert not page.evaluate("performance.getEntriesByType('resource')").count("film")
    page.keyboard.press("d")
    expect(page.locator(".side canvas")).to_have_count(2)
    expect(switch).to_have_attribute("aria-pressed", "true")
    first = [picture_of(page, number) for number in (0, 1)]
    time = page.get_by_role("slider", name="Time")
    # On the page an arrow would vote; here it moves in time.
    time.focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator(".replay-bar output")).to_have_text("0.1 s")
    assert [picture_of(page, n) != first[n] for n in (0, 1)] == [True, True]
    page.get_by_role("button", name="Play").click()
    expect(page.locator(".replay-bar output")).to_have_text("1.2 s")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.locator("body").click(position={"x": 5, "y": 400})
    press(page, "1")
    expect(page.locator(".side canvas")).to_have_count(0)
    expect(switch).to_have_attribute("aria-pressed", "false")
    press(page, "3")
    all_sent(page, 2)
    assert [vote.aids for vote in played.votes()] == ["replay", ""]
