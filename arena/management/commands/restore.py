"""`manage.py restore FILE`: a backup into an empty installation, all of it or nothing."""

from pathlib import Path
from typing import Any

from arena.management.backups import restore_backup
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Check a backup whole, then restore it."""

    failure = "Nothing was restored."
    help = (
        "Restore a backup of `manage.py backup` into an empty installation: a new SQLite file or "
        "an empty PostgreSQL database, whichever DATABASE_URL names."
    )

    arguments = {"file": {"type": Path}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Restore it."""
        restore_backup(options["file"], say=self.stdout.write)
        self.stdout.write("Restored. Start it with `manage.py serve`.")
