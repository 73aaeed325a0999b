"""Turn interPlan's special scenarios into reference modifications."""

from __future__ import annotations

import json
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.scene.codec import modification_to_document
from augment.services.scenarios.interplan import references_from_interplan
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """read_interplan FILE --out FOLDER [--scene TOKEN=SLUG ...]."""

    help = (
        "Write each special scenario of an interPlan modification file as a modification in the "
        "own JSON, which add_scenario --reference takes."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Say what the command takes."""
        parser.add_argument("file", type=Path, help="interPlan's YAML")
        parser.add_argument("--out", type=Path, required=True, help="a folder for the JSON files")
        parser.add_argument(
            "--scene",
            action="append",
            metavar="TOKEN=SLUG",
            help="a stored scene in the file's frame; default: the tokens of our own exports",
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Write a file for each, and say what was left out."""
        try:
            found = references_from_interplan(options["file"], scenes=_scenes(options["scene"]))
            options["out"].mkdir(parents=True, exist_ok=True)
            for entry in found.entries:
                document = modification_to_document(entry.modification)
                file = options["out"] / f"{entry.id}.json"
                file.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")
                left_out = f"; left out: {', '.join(entry.left_out)}" if entry.left_out else ""
                self.stdout.write(f"{file}: {entry.type} on {entry.scene}{left_out}")
        except OSError as error:
            raise CommandError(f"{options['out']} can't be written: {error.strerror}.") from error
        for left_out in found.left_out:
            self.stderr.write(f"Left out: {left_out}.")
        for token, number in found.passed_over.items():
            self.stderr.write(
                f"Passed over: {token}, {number} special scenarios of a scene "
                "that is not here; --scene TOKEN=SLUG names it."
            )
        self.stdout.write(f"{len(found.entries)} special scenarios read.")


def _scenes(given: list[str] | None) -> dict[str, str] | None:
    if given is None:
        return None
    pairs = [one.partition("=") for one in given]
    if not all(token and slug for token, _, slug in pairs):
        raise CommandError("--scene takes TOKEN=SLUG.")
    return {token: slug for token, _, slug in pairs}
