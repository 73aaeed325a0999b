"""The voting page as it looks, with practice: fixed geometry, both themes, phones, long words."""

import json
from pathlib import Path
from typing import Any

import pytest
from axe_playwright_python.sync_playwright import Axe
from django.conf import settings
from django.contrib.auth.models import User
from playwright.sync_api import Page, ViewportSize, expect

from arena.studies.services.opening import close_study
from arena.voting.screen import LONGEST
from arena.voting.services.practice import practice_pairs
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_to_document
from augment.scene.entities import Modification
from augment.services.scenarios.catalogue import read_catalogue
from augment.services.scenarios.pictures import draw_checks, store
from tests import study_rows
from tests.browser.booth import DESK, PHONE, Booth, furnish, press, ready
from tests.moving import a_moving_study
from tests.scenes import vehicle
from tests.study_rows import KINDS, contestant, picture
from tests.web.cast import png

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]


RULES: dict[str, Any] = {
    "runOnly": ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"],
    "resultTypes": ["violations"],
}

SIZES = ((1280, 720), (1440, 900), (1920, 1080))
FRAMES = """async () => {
    for (let frame = 0; frame < 3; frame += 1) await new Promise(requestAnimationFrame);
}"""
HIDE_BARS = "for (const bar of document.querySelectorAll('.film-bar')) bar.hidden = true"


def faults(page: Page, rules: dict[str, Any] = RULES) -> list[str]:
    """What axe-core finds, as rule: element."""
    found: list[dict[str, Any]] = Axe().run(page, options=rules).response["violations"]
    return [f"{rule['id']}: {node['html'][:120]}" for rule in found for node in rule["nodes"]]


def test_axe_finds_nothing_on_any_page_of_voting(booth: Booth) -> None:
    booth.study.allow_both_miss = True
    booth.study.save()
    study_rows.vote(study_rows.matchups_of(booth.study, "eva")[0])
    page = booth.enter(color_scheme="dark", bypass_csp=True)
    assert faults(page) == []
    page.keyboard.press("u")
    ready(page)
    assert faults(page) == [], "a former pair"
    for key, opened in (("t", "#tools"), ("s", "#skip"), ("r", "#report"), ("c", "#comment")):
        page.keyboard.press(key)
        expect(page.locator(f"{opened}:popover-open")).to_be_visible()
        assert faults(page) == [], opened
        page.keyboard.press("Escape")
    page.keyboard.press("h")
    expect(page.locator("#help[open]")).to_be_visible()
    assert faults(page) == [], "help"
    for matchup in study_rows.matchups_of(booth.study, "eva")[1:]:
        study_rows.vote(matchup)
    page.goto(booth.path)
    assert faults(page) == [], "done"
    close_study(study=booth.study)
    page.goto(booth.path)
    assert faults(page) == [], "closed"


@pytest.mark.slow
@pytest.mark.parametrize("films", [0, 2])
def test_over_the_catalogue_everything_fits_and_nothing_moves(
    bare_booth: Booth, films: int
) -> None:
    # The longest instructions alone settle how high the text is.
    bare_booth.study = (a_moving_study if films else furnish)(scenarios=LONGEST, votes=9)
    entries = read_catalogue(settings.BASE_DIR / "fixtures")[1]
    texts = sorted((entry.instruction for entry in entries), key=len, reverse=True)
    for scenario, text in zip(bare_booth.study.scenarios.all(), texts, strict=False):
        scenario.instruction = text
        scenario.save()
    page = bare_booth.enter()
    places: dict[tuple[int, int], list[Any]] = {size: [] for size in SIZES}
    for number in range(4):
        expect(page.locator(".film-bar:visible")).to_have_count(films // 2)
        expect(page.locator("canvas.reel")).to_have_count(films)
        if number == 3:  # as of a pair without films
            page.evaluate(HIDE_BARS)
        for width, height in SIZES:
            page.set_viewport_size(ViewportSize(width=width, height=height))
            page.evaluate(FRAMES)
            _fits(page)
            standing = page.locator(".panel, .answers .button").all()
            places[width, height].append([one.bounding_box() for one in standing])
        if number < 3:
            press(page, "1")
    for size, boxes in places.items():
        assert boxes == [boxes[0]] * 4, size


def _fits(page: Page) -> None:
    """Nothing scrolls, and every button can be hit."""
    assert page.evaluate(
        "document.documentElement.scrollHeight <= innerHeight"
        " && document.documentElement.scrollWidth <= innerWidth"
    )
    for button in page.locator(".voting .button:visible").all():
        box = button.bounding_box()
        assert box is not None
        assert min(box["height"], box["width"]) >= 44, button.inner_text()


def test_a_phone_shows_one_above_the_other_and_a_bar_to_tap(booth: Booth) -> None:
    page = booth.enter(viewport=PHONE, has_touch=True, is_mobile=True)
    first, second = (panel.bounding_box() for panel in page.locator(".panel").all())
    assert first is not None
    assert second is not None
    assert second["y"] > first["y"] + first["height"]
    assert first["width"] > 0.9 * PHONE["width"]
    assert page.evaluate("document.documentElement.scrollWidth") == PHONE["width"]
    bar = page.get_by_role("button", name="A is better").bounding_box()
    assert bar is not None
    assert bar["height"] >= 56
    assert bar["y"] + bar["height"] <= PHONE["height"]
    page.get_by_role("button", name="B is better").tap()
    expect(page.locator("#place")).to_have_text("2")
    ready(page)
    page.get_by_role("button", name="Tools").tap()
    page.get_by_role("button", name="Skip").tap()
    page.get_by_role("button", name="Instruction unclear").tap()
    expect(page.locator("#skipped")).to_have_text("Skipped: 1")
    expect(page.locator("#saved")).to_have_text("Saved 1. Nothing waiting.")
    assert booth.outcomes() == ["right", "skip"]


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


@pytest.mark.slow
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


WINDOWS = [
    *((1920, 1080), (1280, 720), (1024, 600), (853, 480), (740, 360)),
    *((768, 1024), (360, 640)),
]
GERMAN = (
    "Hinter der Kreuzung ist unsere Fahrspur durch eine schräge Reihe aus sechs Leitkegeln von "
    "der linken Fahrstreifenbegrenzung zur rechten hin gesperrt, der erste 4 m hinter dem Ende "
    "der Kreuzung, im Abstand von je 2,5 m, mit einem Bauarbeiter dahinter und einem Lastwagen "
    "auf unserer Fahrspur 20 m hinter dem ersten Leitkegel. Ein Auto steht auf der Fahrspur links "
    "von unserer, 14 m hinter der Kreuzung."
)
"""The longest one in German, as somebody might translate it."""
PLACES = """async () => {
    // The pictures follow the room of the instruction, a frame after a window has changed.
    for (let frame = 0; frame < 3; frame += 1) await new Promise(requestAnimationFrame);
    const box = (which) => {
        const { left, right, top, bottom } = document.querySelector(which).getBoundingClientRect();
        return { left, right, top, bottom };
    };
    const lines = [...document.querySelector("#instruction").getClientRects()];
    return {
        ask: box("#ask"), sides: box(".sides"), answers: box("#answers"),
        instruction: {
            left: Math.min(...lines.map(({ left }) => left)),
            right: Math.max(...lines.map(({ right }) => right)),
            top: Math.min(...lines.map(({ top }) => top)),
            bottom: Math.max(...lines.map(({ bottom }) => bottom)),
        },
        question: box("#question"), a: box(".side"), b: box(".side + .side"),
        width: document.documentElement.scrollWidth,
        height: document.documentElement.scrollHeight,
    };
}"""


def longest_of_the_catalogue() -> str:
    """Of the paper set and the hard set, with all their wordings."""
    folder = Path(settings.BASE_DIR) / "fixtures"
    files = [*folder.glob("scenarios/*.json"), *folder.glob("hard/scenarios/*.json")]
    entries = [json.loads(path.read_text()) for path in files]
    texts = [str(one["instruction"]) for one in entries]
    texts += [str(wording["text"]) for one in entries for wording in one.get("paraphrases", [])]
    assert len(texts) > len(files) > 90
    return max(texts, key=len)


def asked_for(booth: Booth, *instructions: str) -> None:
    """Give the first pairs these instructions."""
    for matchup, text in zip(
        study_rows.matchups_of(booth.study, "eva"), instructions, strict=False
    ):
        matchup.scenario.instruction = text
        matchup.scenario.save()


def is_whole(places: dict[str, Any], width: int) -> bool:
    line, ask = places["instruction"], places["ask"]
    return bool(
        line["top"] >= ask["top"] - 1
        and places["question"]["bottom"] <= ask["bottom"] + 1
        and line["left"] >= 0
        and line["right"] <= width
        and ask["bottom"] <= places["sides"]["top"] + 1
    )


@pytest.mark.slow
def test_the_longest_instruction_of_the_catalogue_is_never_cut(booth: Booth) -> None:
    long = longest_of_the_catalogue()
    assert len(GERMAN) > len(long) > 300
    asked_for(booth, "Add a car.", GERMAN, "Add a car and a bus.")
    page = booth.enter(locale="de-DE")
    seen: dict[tuple[int, int], list[dict[str, Any]]] = {size: [] for size in WINDOWS}
    for number in range(3):
        for width, height in WINDOWS:
            page.set_viewport_size(ViewportSize(width=width, height=height))
            seen[width, height].append(page.evaluate(PLACES))
            places = seen[width, height][-1]
            assert is_whole(places, width), f"pair {number + 1}, {width}x{height}: {places}"
        press(page, "1")
    for (width, height), shown in seen.items():
        _holds_its_shape(width, height, shown)


def _holds_its_shape(width: int, height: int, seen: list[dict[str, Any]]) -> None:
    first, size = seen[0], f"{width}x{height}"
    assert [places["sides"] for places in seen] == [first["sides"]] * 3, f"{size}: pictures moved"
    assert first["width"] == width, f"{size}: wider than the window"
    assert first["sides"]["bottom"] <= first["answers"]["top"] + 1, f"{size}: bar over a picture"
    assert (first["b"]["top"] > first["a"]["top"]) == (width > 800 or height > 528), (
        f"{size}: stacked or not"
    )
    if width > height:
        assert first["answers"]["bottom"] <= height + 1, f"{size}: answers are out of sight"
        for side in (first["a"], first["b"]):
            assert side["top"] >= -1, size
            assert side["bottom"] - side["top"] >= 60, f"{size}: no picture is left"
    if width > 800:
        assert first["height"] <= height, f"{size}: the page scrolls"
        assert first["answers"]["bottom"] <= height, size
