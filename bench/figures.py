"""Write the figures of README.md and method.md anew: `make figures`.

The other measurements write their own section of docs/benchmarks.md and docs/rating.md, because
they take long or need other software.
"""

from bench import displacement, injected_faults
from bench.report import ROOT, write_block
from tests.fixtures.shelf import SLUGS


def main() -> None:
    """Measure and write."""
    readme, method = ROOT / "README.md", ROOT / "docs" / "method.md"
    placed = displacement.displacement_table(SLUGS, displacement.placed_by_each())
    write_block("displacement", placed, page=readme)
    tally = injected_faults.measure(injected_faults.COUNT, injected_faults.SEED)
    write_block("faults", injected_faults.class_table(tally), page=readme)
    faults = injected_faults.report(tally, count=injected_faults.COUNT, seed=injected_faults.SEED)
    write_block("faults", faults, page=method)


if __name__ == "__main__":
    main()
