"""Bring many moments of a recording into the database."""

from argparse import ArgumentTypeError
from typing import Any

from django.core.management.base import CommandError

from augment.errors import AugmentError
from augment.management.arguments import SOURCE
from augment.services.scenarios.scene_imports import import_log, notes_of
from augment.services.terminal import TerminalCommand


def _seconds(given: str) -> float:
    try:
        value = float(given.removesuffix("s"))
    except ValueError:
        value = 0.0
    if not 0.05 <= value <= 3600.0:
        raise ArgumentTypeError(f"{given!r} is no time from 0.05s to 3600s")
    return value


def _count(given: str) -> int:
    if not given.isdecimal() or int(given) < 1:
        raise ArgumentTypeError(f"{given!r} is no number from 1 on")
    return int(given)


class Command(TerminalCommand):
    """`manage.py import_log [FORMAT] PATH --slug S [--every 3s] [--limit N]`."""

    help = "Import a scene from every few seconds of a recording."

    arguments = {
        **SOURCE,
        "--every": {
            **{"type": _seconds, "default": 3.0},
            "help": "how far the scenes lie apart: 3s, 0.5s (default 3s)",
        },
        "--limit": {"type": _count, "help": "how many scenes at most"},
        "--slug": {
            "required": True,
            "help": "what the scenes' names begin with; a number follows",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Import one by one, and say each."""
        new, notes = 0, dict[str, None]()
        try:
            for one in import_log(
                source=options["source"],
                path=options["path"],
                every_s=options["every"],
                limit=options["limit"],
                slug=options["slug"],
            ):
                new += one.is_new
                what = f"{one.row.slug}, {len(one.row.document['agents'])} agents"
                if not one.is_new:
                    what = f"the same scene is stored already, as {one.row.slug}"
                self.stdout.write(f"{one.moment}: {what}.")
                self.stdout.flush()
                notes |= dict.fromkeys(str(note) for note in notes_of(one.row))
        except AugmentError as fault:
            raise CommandError(f"{fault} {new} scenes were imported before.") from fault
        for note in notes:
            self.stdout.write(f"  {note}")
        self.stdout.write(f"Imported {new} scenes.")
