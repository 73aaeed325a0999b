"""In any window and with any fonts an instruction is shown whole, and no picture moves."""

import json
from pathlib import Path
from typing import Any

import pytest
from django.conf import settings
from playwright.sync_api import ViewportSize

from tests import study_rows
from tests.browser.booth import Booth, press

pytestmark = [pytest.mark.browser, pytest.mark.django_db(transaction=True)]

SIZES = [
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


def test_the_longest_instruction_of_the_catalogue_is_never_cut(booth: Booth) -> None:
    long = longest_of_the_catalogue()
    assert len(GERMAN) > len(long) > 300
    asked_for(booth, "Add a car.", GERMAN, "Add a car and a bus.")
    page = booth.enter(locale="de-DE")
    seen: dict[tuple[int, int], list[dict[str, Any]]] = {size: [] for size in SIZES}
    for number in range(3):
        for width, height in SIZES:
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
