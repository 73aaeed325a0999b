"""The displacement error of the built-in contestants: `python -m tests.benchmarks.displacement`.

Over the whole catalogue, with the seeds that jobs use, without a database. What a contestant
refuses is missing; the last table counts only the objects of scenarios that all of them place.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

from augment.baselines.registry import PLACERS, PlaceIntent
from augment.errors import CannotPlace
from augment.metrics.displacement import Displacement, displacement
from augment.metrics.summary import summarise
from augment.scene.catalogue import ScenarioType
from augment.scene.modification import Modification
from tests.fixtures.shelf import SLUGS, entry, shown_scene


def seed_of(slug: str) -> int:
    """The seed of a scenario as jobs have it (`services.scenarios.scenes`, which needs Django)."""
    return int.from_bytes(hashlib.sha256(slug.encode()).digest()[:4], "big")


def made(place: PlaceIntent, slug: str, seed: int = 0) -> Modification | None:
    """What a contestant makes of a scenario, None where it refuses."""
    scene, shelved = shown_scene(slug), entry(slug)
    try:
        return place(scene, shelved.intent, seed=seed_of(slug) + seed).modification
    except CannotPlace:
        return None


def measured(slug: str, modification: Modification | None) -> Displacement:
    """How far that is from the scenario's reference."""
    reference = entry(slug).reference
    assert reference is not None
    return displacement(modification, reference)


def line(name: str, found: Sequence[Displacement]) -> str:
    """A row of a table."""
    summary = summarise(found)
    counts = f"{summary.n} | {summary.missing}"
    if summary.box is None:
        return f"| {name} | {counts} | | | | |"
    box = summary.box
    numbers = (box.q1_m, box.median_m, box.q3_m, box.mean_m)
    return f"| {name} | {counts} | " + " | ".join(f"{one:.2f}" for one in numbers) + " |"


def table(
    title: str, slugs: Sequence[str], made_by: dict[str, dict[str, Modification | None]]
) -> None:
    """Print a table over some scenarios."""
    print(f"\n{title}, {len(slugs)} scenarios\n")
    print("| contestant | n | missing | quartile (m) | median (m) | quartile (m) | mean (m) |")
    print("|---|---|---|---|---|---|---|")
    for name, found in made_by.items():
        print(line(name, [measured(slug, found[slug]) for slug in slugs]))


def main() -> None:
    """Print the tables."""
    made_by = {
        name: {slug: made(placer.place, slug) for slug in SLUGS}
        for name, placer in PLACERS.items()
    }
    table("All", SLUGS, made_by)
    for kind in ScenarioType:
        table(kind.value, [slug for slug in SLUGS if entry(slug).type is kind], made_by)
    placed = [slug for slug in SLUGS if all(found[slug] for found in made_by.values())]
    table("What all of them place", placed, made_by)


if __name__ == "__main__":
    main()
