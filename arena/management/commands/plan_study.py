"""manage.py plan_study: how many votes a study needs, and what they will tell."""

from dataclasses import asdict
from typing import Any

from django.core.management.base import CommandError, CommandParser

from arena.studies.queries import study_named
from arena.studies.services.outlook import (
    ESTIMATE_INPUTS,
    Prospect,
    StudyEstimate,
    foretell,
    known_of,
)
from augment.errors import AugmentError
from augment.services.inputs import add_options, check_bounds
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """The door to arena.studies.services.outlook."""

    help = "Work out the votes of a study before there is one; needs nothing in the database."

    def add_arguments(self, parser: CommandParser) -> None:
        """The design; whatever is left open is taken from the study, else guessed."""
        parser.add_argument("--like", metavar="STUDY", help="name of a study to take numbers from")
        add_options(parser, ESTIMATE_INPUTS)
        parser.set_defaults(**dict.fromkeys(field.name for field in ESTIMATE_INPUTS))

    def handle(self, *args: Any, **options: Any) -> None:
        """Say what it takes."""
        names = [field.name for field in ESTIMATE_INPUTS]
        given = {name: options[name] for name in names if options[name] is not None}
        known = known_of(study_named(options["like"])) if options["like"] else {}
        estimate = StudyEstimate(**known | given)
        try:
            check_bounds(estimate)
            goals = foretell(estimate)
        except AugmentError as error:
            raise CommandError(str(error)) from error
        for name, value in asdict(estimate).items():
            origin = "given" if name in given else "known" if name in known else "guessed"
            if value is not None:
                self.stdout.write(f"{name.replace('_', ' ')}: {value:g} ({origin})")
        self.stdout.write("")
        for goal in goals:
            found = goal.prospect
            text = goal.obstacle if found is None else _line(found, estimate.power)
            self.stdout.write(f"{goal.text}: {text}")


def _line(found: Prospect, power: float) -> str:
    return (
        f"{found.votes_per_expert:,} votes per expert, {found.votes:,} in all, "
        f"{found.minutes:.0f} minutes each; intervals ±{found.half_width:.0f}, the widest "
        f"±{found.widest:.0f}; told apart from {found.gap:.0f} points on with a chance of "
        f"{power:g} %."
    )
