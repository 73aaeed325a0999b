"""manage.py export: write results to files."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.errors import ArenaError
from arena.exports.files import write_whole
from arena.management.exporting import KINDS, ExportedFile, add_kinds
from arena.results.exports.board_files import board_folder, write_folder
from arena.results.exports.study_folder import write_study
from arena.results.services.boards import board_named
from arena.scenarios.exports.benchmarks import write_benchmark
from arena.studies.queries import study_named
from augment.errors import AugmentError
from augment.services import TerminalCommand
from augment.services.benchmarks import find_benchmark


class Command(TerminalCommand):
    """One subcommand per kind of result."""

    help = "Write results to files; the same snapshot or job always gives the same bytes."

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the kinds of export, the study or job, and the target."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        add_kinds(kinds)
        whole = kinds.add_parser("study", help="a whole study")
        whole.add_argument("study", help="its name or its code; it is closed")
        handed_out = kinds.add_parser("benchmark", help="what entrants of a benchmark get")
        handed_out.add_argument("benchmark", help="its name, such as hard or hard@2, or its code")
        board = kinds.add_parser("board", help="all tables of a board, for any web host")
        board.add_argument("board", help="its name or its code")
        for parser in (whole, handed_out, board):
            parser.add_argument("--out", required=True, help="a folder; a new one but for boards")

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the file."""
        if options["what"] in KINDS:
            written = KINDS[options["what"]].write(options, self.stderr.write)
            self._deliver(written, options["out"])
            return
        try:
            if options["what"] == "benchmark":
                row = find_benchmark(options["benchmark"])
                for warning in write_benchmark(row, Path(options["out"])):
                    self.stderr.write(f"Warning: {warning}")
            elif options["what"] == "board":
                write_folder(board_folder(board_named(options["board"])), Path(options["out"]))
            else:
                study = study_named(options["study"])
                write_study(study, Path(options["out"]), say=self.stderr.write)
        except (ArenaError, AugmentError, OSError) as error:
            raise CommandError(f"Nothing was exported. {error}") from error
        self.stderr.write(f"Wrote {options['out']}.")

    def _deliver(self, written: ExportedFile, out: str) -> None:
        if out == "-":
            if not written.is_text:
                raise CommandError(f"A {written.suffix} file can't go to a terminal: name a file.")
            self.stdout.write_data(written.content.decode())
            return
        path, failure = Path(out), f"{out} can't be made a folder"
        try:
            if written.name and path.suffix != f".{written.suffix}":
                path.mkdir(parents=True, exist_ok=True)
                path /= written.name
            failure = f"{path} can't be written"
            write_whole(path, written.content)
        except OSError as error:
            raise CommandError(f"{failure}: {error.strerror}.") from error
        self.stderr.write(f"Wrote {path}.")
