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
from collections.abc import Callable, Collection, Sequence
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


def main() -> None:
    """Measure, print the table, and write it into docs/benchmarks.md where that is asked for."""
    head = ["presses", "visible, ms: median", "p95", "max", "painted: median", "p95"]
    measure_latencies("key_to_pair", HEADING, head, VOTES, _vote, sets=[CatalogueSet.PAPER])


Measure = Callable[[Page, CDPSession, int], list[str]]
"""Vote so many times on a page over a wire; return the cells of a row."""


def measure_latencies(
    module: str,
    heading: str,
    head: list[str],
    votes: int,
    measure: Measure,
    *,
    sets: Sequence[CatalogueSet],
    script: str = "",
) -> None:
    """Serve the demo, let an expert vote at each latency, and print a row of each.

    Args:
        module: Of this package, for the sentence above the table.
        heading: Of the section of docs/benchmarks.md.
        head: Of the columns after the latency.
        votes: So many, where the command line does not say.
        measure: Makes a row.
        sets: Whose scenarios the study shows.
        script: Python that changes the demo's rows before.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("votes", type=int, nargs="?", default=votes)
    parser.add_argument("--write", action="store_true", help="into docs/benchmarks.md")
    asked, before, rows = parser.parse_args(), load(), []
    names = {latency: f"expert-{latency}" for latency in LATENCIES_MS}
    with tempfile.TemporaryDirectory(prefix="arena-keys-") as folder:
        home = Home.at(Path(folder))
        home.must(*SMALL_DEMO)
        if script:
            home.must("shell", "-c", script)
        open_study(home, names.values(), asked.votes + 1, sets=sets)
        with home.serving() as address, chromium() as browser:
            for latency, name in names.items():
                page = sign_in(browser, address, name)
                wire = page.context.new_cdp_session(page)
                wire.send("Network.enable")
                how = {"downloadThroughput": -1, "uploadThroughput": -1, "latency": latency}
                wire.send("Network.emulateNetworkConditions", {"offline": False, **how})
                rows.append([f"{latency} ms", *measure(page, wire, asked.votes)])
                page.context.close()
    text = f"`python -m bench.{module} --write`; {before}.\n\n{table(['latency', *head], rows)}"
    print(text)
    if asked.write:
        write_section(heading, text)


def open_study(
    home: Home, names: Collection[str], pairs: int, *more: str, sets: Sequence[CatalogueSet]
) -> None:
    """Open a study of the demo's answers with so many pairs for each of some new experts."""
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
        *("open_study", f"Of {', '.join(names)}", "--experts", *names),
        *("--contestants", "reference", "rule-placer", "sim-good-otm", "sim-careless-otm"),
        *("--scenarios", *(slug for (slug,) in scenarios), "--seed", "5", "--allow-simulated"),
        *("--votes-per-expert", str(pairs), *more),
    )


def sign_in(browser: Browser, address: str, name: str) -> Page:
    """The expert's home in a context of its own."""
    page = browser.new_context(viewport={"width": 1280, "height": 720}).new_page()
    page.goto(f"{address}/login/")
    page.fill("input[name=username]", name)
    page.fill("input[name=password]", PASSWORD)
    page.click("main form button")
    page.wait_for_url(f"{address}/")
    return page


def start_voting(page: Page, ready: str = "body.is-live #answers:not([inert])") -> None:
    """Go to the voting page and wait until `ready` is there."""
    page.click("a[href*='/vote/']")
    page.wait_for_selector(ready)


def vote(page: Page, votes: int, stopwatch: str) -> None:
    """Vote by keys, the stopwatch running."""
    page.wait_for_timeout(2000)
    page.evaluate(stopwatch)
    for number in range(votes):
        page.keyboard.press("123"[number % 3])
        page.wait_for_timeout(PAUSE_MS)


def _vote(page: Page, wire: CDPSession, votes: int) -> list[str]:
    start_voting(page)
    vote(page, votes, STOPWATCH)
    visible, painted = page.evaluate("[window.visible, window.painted]")
    # Presses that were painted within 16 ms are not reported by the browser.
    painted += [16.0] * (len(visible) - len(painted))
    figures = [*_spread(visible), max(visible), *_spread(painted)]
    return [str(len(visible)), *(f"{figure:.1f}" for figure in figures)]


def _spread(values: list[float]) -> tuple[float, float]:
    return statistics.median(values), statistics.quantiles(values, n=20)[-1]


if __name__ == "__main__":
    main()
