"""Bring a recorded or written scene into the database."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.errors import AugmentError
from augment.services.scenarios.scenes import SOURCES, import_scene
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py import_scene av2 PATH --frame N --slug S`."""

    help = "Import a scene: a frame of an Argoverse 2 Sensor log, or a scene in the own JSON."

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Say what the command takes."""
        parser.add_argument("source", help=f"what PATH holds: {' or '.join(SOURCES)}")
        parser.add_argument("path", type=Path, help="the log's folder, or the JSON file")
        parser.add_argument(
            "--frame", type=int, default=0, help="the annotated sweep to take, from 0 (default 0)"
        )
        parser.add_argument(
            "--slug", required=True, help="the scene's name: lower-case letters, digits, hyphens"
        )

    def handle(self, *args: Any, **options: Any) -> None:
        """Import, and say what came in."""
        try:
            row = import_scene(
                source=options["source"],
                path=options["path"],
                frame=options["frame"],
                slug=options["slug"],
            )
        except AugmentError as fault:
            raise CommandError(str(fault)) from fault
        counts = ", ".join(
            f"{len(row.document[name])} {name}"
            for name in ("agents", "lanes", "connectors", "areas")
        )
        self.stdout.write(f"Imported scene {row.slug}: {counts} besides the ego.")
