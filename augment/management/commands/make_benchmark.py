"""Make a benchmark of scenarios."""

from typing import Any

from augment.services.benchmarks.benchmarks import BenchmarkRequest, make_benchmark
from augment.services.inputs import read_request
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """make_benchmark NAME --title TITLE --scenarios X Y ..."""

    help = (
        "Make a benchmark, or the next version of one: scenarios that are handed out, some of "
        "them with their references. `manage.py export benchmark NAME` writes its folder."
    )

    request = BenchmarkRequest

    def handle(self, *args: Any, **options: Any) -> None:
        """Make it and say what came of it."""
        row = make_benchmark(read_request(BenchmarkRequest, options))
        practice = row.items.filter(split="practice").count()
        self.stdout.write(
            f"{row}: {row.items.count()} tasks, {practice} for practice. SHA-256 {row.checksum}"
        )
