"""manage.py hand_over: let others judge what an expert has not judged."""

from typing import Any

from arena.studies.queries import study_named
from arena.studies.services.taking_part import hand_over
from augment.services import TerminalCommand


class Command(TerminalCommand):
    """Entry point of arena.studies.services.taking_part."""

    help = "Hand an expert's remaining pairs over to others, re-planned in one go."

    arguments = {
        "study": {"help": "its name or its code"},
        "expert": {"metavar": "USERNAME", "help": "whose pairs are handed over"},
        "--to": {"nargs": "+", "required": True, "metavar": "USERNAME"},
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Hand over and say who got how many."""
        taken = hand_over(
            study=study_named(options["study"]), username=options["expert"], to=options["to"]
        )
        for name, votes in taken.items():
            self.stdout.write(f"{name} takes {votes} votes.")
