"""Hold the catalogue's references against their intents, the checks and the camera."""

from typing import Any

from django.core.management.base import CommandError

from augment.management.arguments import FOLDER, sets_argument, sets_of
from augment.services.scenarios.catalogue_check import check_catalogue
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """check_catalogue [--set paper|hard|all] [--folder FOLDER]."""

    help = (
        "Check that every reference passes the geometric checks, agrees with the intent "
        "of its instruction and fits into its picture; exit status 1 with reasons otherwise."
    )

    arguments = {**FOLDER, **sets_argument("all")}

    def handle(self, *args: Any, **options: Any) -> None:
        """Print a line for each scenario, then the reasons."""
        checked = check_catalogue(folder=options["folder"], sets=sets_of(options))
        width = max((len(scenario.slug) for scenario in checked.scenarios), default=8)
        self.stdout.write(f"{'scenario':{width}}  statements  result")
        for one in checked.scenarios:
            result = f"{len(one.reasons)} reasons" if one.reasons else "good"
            self.stdout.write(f"{one.slug:{width}}  {one.statements:>10}  {result}")
        reasons = [f"{one.slug}: {text}" for one in checked.scenarios for text in one.reasons]
        if reasons or checked.reasons:
            raise CommandError("\n".join([*reasons, *checked.reasons]))
        self.stdout.write(f"{len(checked.scenarios)} scenarios are as their intents ask for.")
