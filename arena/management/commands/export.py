"""manage.py export: write results to files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from django.core.management.base import BaseCommand, CommandError, CommandParser

from arena.errors import ArenaError, StudyStillOpen
from arena.exports.files import write_whole
from arena.exports.tables import leaderboard_table
from arena.exports.writers import FORMATS, Format, format_named
from arena.models import Study
from arena.queries.results import snapshot_to_export
from arena.queries.studies import study_named
from arena.services.ratings import log_early_look
from augment.errors import AugmentError


class Command(BaseCommand):
    """One subcommand per kind of result."""

    help = "Write results to files; the same snapshot always gives the same bytes."

    def add_arguments(self, parser: CommandParser) -> None:
        """What to export, of which study, where to."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        leaderboard = kinds.add_parser("leaderboard", help="the newest rating of a study")
        leaderboard.add_argument("study", help="its name or its code")
        leaderboard.add_argument("--format", default="csv", help=f"one of {', '.join(FORMATS)}")
        leaderboard.add_argument("--out", required=True, help="a file; - for standard output")
        leaderboard.add_argument(
            "--early", action="store_true", help="export from an open study; this is logged"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the file."""
        try:
            study = study_named(options["study"])
            chosen = format_named(options["format"])
            snapshot = snapshot_to_export(study)
            if study.state == Study.State.OPEN:
                if not options["early"]:
                    raise StudyStillOpen(study.name)
                log_early_look(study=study, actor=None, what=f"leaderboard as {options['format']}")
            content = chosen.write(leaderboard_table(snapshot))
        except (ArenaError, AugmentError) as error:
            raise CommandError(str(error)) from error
        self._deliver(content, options["out"], chosen)

    def _deliver(self, content: bytes, out: str, chosen: Format) -> None:
        if out == "-":
            if not chosen.is_text:
                raise CommandError(f"A {chosen.suffix} file can't go to a terminal: name a file.")
            self.stdout.write(content.decode(), ending="")
            return
        try:
            write_whole(Path(out), content)
        except OSError as error:
            raise CommandError(f"{out} can't be written: {error.strerror}.") from error
        self.stderr.write(f"Wrote {out}.")
