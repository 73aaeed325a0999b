"""How soon a pair's films move after the key, and how many bytes such a pair takes.

    python -m bench.moving_ballot [VOTES] [--write]

Serves the demo's catalogue, in which whatever was added or moved now drives or walks 40 m straight
on from 1 s on, and votes in Chromium at 1280x720 without and with a network latency of 150 ms.
"First frame" is from the press to the frame after the one that has both films of the next pair in
it; bytes are those on the wire, of pictures, films and what films play over.
"""

import statistics
from typing import Any
from urllib.parse import urlsplit

from playwright.sync_api import CDPSession, Page

from augment.scene.entities import CatalogueSet
from bench.key_to_pair import measure_latencies, start_voting, vote

VOTES = 30

MOVE = """
from dataclasses import replace
import numpy as np
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_from_document, modification_to_document
from augment.scene.planned_motion import AtTime, PlannedMotion, PointPath
from augment.services.scenarios.pictures import redraw
def moving(agent):
    ahead = agent.pose.to_parent(np.array([[40.0, 0.0]])).tolist()
    path = PointPath(points_m=(tuple(ahead[0]),))
    motion = PlannedMotion(path=path, speeds=((2.0, 6.0),), start=AtTime(after_s=1.0))
    return replace(agent, motion=motion, walk_to_m=None)
for row in Augmentation.objects.exclude(modification=None):
    change = modification_from_document(row.modification)
    added, moved = (tuple(map(moving, agents)) for agents in (change.added, change.moved))
    change = replace(change, added=added, moved=moved)
    Augmentation.objects.filter(pk=row.pk).update(modification=modification_to_document(change))
for scenario in Scenario.objects.filter(augmentations__isnull=False).distinct():
    redraw(scenario)
"""

# Put after the page's own listeners, so that it looks on right after them.
STOPWATCH = """() => {
window.moved = [];
const shown = () => [...document.querySelectorAll("canvas.reel:not([hidden])")];
let before = shown();
addEventListener("keydown", (event) => {
  const look = () => {
    const films = shown();
    const isNew = films.length === 2 && !films.some((film) => before.includes(film));
    if (!isNew) return requestAnimationFrame(look);
    before = films;
    requestAnimationFrame(() => moved.push(performance.now() - event.timeStamp));
  };
  look();
});
}"""


HEADING = "From the key to the first frame of films"


def main() -> None:
    """Measure, print the table, and write it into docs/benchmarks.md where that is asked for."""
    head = ["pairs", "first frame, ms: median", "p95", "max", "kB a pair"]
    sets = [CatalogueSet.PAPER, CatalogueSet.MOVING]
    measure_latencies("moving_ballot", HEADING, head, VOTES, _vote, sets=sets, script=MOVE)


def _vote(page: Page, wire: CDPSession, votes: int) -> list[str]:
    """How long the films of each pair took, and the kB of a pair, which has three pictures."""
    picture_of: dict[str, str] = {}
    sizes: dict[str, float] = {}

    def asked(event: dict[str, Any]) -> None:
        path = urlsplit(event["request"]["url"]).path
        if path.startswith("/i/"):
            picture_of[event["requestId"]] = path

    def loaded(event: dict[str, Any]) -> None:
        if path := picture_of.get(event["requestId"]):
            sizes[path] = sizes.get(path, 0.0) + event["encodedDataLength"]

    wire.on("Network.requestWillBeSent", asked)
    wire.on("Network.loadingFinished", loaded)
    start_voting(page, ready="canvas.reel:not([hidden])")
    vote(page, votes, STOPWATCH)
    moved: list[float] = page.evaluate("window.moved")
    kilobytes = sum(sizes.values()) / (len(sizes) / 3) / 1000
    p95 = statistics.quantiles(moved, n=20)[-1]
    figures = [statistics.median(moved), p95, max(moved), kilobytes]
    return [str(len(moved)), *(f"{one:.1f}" for one in figures)]


if __name__ == "__main__":
    main()
