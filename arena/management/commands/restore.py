"""`manage.py restore FILE`: a backup into an empty installation, all of it or nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.errors import ArenaError
from arena.management.backups.restoring import restore_backup
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """Check a backup whole, then restore it."""

    help = (
        "Restore a backup of `manage.py backup` into an empty installation: a new SQLite file or "
        "an empty PostgreSQL database, whichever DATABASE_URL names."
    )

    def add_arguments(self, parser: CommandParser) -> None:
        """Declare the options."""
        parser.add_argument("file", type=Path)

    def handle(self, *args: Any, **options: Any) -> None:
        """Restore it."""
        try:
            restore_backup(options["file"], say=self.stdout.write)
        except (ArenaError, OSError) as error:
            raise CommandError(f"Nothing was restored. {error}") from error
        self.stdout.write("Restored. Start it with `manage.py serve`.")
