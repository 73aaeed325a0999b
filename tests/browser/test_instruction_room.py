"""In any window and with any fonts an instruction is shown whole, and no picture moves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from django.conf import settings

from tests import study_rows
from tests.browser.booth import Booth, press

pytestmark = [
    pytest.mark.browser,
    pytest.mark.layout,
    pytest.mark.django_db(transaction=True),
]

SIZES = [(1024, 600), (1280, 720), (844, 390), (820, 1180), (390, 844), (360, 640)]
GERMAN = (
    "Richte auf der Fahrspur des Ego-Fahrzeugs eine Baustelle ein: eine schräge Reihe aus 6 "
    "Leitkegeln im Abstand von je 2,5 m, von der linken Fahrstreifenbegrenzung zur rechten hin, "
    "der erste Leitkegel 20 m vor dem Ego-Fahrzeug, und ein Bauarbeiter, der neben den "
    "Leitkegeln steht."
)
PLACES = """() => {
    const box = (which) => {
        const { left, right, top, bottom } = document.querySelector(which).getBoundingClientRect();
        return { left, right, top, bottom };
    };
    const lines = [...document.querySelector("#instruction").getClientRects()];
    return {
        ask: box("#ask"), sides: box(".sides"), under: box(".under"), answers: box("#answers"),
        instruction: {
            left: Math.min(...lines.map(({ left }) => left)),
            right: Math.max(...lines.map(({ right }) => right)),
            top: Math.min(...lines.map(({ top }) => top)),
            bottom: Math.max(...lines.map(({ bottom }) => bottom)),
        },
        question: box(".asked"), a: box(".side"), b: box(".side + .side"),
        overflow: getComputedStyle(document.querySelector("#ask h1")).overflowY,
        width: document.documentElement.scrollWidth,
        height: document.documentElement.scrollHeight,
    };
}"""


def longest_of_the_catalogue() -> str:
    folder = Path(settings.BASE_DIR) / "fixtures" / "scenarios"
    texts = (path.read_text() for path in folder.glob("*.json"))
    instructions = [str(json.loads(text)["instruction"]) for text in texts]
    assert len(instructions) == 50
    return max(instructions, key=len)


def asked_for(booth: Booth, *instructions: str) -> None:
    """Give the first pairs these instructions."""
    for matchup, text in zip(
        study_rows.matchups_of(booth.study, "eva"), instructions, strict=False
    ):
        matchup.scenario.instruction = text
        matchup.scenario.save()


def is_whole(places: dict[str, Any], width: int) -> bool:
    line, ask = places["instruction"], places["ask"]
    question = places["question"]
    beside = question["left"] >= line["right"] or question["top"] >= line["bottom"] - 1
    return bool(
        places["overflow"] == "visible"
        and line["top"] >= ask["top"] - 1
        and line["bottom"] <= ask["bottom"] + 1
        and line["left"] >= 0
        and line["right"] <= width
        and ask["bottom"] <= places["sides"]["top"] + 1
        and beside
    )


@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
@pytest.mark.parametrize("locale", ["en-GB", "de-DE"])
def test_the_longest_instruction_of_the_catalogue_is_never_cut(
    booth: Booth, size: tuple[int, int], locale: str
) -> None:
    width, height = size
    long = longest_of_the_catalogue() if locale == "en-GB" else GERMAN
    asked_for(booth, "Add a car.", long, "Add a car and a bus.")
    page = booth.enter(viewport={"width": width, "height": height}, locale=locale)
    assert page.locator("html").get_attribute("lang") == locale[:2]
    seen = []
    for number in range(3):
        seen.append(page.evaluate(PLACES))
        assert is_whole(seen[-1], width), f"pair {number + 1}: {seen[-1]}"
        press(page, "1")
    assert [places["sides"] for places in seen] == [seen[0]["sides"]] * 3, "the pictures moved"
    assert seen[0]["width"] == width
    assert seen[0]["sides"]["bottom"] <= seen[0]["answers"]["top"] + 1, "the bar hides a picture"
    assert (seen[0]["b"]["top"] > seen[0]["a"]["top"]) == (height > width), "stacked or not"
    if width > 800 and height > 528:
        assert seen[0]["height"] <= height, "the page scrolls"
        assert seen[0]["sides"]["bottom"] <= seen[0]["under"]["top"] + 1
        assert seen[0]["answers"]["bottom"] <= height


def test_an_instruction_with_more_lines_than_the_longest_still_gets_its_room(
    booth: Booth,
) -> None:
    # Shorter than the longest, but its words leave their lines half empty.
    wide = " ".join(["Wiedergutmachungsgesetzgebungsvorhabenausschussvorsitzende"] * 4)
    asked_for(booth, wide, "a " * 130)
    page = booth.enter(viewport={"width": 390, "height": 844})
    assert is_whole(page.evaluate(PLACES), 390)
