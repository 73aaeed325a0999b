"""Make scenarios of interPlan's special scenarios, where nuPlan's logs are at hand."""

from collections import Counter
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.services.scenarios.interplan import StepKind, import_interplan
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py import_interplan FOLDER [--nuplan FOLDER]`."""

    help = (
        "Import interPlan's special scenarios with their human references: a scene for each base "
        "token that lies in one of the nuPlan logs, a scenario for each special scenario. What "
        "is there already stays, so it can be repeated."
    )

    arguments = {
        "folder": {"type": Path, "help": "holds interPlan's modification file (YAML) somewhere"},
        "--nuplan": {
            **{"type": Path, "metavar": "FOLDER"},
            "help": "holds nuPlan's .db files and maps/ somewhere; default: the same folder",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Import one by one, and say each."""
        counts: Counter[StepKind] = Counter()
        for step in import_interplan(folder=options["folder"], data=options["nuplan"]):
            counts[step.kind] += 1
            self.stdout.write(step.text)
            self.stdout.flush()
        new, old = counts[StepKind.NEW], counts[StepKind.OLD]
        skipped = f"{counts[StepKind.SKIPPED]} skipped"
        summary = f"{new} scenarios imported, {old} were there already, {skipped}."
        if not new + old:
            raise CommandError(
                f"{summary} {counts[StepKind.LOG]} logs were looked through; "
                "the lines above say why each was skipped."
            )
        self.stdout.write(summary)
