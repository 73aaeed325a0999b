"""Bring many moments of a recording into the database."""

from argparse import ArgumentParser, ArgumentTypeError
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.errors import AugmentError
from augment.formats.readers import READERS
from augment.services.scenarios.scene_imports import ImportedMoment, import_log, notes_of
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """`manage.py import_log [FORMAT] PATH --slug S [--every 3s] [--limit N]`."""

    help = "Import a scene from every few seconds of a recording."

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Say what the command takes."""
        parser.add_argument(
            "source",
            nargs="?",
            metavar="FORMAT",
            help=f"what PATH holds: {' or '.join(READERS)}; recognised when not given",
        )
        parser.add_argument("path", type=Path, help="the file or folder")
        parser.add_argument(
            "--every",
            type=_seconds,
            default=3.0,
            help="how far the scenes lie apart: 3s, 0.5s (default 3s)",
        )
        parser.add_argument("--limit", type=_count, help="how many scenes at most")
        parser.add_argument(
            "--slug", required=True, help="what the scenes' names begin with; a number follows"
        )

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
                self.stdout.write(_line(one))
                self.stdout.flush()
                notes |= dict.fromkeys(str(note) for note in notes_of(one.row))
        except AugmentError as fault:
            raise CommandError(f"{fault} {new} scenes were imported before.") from fault
        for note in notes:
            self.stdout.write(f"  {note}")
        self.stdout.write(f"Imported {new} scenes.")


def _line(one: ImportedMoment) -> str:
    if not one.is_new:
        return f"{one.moment}: the same scene is stored already, as {one.row.slug}."
    agents = len(one.row.document["agents"])
    return f"{one.moment}: {one.row.slug}, {agents} agents."


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
