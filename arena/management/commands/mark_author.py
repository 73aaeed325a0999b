"""manage.py mark_author: say who made which contestant of a study."""

from typing import Any

from arena.people.links import mark_author
from arena.studies.queries import expert_named, study_named
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Entry point of arena.people.links.mark_author."""

    help = "Mark an expert of a study as author of a contestant; experts see nothing of it."

    arguments = {
        "study": {"help": "its name or its code"},
        "expert": {"metavar": "USERNAME"},
        "contestant": {"metavar": "SLUG"},
        "--take-back": {"action": "store_true", "help": "forget it again; the log keeps both"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Mark or take back, and say so."""
        study, slug = study_named(options["study"]), options["contestant"]
        expert, is_author = expert_named(study, options["expert"]), not options["take_back"]
        mark_author(study=study, expert=expert, contestant=slug, is_author=is_author)
        state = "marked" if is_author else "not marked"
        self.stdout.write(f"{expert.username} is {state} as author of {slug}.")
