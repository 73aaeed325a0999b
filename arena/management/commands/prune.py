"""`manage.py prune --older-than 180`: remove what models were asked and answered long ago."""

from datetime import timedelta
from typing import Any

from django.utils import timezone

from arena.management.arguments import at_least
from arena.site.services import find_removable, remove_old
from augment.services.terminal import TerminalCommand

LOST = """Afterwards these answers can't be used again: the same request is asked, and paid, anew.
Transcripts, on pages and exported, are without messages and answers, and so is the study's folder.
Tokens, money, times, modifications, pictures, drives and votes stay. There is no way back but a
backup: take one first (manage.py backup FILE)."""


class Command(TerminalCommand):
    """Say what would go; with --yes let it go."""

    help = "Count the requests and answers of models that are that old; with --yes remove them."

    arguments = {
        "--older-than": {"required": True, "metavar": "DAYS", "type": at_least(1)},
        "--yes": {"action": "store_true", "help": "remove them; without it nothing is changed"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Count, and remove where that is wanted."""
        now = timezone.now()
        before = now - timedelta(days=options["older_than"])
        number = find_removable(before).count()
        if not number:
            self.stdout.write("Nothing is that old, or it belongs to what goes on.")
            return
        self.stdout.write(f"Requests with their answers: {number:,}\n\n{LOST}")
        if options["yes"]:
            for done, of in remove_old(before=before, now=now):
                self.stdout.write(f"{done:,} of {of:,} are removed")
