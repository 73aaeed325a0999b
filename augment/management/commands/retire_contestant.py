"""Retire a contestant, or take that back."""

from __future__ import annotations

from argparse import ArgumentParser
from typing import Any

from django.core.management.base import CommandError

from augment.errors import UnknownName
from augment.models import Contestant
from augment.services.events import retire, take_back
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """retire_contestant SLUG ... [--take-back]."""

    help = (
        "Hide contestants in forms and from `all`. What they made stays in every result, and "
        "commands that name them still run them."
    )

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Whom."""
        parser.add_argument("slugs", nargs="+", metavar="SLUG")
        parser.add_argument("--take-back", action="store_true", help="offer them again")

    def handle(self, *args: Any, **options: Any) -> None:
        """All of them or none."""
        found = {row.slug: row for row in Contestant.objects.filter(slug__in=options["slugs"])}
        for slug in options["slugs"]:
            if slug not in found:
                known = list(Contestant.objects.values_list("slug", flat=True))
                raise CommandError(str(UnknownName("contestant", slug, known)))
        change, word = (
            (take_back, "offered again") if options["take_back"] else (retire, "retired")
        )
        for slug in dict.fromkeys(options["slugs"]):
            change(found[slug])
            self.stdout.write(f"{slug}: {word}.")
