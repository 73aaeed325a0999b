"""How far the two sets of the catalogue pull contestants apart.

`python -m tests.benchmarks.separation`, without a database. The contestants are the rule placer,
the quantised baselines and the careless stand-in, which is scripted: it knows the intents and
makes the mistakes of weak models on purpose. A contestant's median is that over the scenarios of
a set of the mean displacement of what it placed in each; the spread of a set is the largest median
less the smallest.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from statistics import fmean, median

from augment.baselines import rule_placer
from augment.baselines.registry import PLACERS
from augment.errors import CannotPlace
from augment.fake_llm import careless, misreading
from augment.scene.modification import Modification
from tests.benchmarks.displacement import made, measured
from tests.fixtures.shelf import HARD_SLUGS, SLUGS, entry, shown_scene

CARELESS = "fake-careless"
SEPARATES_BY = 3.0


def made_carelessly(slug: str) -> Modification | None:
    """What the stand-in hears, places and bends; as it answers, but for the unreadable."""
    intent = entry(slug).intent
    assert intent is not None
    rng = careless.dice(entry(slug).instruction)
    for taken_for in (misreading.misread(intent, rng), intent):
        try:
            right = rule_placer.place(shown_scene(slug), taken_for).modification
        except CannotPlace:
            continue
        laid = careless.lay_straight(shown_scene(slug), right)
        return careless.bend(shown_scene(slug), laid, rng).modification
    return None


def contestants_on(slug: str) -> dict[str, Modification | None]:
    """What everybody makes of a scenario, None where it is refused."""
    return {name: made(placer.place, slug) for name, placer in PLACERS.items()} | {
        CARELESS: made_carelessly(slug)
    }


def medians_of(slugs: Sequence[str]) -> dict[str, tuple[int, float]]:
    """By contestant: in how many scenarios it placed something, and its median in metres."""
    values: dict[str, list[float]] = {}
    for slug in slugs:
        for name, modification in contestants_on(slug).items():
            matches = measured(slug, modification).distances_m
            values.setdefault(name, []).extend([fmean(matches)] if matches else [])
    return {name: (len(found), median(found)) for name, found in values.items()}


def spread_of(medians: dict[str, tuple[int, float]]) -> float:
    """From the best contestant to the worst, in metres."""
    found = [value for _, value in medians.values()]
    return max(found) - min(found)


def main() -> int:
    """Print the table of docs/catalogue.md; 1 where the hard set separates too little."""
    sets = {"paper": medians_of(SLUGS), "hard": medians_of(HARD_SLUGS)}
    print("| contestant | paper: scenarios | median (m) | hard: scenarios | median (m) |")
    print("|---|---|---|---|---|")
    for name in sets["paper"]:
        cells = [f"{one[name][0]} | {one[name][1]:.2f}" for one in sets.values()]
        print(f"| {name} | {' | '.join(cells)} |")
    spreads = {name: spread_of(one) for name, one in sets.items()}
    print(f"| spread | | {spreads['paper']:.2f} | | {spreads['hard']:.2f} |")
    ratio = spreads["hard"] / spreads["paper"]
    print(f"\nThe hard set spreads {ratio:.1f} times as far.")
    return int(ratio < SEPARATES_BY)


if __name__ == "__main__":
    sys.exit(main())
