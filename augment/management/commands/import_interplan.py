"""Make scenarios of interPlan's special scenarios, where nuPlan's logs are at hand."""

from __future__ import annotations

from argparse import ArgumentParser
from collections import Counter
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.services.scenarios.interplan import (
    FileLeftOut,
    LogLooked,
    ScenarioDone,
    ScenarioSkipped,
    Step,
    import_interplan,
)
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py import_interplan FOLDER [--nuplan FOLDER] [--instructions FILE]`."""

    help = (
        "Import interPlan's special scenarios with their human references: a scene for each base "
        "token that lies in one of the nuPlan logs, a scenario for each special scenario. What "
        "is there already stays, so it can be repeated."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Say what the command takes."""
        parser.add_argument(
            "folder", type=Path, help="holds interPlan's modification file (YAML) somewhere"
        )
        parser.add_argument(
            "--nuplan",
            type=Path,
            metavar="FOLDER",
            help="holds nuPlan's .db files and maps/ somewhere; default: the same folder",
        )
        parser.add_argument(
            "--instructions",
            type=Path,
            metavar="FILE",
            help="a CSV file with the columns id and instruction; without one the sentences are "
            "made from the references",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Import one by one, and say each."""
        counts: Counter[str] = Counter()
        for step in import_interplan(
            folder=options["folder"], data=options["nuplan"], instructions=options["instructions"]
        ):
            counts[_kind(step)] += 1
            counts["same"] += isinstance(step, ScenarioDone) and bool(step.same_as)
            self.stdout.write(_line(step))
            self.stdout.flush()
        new, old, skipped = counts["new"], counts["old"], counts["skipped"]
        if counts["same"]:
            self.stdout.write(f"{counts['same']} scenarios are the same as an earlier one.")
        told = f"{new} scenarios imported, {old} were there already, {skipped} skipped."
        if not new + old:
            raise CommandError(
                f"{told} {counts['log']} logs were looked through; "
                "the lines above say why each was skipped."
            )
        self.stdout.write(told)


def _kind(step: Step) -> str:
    match step:
        case ScenarioDone():
            return "new" if step.is_new else "old"
        case ScenarioSkipped():
            return "skipped"
        case LogLooked():
            return "log"
        case FileLeftOut():
            return "left out"


def _line(step: Step) -> str:
    match step:
        case LogLooked():
            told = step.fault or f"{len(step.tokens)} base tokens"
            return f"Log {step.number} of {step.of}, {step.path.name}: {told}"
        case ScenarioDone():
            left_out = f"; left out: {', '.join(step.left_out)}" if step.left_out else ""
            done = "" if step.is_new else " was there already"
            same = f"; the same as {step.same_as}" if step.same_as else ""
            return f"{step.id}: {step.row.slug}{done}{same}{left_out}"
        case ScenarioSkipped():
            return f"{step.id}: skipped. {step.reason}"
        case FileLeftOut():
            return f"Left out: {step.text}."
