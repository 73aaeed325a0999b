"""manage.py rate_csv: rate votes from elsewhere."""

from inspect import signature
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.management import rate_csv
from augment.services import TerminalCommand

_OPTIONS = tuple(signature(rate_csv.run).parameters)


class Command(TerminalCommand):
    """Entry point of arena.management.rate_csv for Django; manage.py goes there itself."""

    help = rate_csv.HELP
    requires_system_checks = []

    def add_arguments(self, parser: CommandParser) -> None:
        """Add the file and the rules of rating."""
        rate_csv.add_arguments(parser)

    def handle(self, *args: Any, **options: Any) -> None:
        """Rate, then print."""
        try:
            printed = rate_csv.run(**{name: options[name] for name in _OPTIONS})
        except rate_csv.CsvNotRated as error:
            raise CommandError(str(error)) from error
        self.stdout.write_data(printed)
