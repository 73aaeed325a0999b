"""Bring a recorded or written scene into the database."""

from pathlib import Path
from typing import Any

from augment.formats.readers import READERS
from augment.services.scenarios.scene_imports import import_scene, note_sentences
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py import_scene [FORMAT] PATH [--slug S] [--frame N] [--ego NAME] ...`."""

    help = "Import one moment of a recording, or a scene in the own JSON. Formats: " + "; ".join(
        f"{reader.name}, {reader.title}" for reader in READERS.values()
    )

    arguments = {
        "source": {
            **{"nargs": "?", "metavar": "FORMAT"},
            "help": f"what PATH holds: {' or '.join(READERS)}; recognised when not given",
        },
        "path": {"type": Path, "help": "the file or folder"},
        "--frame": {
            "type": int,
            "help": "the step that becomes t0, from 0 (default: what the format means, else 0)",
        },
        "--item": {
            "help": "which part of a file with several: the number of a record, a planning "
            "problem, a lidar_pc token (default: the first)"
        },
        "--ego": {
            "metavar": "NAME",
            "dest": "item",
            "help": "which entity of an OpenSCENARIO file is the ego (default: Ego or hero)",
        },
        "--ego-at": {
            "metavar": "LANE,S",
            "help": "put an ego on a lane, as the source calls it, S metres along (default: the "
            "recorded one)",
        },
        "--slug": {
            "help": "the scene's name: lower-case letters, digits, hyphens (default: the file's)"
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Import, and say what came in and what the source left open."""
        row = import_scene(
            source=options["source"],
            path=options["path"],
            frame=options["frame"],
            item=f"{options['item'] or ''}@{put}"
            if (put := options["ego_at"])
            else options["item"],
            slug=options["slug"],
        )
        counts = ", ".join(
            f"{len(row.document[name])} {name}"
            for name in ("agents", "lanes", "connectors", "areas")
        )
        self.stdout.write(f"Imported scene {row.slug}: {counts} besides the ego.")
        for note in note_sentences(row.notes):
            self.stdout.write(f"  {note}")
