"""`manage.py import study FOLDER`: what `manage.py export study` wrote, elsewhere."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandParser

from arena.management.backups import import_study
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """Check a folder whole, then take it in."""

    failure = "Nothing was imported."
    help = "Take in a whole study; other imports: import_scene, import_votes."

    def add_arguments(self, parser: CommandParser) -> None:
        """Declare the options."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        study = kinds.add_parser("study", help="a folder of `manage.py export study`")
        study.add_argument("folder", type=Path)

    def handle(self, *args: Any, **options: Any) -> None:
        """Take it in."""
        import_study(options["folder"], say=self.stdout.write)
        self.stdout.write(
            "Imported. Make an account to look at it: manage.py add_person NAME --role admin"
        )
