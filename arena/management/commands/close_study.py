"""manage.py close_study: take no more votes."""

from typing import Any

from arena.studies.queries import study_named
from arena.studies.services.opening import close_study
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Entry point of arena.studies.services.opening.close_study."""

    help = "Close a study: it takes no more votes, and its results may be seen."

    arguments = {"study": {"help": "its name or its code"}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Close the study and say so."""
        study = close_study(study=study_named(options["study"]))
        self.stdout.write(f"Closed {study.name!r}.")
