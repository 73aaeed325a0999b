"""Write everything that led to an augmentation as one JSON document."""

import json
import uuid
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.models import Augmentation
from augment.services.running.transcript_records import transcript_of
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """transcript CODE [--out FILE]."""

    help = "Write an augmentation's transcript: every request, answer, token and cent, as JSON."

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Which augmentation, and where to."""
        parser.add_argument("code", type=uuid.UUID, help="the augmentation's, as on its page")
        parser.add_argument("--out", default="-", help="a file, or - for the terminal (default)")

    def handle(self, *args: Any, **options: Any) -> None:
        """Write the document."""
        rows = Augmentation.objects.select_related("job", "scenario", "contestant__endpoint")
        row = rows.filter(code=options["code"]).first()
        if row is None:
            raise CommandError(f"There is no augmentation {options['code']}.")
        text = json.dumps(transcript_of(row), indent=2, ensure_ascii=False) + "\n"
        if options["out"] == "-":
            self.stdout.write_data(text)
        else:
            self.write_file(Path(options["out"]), text.encode())
            self.stdout.write(f"Written to {options['out']}.")
