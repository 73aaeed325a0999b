"""How long an expert waits from the press of a key to the next pair on the screen.

    python -m bench.key_to_pair [VOTES] [--write]

Serves the demo's scenarios that stand still and votes in Chromium at 1280x720 without and with a
network latency of 150 ms. Visible means: the number of the pair has changed, both new pictures are
complete, and one more animation frame has passed. "Painted" is the browser's own account of the
same presses (Event Timing, in steps of 8 ms), which includes decoding and drawing.
"""

import argparse
import statistics
import tempfile
from collections.abc import Sequence
from pathlib import Path

from playwright.sync_api import Browser, CDPSession, Page

from augment.scene.entities import CatalogueSet
from bench.report import load, table, write_section
from tests.browser.chromium import chromium
from tests.stack import SMALL_DEMO, Home

VOTES = 40
LATENCIES_MS = (0, 150)
PASSWORD = "a password to vote with"
PAUSE_MS = 600
"""An expert looks for longer; votes at less than four a second are taken."""

# Put after the page's own listeners, so that it looks on right after them.
STOPWATCH = """() => {
window.visible = [];
window.painted = [];
let before = document.getElementById("place").textContent;
addEventListener("keydown", (event) => {
  const look = () => {
    const { textContent: place } = document.getElementById("place");
    const pictures = [...document.querySelectorAll(".side img")];
    const isThere = pictures.every((picture) => picture.complete && picture.naturalWidth > 1);
    if (place === before || !isThere) return requestAnimationFrame(look);
    before = place;
    requestAnimationFrame(() => visible.push(performance.now() - event.timeStamp));
  };
  look();
});
new PerformanceObserver((list) => {
  const presses = list.getEntries().filter(({ name }) => name === "keydown");
  painted.push(...presses.map(({ duration }) => duration));
}).observe({ type: "event", durationThreshold: 16 });
}"""


HEADING = "From the key to the next pair"


def main(votes: int, is_written: bool) -> None:
    """Measure, print the table, and write it into docs/benchmarks.md where that is asked for."""
    before, rows = load(), []
    with tempfile.TemporaryDirectory(prefix="arena-keys-") as folder:
        home = Home.at(Path(folder))
        home.must(*SMALL_DEMO)
        prepare(home, votes, sets=[CatalogueSet.PAPER])
        with home.serving() as address, chromium() as browser:
            for latency in LATENCIES_MS:
                rows.append(_row(latency, *_vote(browser, address, latency, votes)))
    head = ["latency", "presses", "visible, ms: median", "p95", "max", "painted: median", "p95"]
    text = f"`python -m bench.key_to_pair --write`; {before}.\n\n{table(head, rows)}"
    print(text)
    if is_written:
        write_section(HEADING, text)


def prepare(home: Home, votes: int, *, sets: Sequence[CatalogueSet]) -> None:
    """An expert for each latency, and a study of one pair more than they vote on."""
    names = [f"expert-{latency}" for latency in LATENCIES_MS]
    made = "; ".join(
        f"create_person(username={name!r}, password={PASSWORD!r}, role='expert')" for name in names
    )
    home.must("shell", "-c", f"from arena.people.services import create_person; {made}")
    scenarios = home.rows(
        "SELECT slug FROM augment_scenario WHERE id IN"
        " (SELECT scenario_id FROM augment_augmentation)"
        f" AND catalogue_set IN ({', '.join(repr(one.value) for one in sets)})"
    )
    home.must(
        *("open_study", "Keys", "--experts", *names, "--votes-per-expert", str(votes + 1)),
        *("--contestants", "reference", "rule-placer", "sim-good-otm", "sim-careless-otm"),
        *("--scenarios", *(slug for (slug,) in scenarios), "--seed", "5", "--allow-simulated"),
    )


def _vote(
    browser: Browser, address: str, latency_ms: int, votes: int
) -> tuple[list[float], list[float]]:
    page, _ = sign_in(browser, address, latency_ms)
    vote(page, votes, ready="body.is-live #answers:not([inert])", stopwatch=STOPWATCH)
    found = _numbers(page, "visible"), _numbers(page, "painted")
    page.context.close()
    return found


def sign_in(browser: Browser, address: str, latency_ms: int) -> tuple[Page, CDPSession]:
    """The expert's home in a context of its own, and its wire, which has the latency from now."""
    context = browser.new_context(viewport={"width": 1280, "height": 720})
    page = context.new_page()
    page.goto(f"{address}/login/")
    page.fill("input[name=username]", f"expert-{latency_ms}")
    page.fill("input[name=password]", PASSWORD)
    page.click("main form button")
    page.wait_for_url(f"{address}/")
    wire = context.new_cdp_session(page)
    wire.send("Network.enable")
    throughput = {"downloadThroughput": -1, "uploadThroughput": -1}
    how = {"offline": False, "latency": latency_ms, **throughput}
    wire.send("Network.emulateNetworkConditions", how)
    return page, wire


def vote(page: Page, votes: int, *, ready: str, stopwatch: str) -> None:
    """Go to the voting page and vote by keys, the stopwatch running once `ready` is there."""
    page.click("a[href*='/vote/']")
    page.wait_for_selector(ready)
    page.wait_for_timeout(2000)
    page.evaluate(stopwatch)
    for number in range(votes):
        page.keyboard.press("123"[number % 3])
        page.wait_for_timeout(PAUSE_MS)


def _numbers(page: Page, name: str) -> list[float]:
    found: list[float] = page.evaluate(f"window.{name}")
    return found


def _row(latency_ms: int, visible: list[float], painted: list[float]) -> list[str]:
    # Presses that were painted within 16 ms are not reported by the browser.
    painted = painted + [16.0] * (len(visible) - len(painted))
    figures = [*_spread(visible), max(visible), *_spread(painted)]
    return [f"{latency_ms} ms", str(len(visible)), *(f"{figure:.1f}" for figure in figures)]


def _spread(values: list[float]) -> tuple[float, float]:
    return statistics.median(values), statistics.quantiles(values, n=20)[-1]


def read_arguments(votes: int) -> tuple[int, bool]:
    """How many votes, and whether the table goes into the docs."""
    parser = argparse.ArgumentParser()
    parser.add_argument("votes", type=int, nargs="?", default=votes)
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
    asked = parser.parse_args()
    return asked.votes, asked.write


if __name__ == "__main__":
    main(*read_arguments(VOTES))
