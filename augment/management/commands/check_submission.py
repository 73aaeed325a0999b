"""Say what the server would say of a submission, without a database."""

from pathlib import Path
from typing import Any

from augment.benchmark import folder, report, submission
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """check_submission FOLDER --benchmark FOLDER."""

    help = (
        "Read a submission to a benchmark and print what became of each task: read, refused, "
        "unreadable or missing, and its displacement on the practice tasks. The server says the "
        "same. It ends with status 1 where the submission can't be taken as a whole."
    )
    failure = "The submission was not taken."
    requires_system_checks = ()

    arguments = {
        "submission": {"type": Path, "help": "the folder, or a zip of it"},
        "--benchmark": {"type": Path, "required": True, "help": "the benchmark's folder"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Print a line for each task and sample, and the summary."""
        benchmark = folder.read_folder(options["benchmark"])
        digest = folder.checksum(benchmark)
        for line in report.describe_report(
            submission.check_submission(benchmark, options["submission"], checksum=digest)
        ):
            self.stdout.write(line)
