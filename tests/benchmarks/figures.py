"""Write every figure of README.md, docs/checks.md and docs/formats.md anew: `make figures`.

The other measurements write their own section of docs/benchmarks.md and docs/coverage.md, because
they take long or need other software.
"""

from __future__ import annotations

from tests.benchmarks import displacement, hostile_reading, injected_faults
from tests.benchmarks.report import ROOT, write_block
from tests.fixtures.shelf import SLUGS


def main() -> None:
    """Measure and write."""
    readme, checks = ROOT / "README.md", ROOT / "docs" / "checks.md"
    placed = displacement.displacement_table(SLUGS, displacement.placed_by_each())
    write_block("displacement", placed, page=readme)
    tally = injected_faults.measure(injected_faults.COUNT, injected_faults.SEED)
    write_block("faults", injected_faults.class_table(tally), page=readme)
    faults = injected_faults.report(injected_faults.COUNT, injected_faults.SEED)
    write_block("faults", faults, page=checks)
    formats = ROOT / "docs" / "formats.md"
    write_block("hostile", hostile_reading.hostile_table(), page=formats)


if __name__ == "__main__":
    main()
