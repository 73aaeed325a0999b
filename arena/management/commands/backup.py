"""`manage.py backup FILE`: everything in one file, while everything runs."""

from pathlib import Path
from typing import Any

from django.utils import timezone

from arena.management.backups import take_backup
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Write rows, pictures and the secret key into one new file."""

    failure = "No backup was made."
    help = "Write everything that this installation knows into one file, while it runs."

    arguments = {"file": {"type": Path, "help": "for example arena-2026-11-22.zip"}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Take it."""
        path: Path = options["file"]
        take_backup(path, now=timezone.now(), say=self.stdout.write)
        self.stdout.write(f"{path}: {path.stat().st_size / 1e6:.1f} MB, for its owner alone")
