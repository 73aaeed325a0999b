"""What `rate_csv` prints of one file, by every method."""

from pathlib import Path

from arena.management.rate_csv import run
from tests.golden.conftest import Check
from tests.management.votes import WITH_CLUSTERS, clustered

ASKED = (("bt", None), ("bt", "closed"), ("davidson", None), ("elo", None))
"""Methods with their intervals; None for what fits the method."""


def test_rate_csv_prints_what_it_printed(check: Check, tmp_path: Path) -> None:
    file = tmp_path / "votes.csv"
    better = [f"a,b,model_a,j{number % 23},i{number % 29}" for number in range(120)]
    file.write_text("\n".join([WITH_CLUSTERS, *clustered(600), *better]) + "\n")
    printed = []
    for method, intervals in ASKED:
        for form in ("table", "csv", "latex"):
            said = run(file=str(file), method=method, intervals=intervals, rounds=100, format=form)
            printed += [f"=== {method} {intervals or ''} {form}", said]
    check("rate_csv.txt", "\n".join(printed))
