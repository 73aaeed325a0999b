"""manage.py open_study: plan a study and open it."""

from typing import Any

from django.core.management.base import CommandParser

from arena.studies.queries import usual_checks
from arena.studies.services.opening import open_study, preregistration_sha256
from arena.studies.services.plan import PLAN_INPUTS, SAMPLES, StudyPlan
from arena.voting.queries.ballots import find_undrawn
from arena.voting.services.drawing import draw_pictures
from augment.services import TerminalCommand, add_options
from augment.services.running import resolve_contestants
from augment.services.scenarios import resolve_scenarios


class Command(TerminalCommand):
    """Entry point of arena.studies.services.opening.open_study."""

    help = "Plan blind, balanced matchups for experts and open the study."

    def add_arguments(self, parser: CommandParser) -> None:
        """An option for all that a plan asks for."""
        add_options(parser, PLAN_INPUTS)
        parser.set_defaults(checks=None)

    def handle(self, *args: Any, **options: Any) -> None:
        """Open the study and say what was planned."""
        values = {field.name: options[field.name] for field in PLAN_INPUTS}
        values |= {
            "contestants": resolve_contestants(options["contestants"]),
            "scenarios": resolve_scenarios(options["scenarios"]),
            "checks": self._checks(options["checks"]),
        }
        study = open_study(StudyPlan.read(values))
        rules, sha256 = study.rules, preregistration_sha256(study)
        self.stdout.write(
            f"Opened {study.name!r} ({study.code}): {study.matchups.count()} matchups for "
            f"{len(rules['experts'])} experts."
        )
        self.stdout.write(f"Preregistration: sha256 {sha256}.")
        names = ", ".join(repr(job["name"]) for job in rules["jobs"])
        samples = SAMPLES[rules["samples"]]
        self.stdout.write(f"It shows augmentations of {names}, of several samples {samples}.")
        self.stdout.write("The pictures of its pairs are drawn now; voters see what is ready.")
        while draw_pictures(study, within_s=10.0):
            self.stdout.write(f"{find_undrawn(study).count()} of {study.matchups.count()} wait.")

    def _checks(self, percent: float | None) -> float:
        """The percentage; without one it depends on what was drawn, and that is said."""
        if percent is not None:
            return percent
        usual = usual_checks()
        if not usual:
            self.stdout.write(
                "No attention checks: nobody has drawn pictures for them (manage.py draw_checks)."
            )
        return usual
