"""`manage.py import study|nuplan_results`: what was written or driven elsewhere."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandParser

from arena.management.backups import import_study
from augment.services import TerminalCommand
from augment.services.driving import import_results


class Command(TerminalCommand):
    """Check what is given whole, then take it in."""

    failure = "Nothing was imported."
    help = "Take in a whole study, or nuPlan's results; others: import_scene, import_votes."

    def add_arguments(self, parser: CommandParser) -> None:
        """Declare the options."""
        kinds = parser.add_subparsers(dest="what", required=True, metavar="WHAT")
        study = kinds.add_parser("study", help="a folder of `manage.py export study`")
        study.add_argument("folder", type=Path)
        driven = kinds.add_parser("nuplan_results", help="what nuPlan's simulation wrote")
        driven.add_argument("folders", type=Path, nargs="+", help="of experiments")
        driven.add_argument(
            "--tokens",
            type=Path,
            required=True,
            help="nuplan_tokens.csv of `manage.py export scenarios JOB --format interplan`",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Take it in."""
        if options["what"] == "study":
            import_study(options["folder"], say=self.stdout.write)
            self.stdout.write(
                "Imported. Make an account to look at it: manage.py add_person NAME --role admin"
            )
            return
        imported = import_results(tokens=options["tokens"], folders=options["folders"])
        for line in imported.strangers:
            self.stdout.write(f"Left out: {line}.")
        self.stdout.write(
            f"{imported.kept} results of nuPlan kept, {imported.failed} of them failed; "
            f"{len(imported.strangers)} left out."
        )
