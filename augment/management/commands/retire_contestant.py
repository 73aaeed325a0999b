"""Retire a contestant, or take that back."""

from argparse import ArgumentParser
from typing import Any

from augment.models import Contestant
from augment.services.events import retire, take_back
from augment.services.running.choosing import resolve_contestants
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """retire_contestant SLUG ... [--take-back]."""

    help = (
        "Hide contestants in forms and from `all`. What they made stays in every result, and "
        "commands that name them still run them."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Whom."""
        parser.add_argument("slugs", nargs="+", metavar="SLUG")
        parser.add_argument("--take-back", action="store_true", help="offer them again")

    def handle(self, *args: Any, **options: Any) -> None:
        """Retire all of them or none."""
        slugs = dict.fromkeys(resolve_contestants(options["slugs"]))
        for row in Contestant.objects.filter(slug__in=slugs):
            if options["take_back"]:
                take_back(row)
                self.stdout.write(f"{row.slug}: offered again.")
            else:
                retire(row)
                self.stdout.write(f"{row.slug}: retired.")
