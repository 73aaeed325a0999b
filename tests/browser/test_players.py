"""What moves: drives in the player, and pairs voted on by keys alone, both sides in step."""

from typing import Any

import pytest
from django.urls import reverse
from playwright.sync_api import Page, expect

from augment.models import Augmentation, Simulation
from tests.browser.booth import TOO_WIDE, Booth, press
from tests.browser.test_voting_page import faults
from tests.drives import driven, finished
from tests.jobs import rows
from tests.moving import a_moving_study
from tests.web.cast import people

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


FILMS = "canvas.reel:not([hidden])"

EGO_X = """() => [...document.querySelectorAll("canvas.reel")].map((canvas) => {
    const { width, height } = canvas;
    const { data } = canvas.getContext("2d").getImageData(0, 0, width, height);
    let most = 0;
    for (let at = 0; at < data.length; at += 4) {
        const isRed = data[at] === 218 && data[at + 1] === 30 && data[at + 2] === 40;
        if (isRed) most = Math.max(most, (at / 4) % width);
    }
    return most;
})"""
"""How far the ego has come on either side, in dots of the canvas."""

RINGED = """() => [...document.querySelectorAll("canvas.reel-hint")].map((canvas) => {
    const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
    return data.filter((_, at) => at % 4 === 0 && data[at] === 181 && data[at + 3] === 255).length;
})"""
"""The dots of the rings over either still."""

WINDOW_M = """() => JSON.parse(document.getElementById("given").textContent).pairs.map(
    ({ width, px_per_m: scale }) => width / scale)[0]"""


CUT = """() => [...document.querySelectorAll(".vote .button")].filter(
    (one) => one.scrollWidth > one.clientWidth).map((one) => one.innerText)"""
"""The buttons whose words are wider than they are."""


@pytest.fixture
def moving(bare_booth: Booth) -> Booth:
    bare_booth.study = a_moving_study(scenarios=3, votes=9)
    return bare_booth


def test_both_sides_move_in_step_by_keys_and_by_the_range(moving: Booth) -> None:
    page = moving.enter()
    clock = page.locator(".film-bar output")
    expect(page.locator(FILMS)).to_have_count(2)  # loaded, and begun by themselves
    page.keyboard.press("p")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    time = page.get_by_role("slider", name="Time")
    time.fill("10")
    assert clock.inner_text() == "1.0 s"
    at_1_s = page.evaluate(EGO_X)
    page.keyboard.press(".")
    page.keyboard.press("k")
    assert clock.inner_text() == "1.2 s"
    later = page.evaluate(EGO_X)
    # 8 m/s for 0.2 s, at so many dots a metre.
    dots = page.evaluate("() => document.querySelector('canvas.reel').width")
    dots_per_m = dots / float(page.evaluate(WINDOW_M))
    assert [b - a for a, b in zip(at_1_s, later, strict=True)] == pytest.approx(
        [1.6 * dots_per_m] * 2, abs=3
    )
    assert at_1_s[0] == at_1_s[1]
    page.keyboard.press(",")
    assert clock.inner_text() == "1.1 s"
    page.keyboard.press("f")
    expect(page.get_by_role("button", name="0.5×")).to_be_visible()
    time.focus()
    page.keyboard.press("Home")  # here it moves in time; the stills stand at its start
    expect(page.locator(FILMS)).to_have_count(0)
    assert moving.outcomes() == []


def test_films_begin_by_themselves_at_once_and_go_with_their_pair(moving: Booth) -> None:
    page = moving.enter()
    expect(page.locator(FILMS)).to_have_count(2)
    vote_and_wait(page)
    expect(page.locator(FILMS)).to_have_count(2)
    page.keyboard.down("o")  # the scene before the edit, which is a still
    expect(page.locator("canvas.reel").first).to_be_hidden()
    page.keyboard.up("o")
    expect(page.locator(FILMS).first).to_be_visible()


@pytest.mark.slow
def test_the_range_says_who_sets_out_when_and_the_last_moment_stays(moving: Booth) -> None:
    starts = {"ann": ["0.5"], "bob": [], "cid": ["2.0"]}  # as `a_moving_study` has it
    page = moving.enter()
    expect(page.locator(FILMS)).to_have_count(2)
    pair = moving.study.matchups.get(position=1)
    said = [
        f"{side} {start_s} s"
        for side, row in (("A", pair.left), ("B", pair.right))
        for start_s in starts[row.contestant.slug]
    ]
    time = page.get_by_role("slider", name="Time")
    expect(time).to_have_attribute("title", f"Begins to move: {', '.join(said)}")
    expect(page.locator(".film-time i")).to_have_count(len(said))
    page.keyboard.press("p")
    time.fill("59")
    page.keyboard.press("p")
    expect(page.get_by_role("button", name="Play")).to_be_visible()  # it came to its end
    assert page.inner_text(".film-bar output") == "6.0 s"
    expect(page.locator(FILMS)).to_have_count(2)


@pytest.mark.slow
def test_less_motion_gets_stills_until_somebody_plays(moving: Booth) -> None:
    page = moving.enter(reduced_motion="reduce")
    expect(page.locator(".film-bar")).to_be_visible()
    vote_and_wait(page)
    assert page.locator(FILMS).count() == 0
    hints = page.locator("canvas.reel-hint:not([hidden])")
    expect(hints).to_have_count(2)
    for number in range(2):
        assert "clip-path" in str(hints.nth(number).get_attribute("style")), "not over the scale"
    dots = page.evaluate(RINGED)
    assert min(dots) > 300, "round what is changed"
    pair = moving.study.matchups.get(position=2)
    for row, ringed in zip((pair.left, pair.right), dots, strict=True):
        if row.contestant.slug == "bob":  # whose car stands
            assert ringed == min(dots) < max(dots), "of the other the ego as well, when it starts"
    page.keyboard.press(".")
    expect(page.locator(FILMS)).to_have_count(2)
    expect(hints).to_have_count(0)
    assert page.inner_text(".film-bar output") == "0.1 s"


@pytest.mark.slow
@pytest.mark.parametrize("width", [390, 1280])
def test_the_bar_can_be_used_by_everybody_and_fits(moving: Booth, width: int) -> None:
    page = moving.enter(viewport={"width": width, "height": 800}, bypass_csp=True)
    expect(page.locator(".film-bar")).to_be_visible()
    assert page.evaluate(TOO_WIDE) <= 0
    assert faults(page) == []
    page.add_style_tag(content="html { font-size: 200% }")
    assert page.evaluate(TOO_WIDE) <= 0
    assert page.evaluate(CUT) == []


@pytest.mark.slow
def test_on_other_pages_the_first_press_loads_and_does_what_its_button_says(moving: Booth) -> None:
    people()
    result = Augmentation.objects.filter(contestant__slug="ann")[0]
    page = moving.visit("the-admin", reverse("augmentation", args=[result.code]), {})
    page.get_by_role("button", name="A tenth of a second on").click()
    expect(page.locator(".film-bar output")).to_have_text("0.1 s")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    page.reload()
    page.get_by_role("slider", name="Time").fill("10")
    expect(page.locator(".film-bar output")).to_have_text("1.0 s")


def vote_and_wait(page: Page) -> None:
    """Vote, and wait until the films of the next pair lie over its stills."""
    page.evaluate(
        "() => document.querySelectorAll('canvas.reel').forEach((one) => { one.id = 'old'; })"
    )
    press(page, "1")
    expect(page.locator("#old")).to_have_count(0)
    expect(page.locator("canvas.reel")).to_have_count(2)


def opened(booth: Booth, row: Simulation, **options: Any) -> Page:
    """The page of a drive, as a researcher sees it, with its traces loaded."""
    people()
    page = booth.visit("the-researcher", reverse("drive", args=[row.code]), options)
    expect(page.locator("#player[data-ready]")).to_be_attached()
    return page


def picture(page: Page, number: int) -> str:
    """What a canvas shows."""
    shown = page.locator("canvas").nth(number).evaluate("canvas => canvas.toDataURL()")
    return str(shown)


def test_the_player_fits_a_small_laptop(bare_booth: Booth) -> None:
    row, laptop = driven(finished(rows.launch()))[-1], {"width": 1366, "height": 768}
    page = opened(bare_booth, row, viewport=laptop)
    for number in (2, 1):  # before beside after, then one drive alone
        end = page.locator("#timeline").bounding_box()
        assert end is not None
        assert end["y"] + end["height"] <= laptop["height"], f"{number} drives"
        page.evaluate("document.querySelector('.views').className = 'views'")
        page.locator(".views figure").first.evaluate("figure => figure.remove()")


def test_both_drives_are_played_stepped_and_scrubbed_in_step(bare_booth: Booth) -> None:
    page = opened(bare_booth, driven(finished(rows.launch()))[-1])
    clock = page.locator("#clock")
    first = [picture(page, number) for number in (0, 1)]
    page.get_by_role("button", name="One step on").click()
    expect(clock).to_have_text("0.1 s")
    assert [picture(page, number) != first[number] for number in (0, 1)] == [True, True]
    page.get_by_role("button", name="One step back").click()
    expect(clock).to_have_text("0.0 s")
    assert [picture(page, number) for number in (0, 1)] == first
    page.locator("#scrub").fill("6")
    expect(clock).to_have_text("0.6 s")
    page.get_by_label("Speed").select_option("4")
    page.get_by_role("button", name="Play").click()
    expect(clock).to_have_text("1.2 s")
    expect(page.get_by_role("button", name="Play")).to_be_visible()
    near = picture(page, 1)
    page.get_by_label("Follow the ego").uncheck()
    assert picture(page, 1) != near
