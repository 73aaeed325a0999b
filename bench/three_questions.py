"""How much longer a pair takes with three questions than with one.

    python -m bench.three_questions [PAIRS]

Serves the demo's catalogue and votes in Chromium with a scripted hand, on a pair of each ballot in
turn. The hand is an assumption, no measured person: it looks for LOOK_S at a new pair, and needs
KEY_S to read a question and press its key. "Software alone" is what the page itself takes of that:
from each press to the next question or pair on the screen.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import Browser, Page

from augment.scene.entities import CatalogueSet
from bench.key_to_pair import open_study, sign_in, start_voting
from bench.report import table
from tests.browser.chromium import chromium
from tests.stack import SMALL_DEMO, Home

PAIRS = 20
LOOK_S, KEY_S = 3.0, 0.6
MOST_RATIO = 1.6
BALLOTS = {1: ("instruction",), 3: ("instruction", "realism", "difficulty")}
"""By number of questions."""

# Ends once another question or pair is painted, its pictures complete.
CHANGED = """before => {
    const pictures = [...document.querySelectorAll(".side img")];
    const isThere = pictures.every((picture) => picture.complete && picture.naturalWidth > 1);
    const said = ["place", "step"].map((id) => document.getElementById(id).textContent);
    return isThere && said.join() !== before;
}"""
PLACE = """() => ["place", "step"].map((id) => document.getElementById(id).textContent).join()"""


def main() -> None:
    """Measure and print the table and the ratio."""
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else PAIRS
    with tempfile.TemporaryDirectory(prefix="arena-questions-") as folder:
        home = Home.at(Path(folder))
        home.must(*SMALL_DEMO)
        for number, questions in BALLOTS.items():
            more = ("--questions", *questions, "--repeats", "0")
            open_study(home, [f"expert-{number}"], pairs + 1, *more, sets=list(CatalogueSet))
        with home.serving() as address, chromium() as browser:
            pages = {number: _enter(browser, address, number) for number in BALLOTS}
            took: dict[int, list[tuple[float, float]]] = {number: [] for number in BALLOTS}
            for _ in range(pairs):
                for number, page in pages.items():
                    took[number].append(_judge(page, number))
    print(f"The hand looks {LOOK_S:g} s at a pair and takes {KEY_S:g} s a key: both assumed.\n")
    medians, rows = {}, []
    for number, found in took.items():
        whole, software = (statistics.median(values) for values in zip(*found, strict=True))
        medians[number] = whole
        rows.append([str(number), str(len(found)), f"{whole:.2f}", f"{1000 * software:.1f}"])
    head = ["questions", "pairs", "a pair, s: median", "software alone, ms: median"]
    print(f"{table(head, rows)}\n\nratio {medians[3] / medians[1]:.2f} (at most {MOST_RATIO:g})")


def _enter(browser: Browser, address: str, number: int) -> Page:
    page = sign_in(browser, address, f"expert-{number}")
    start_voting(page)
    return page


def _judge(page: Page, questions: int) -> tuple[float, float]:
    """Answer all questions of a pair; return the seconds it took, and those of the page alone."""
    page.bring_to_front()
    start, software = time.perf_counter(), 0.0
    page.wait_for_timeout(1000 * LOOK_S)
    for number in range(questions):
        page.wait_for_timeout(1000 * KEY_S)
        before = page.evaluate(PLACE)
        pressed = time.perf_counter()
        page.keyboard.press("123"[number % 3])
        page.wait_for_function(CHANGED, arg=before)
        software += time.perf_counter() - pressed
    return time.perf_counter() - start, software


if __name__ == "__main__":
    main()
