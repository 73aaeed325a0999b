"""The displacement error of the built-in contestants: `python -m bench.displacement`.

Over the whole catalogue, with the seeds that jobs use, without a database. What a contestant
refuses is missing.
"""

import hashlib
from collections.abc import Sequence

from augment.baselines.registry import PLACERS, PlaceIntent
from augment.errors import CannotPlace
from augment.metrics.displacement import Displacement, displacement, summarise
from augment.scene.entities import Modification
from bench.report import table
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


def placed_by_each() -> dict[str, dict[str, Modification | None]]:
    """What each built-in contestant makes of each scenario of the catalogue."""
    return {
        name: {slug: made(placer.place, slug) for slug in SLUGS}
        for name, placer in PLACERS.items()
    }


def displacement_table(
    slugs: Sequence[str], made_by: dict[str, dict[str, Modification | None]]
) -> str:
    """A row a contestant over some scenarios, in Markdown; distances in metres."""
    rows = []
    for name, found in made_by.items():
        summary = summarise([measured(slug, found[slug]) for slug in slugs])
        box = summary.box
        numbers = () if box is None else (box.q1_m, box.median_m, box.q3_m, box.mean_m)
        cells = [f"{number:.2f}" for number in numbers] or ["–"] * 4
        rows.append([name, str(summary.n), str(summary.missing), *cells])
    head = ["contestant", "objects", "missing", "quartile (m)", "median (m)", "quartile (m)"]
    return table([*head, "mean (m)"], rows)


if __name__ == "__main__":
    print(displacement_table(SLUGS, placed_by_each()))
