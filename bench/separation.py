"""How far the two sets of the catalogue pull contestants apart.

`python -m bench.separation`, without a database. The contestants are the rule placer,
the quantised baselines and the careless stand-in, which is scripted: it knows the intents and
makes the mistakes of weak models on purpose. A contestant's median is that over the scenarios of
a set of the mean displacement of what it placed in each, and beside it that over the objects; the
spread of a set is the largest median less the smallest.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import attrgetter
from statistics import fmean, median

from augment.baselines import rule_placer
from augment.baselines.registry import PLACERS
from augment.errors import CannotPlace
from augment.fake_llm import careless
from augment.fake_llm import careless as misreading
from augment.scene.entities import Modification
from bench.displacement import made, measured
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Medians:
    """What one contestant's displacement is on a set, in metres.

    Attributes:
        scenarios, by_scenario_m: Where it placed something, and the median of the means there.
        objects, by_object_m: What it placed, and the median over that.
    """

    scenarios: int
    by_scenario_m: float
    objects: int
    by_object_m: float


def medians_of(slugs: Sequence[str]) -> dict[str, Medians]:
    """By contestant, in the order in which they are asked."""
    values: dict[str, list[list[float]]] = {}
    for slug in slugs:
        for name, modification in contestants_on(slug).items():
            matches = list(measured(slug, modification).distances_m)
            values.setdefault(name, []).extend([matches] if matches else [])
    return {
        name: Medians(
            scenarios=len(found),
            by_scenario_m=median(map(fmean, found)),
            objects=sum(map(len, found)),
            by_object_m=median(gap for matches in found for gap in matches),
        )
        for name, found in values.items()
    }


def spread_of(medians: dict[str, Medians], by: Callable[[Medians], float]) -> float:
    """From the best contestant to the worst, in metres."""
    found = [by(one) for one in medians.values()]
    return max(found) - min(found)


def main() -> int:
    """Print the tables of docs/catalogue.md; 1 where the hard set separates too little."""
    sets = {"paper": medians_of(SLUGS), "hard": medians_of(HARD_SLUGS)}
    ratios = [
        _table(sets, "scenarios", attrgetter("scenarios"), attrgetter("by_scenario_m")),
        _table(sets, "objects", attrgetter("objects"), attrgetter("by_object_m")),
    ]
    return int(min(ratios) < SEPARATES_BY)


def _table(
    sets: dict[str, dict[str, Medians]],
    unit: str,
    count: Callable[[Medians], int],
    by: Callable[[Medians], float],
) -> float:
    """Print one table; how many times as far the hard set spreads."""
    print(f"| contestant | paper: {unit} | median (m) | hard: {unit} | median (m) |")
    print("|---|---|---|---|---|")
    for name in sets["paper"]:
        cells = [f"{count(one[name])} | {by(one[name]):.2f}" for one in sets.values()]
        print(f"| {name} | {' | '.join(cells)} |")
    spreads = {name: spread_of(one, by) for name, one in sets.items()}
    print(f"| spread | | {spreads['paper']:.2f} | | {spreads['hard']:.2f} |")
    ratio = spreads["hard"] / spreads["paper"]
    print(f"\nBy {unit} the hard set spreads {ratio:.1f} times as far.\n")
    return ratio


if __name__ == "__main__":
    sys.exit(main())
