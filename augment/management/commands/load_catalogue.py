"""Bring the catalogue's scenes and scenarios into the database."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError

from augment.errors import AugmentError
from augment.management.arguments import add_folder_argument
from augment.services.scenarios.catalogue import load_catalogue
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """load_catalogue [--folder FOLDER]."""

    help = (
        "Load the catalogue: base scenes, instructions and reference modifications. "
        "Running it again changes nothing."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Where the catalogue is."""
        add_folder_argument(parser)

    def handle(self, *args: Any, **options: Any) -> None:
        """Load it and say what that changed."""
        try:
            report = load_catalogue(folder=options["folder"])
        except AugmentError as error:
            raise CommandError(str(error)) from error
        for kind in ("scenes", "scenarios"):
            added, changed, unchanged = (
                getattr(report, f"{kind}_{step}") for step in ("added", "changed", "unchanged")
            )
            self.stdout.write(f"{kind}: {added} added, {changed} changed, {unchanged} unchanged")
