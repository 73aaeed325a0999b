"""manage.py cancel_study: give an open study up."""

from typing import Any

from django.core.management.base import CommandError

from arena.studies.queries import study_named
from arena.studies.services.opening import cancel_study
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Entry point of arena.studies.services.opening.cancel_study."""

    help = "Cancel an open study for good: no more votes, never any results; its votes stay."

    arguments = {
        "study": {"help": "its name or its code"},
        "--sure": {"metavar": "NAME", "required": True, "help": "its name once more"},
        "--why": {"default": "", "help": "a reason, for the log"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Cancel the study and say so."""
        study = study_named(options["study"])
        if options["sure"] != study.name:
            raise CommandError(f"Nothing was cancelled: --sure must say {study.name!r}.")
        cancel_study(study=study, why=options["why"])
        self.stdout.write(f"Cancelled {study.name!r}. Its votes stay: export votes.")
