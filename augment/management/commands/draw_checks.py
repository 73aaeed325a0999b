"""Draw pictures for attention checks."""

from typing import Any

from augment.services.scenarios.choosing import resolve_scenarios
from augment.services.scenarios.pictures import draw_checks
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """draw_checks SLUG ..."""

    help = (
        "Draw, for scenarios with a reference, a picture that is broken on purpose: everything "
        "that the reference places, heaped across the ego. Studies that are opened afterwards can "
        "hide attention checks among their pairs."
    )

    arguments = {"scenarios": {"nargs": "+", "metavar": "SLUG", "help": "or: all, or: catalogue"}}

    def handle(self, *args: Any, **options: Any) -> None:
        """Draw what is missing and say how many there are."""
        drawn = draw_checks(scenarios=resolve_scenarios(options["scenarios"]))
        self.stdout.write(f"{len(drawn)} pictures drawn for attention checks.")
