"""Write the figures of README.md, method.md and catalogue.md anew: `make figures`.

The other measurements write their own section of docs/benchmarks.md and docs/rating.md, because
they take long or need other software.
"""

import os

import django

from augment.services.scenarios.catalogue_check import WayPast
from bench import displacement, injected_faults
from bench.report import ROOT, table, write_block
from tests.fixtures.shelf import FOLDER, SLUGS


def main() -> None:
    """Measure and write."""
    readme, method = ROOT / "README.md", ROOT / "docs" / "method.md"
    placed = displacement.displacement_table(SLUGS, displacement.placed_by_each())
    write_block("displacement", placed, page=readme)
    tally = injected_faults.measure(injected_faults.COUNT, injected_faults.SEED)
    write_block("faults", injected_faults.class_table(tally), page=readme)
    faults = injected_faults.report(tally, count=injected_faults.COUNT, seed=injected_faults.SEED)
    write_block("faults", faults, page=method)
    write_ways()


def write_ways() -> None:
    """By which lane the ego gets past the references of the paper set."""
    os.environ.setdefault("DJANGO_SETTINGS_MODULE", "arena.config.settings")
    django.setup()
    from augment.services.scenarios.catalogue_check import check_catalogue

    found = check_catalogue(folder=FOLDER).scenarios
    rows = [
        [way.value, str(sum(one.way_past is way for one in found))]
        for way in WayPast
        if way is not WayPast.NONE
    ]
    body = table(["way past", "scenarios"], rows)
    write_block("ways", body, page=ROOT / "docs" / "catalogue.md")


if __name__ == "__main__":
    main()
