"""Have a language model read what a scenario's instruction asks for, and accept what it read."""

from pathlib import Path
from typing import Any

from django.core.management.base import CommandError

from augment.formats.documents import read_json
from augment.models import IntentReading
from augment.scene.codec import intent_from_document
from augment.scene.intent_statements import list_statements
from augment.services.benchmarks import Split, refuse_handed_out
from augment.services.running.intent_readings import read_intent
from augment.services.scenarios.editing import accept_reading, enter_intent
from augment.services.terminal import TerminalCommand


class Command(TerminalCommand):
    """read_intent SCENARIO (--endpoint E --model M | --accept | --enter FILE)."""

    help = (
        "Ask a language model what a scenario's instruction asks for. What it read is printed as "
        "short statements and counts for nothing until somebody runs this again with --accept, "
        "or with --enter and a mended file."
    )

    arguments = {
        "scenario": {"help": "a slug"},
        "--endpoint": {"help": "the label of an endpoint"},
        "--model": {"help": "the model id on the endpoint"},
        "--accept": {"action": "store_true", "help": "let the last reading count from now on"},
        "--enter": {
            "type": Path,
            "metavar": "FILE",
            "help": "let the intent of a file count instead",
        },
    }

    def handle(self, *args: Any, **options: Any) -> None:
        """Do one of the three, and print the statements of what was read or counts now."""
        endpoint, model, slug = options["endpoint"], options["model"], options["scenario"]
        asks, file = bool(endpoint and model), options["enter"]
        if asks + options["accept"] + (file is not None) != 1:
            raise CommandError("Give one of: --endpoint with --model, --accept, --enter FILE.")
        if asks:
            reading = read_intent(scenario=slug, endpoint=endpoint, model=model)
            if reading.state != IntentReading.State.READ:
                raise CommandError(f"Nothing was read: {reading.reason}")
            self._say(reading.document)
            self.stdout.write(
                "It does not count yet. Hold each statement against the sentence, then accept "
                f"it:\n  manage.py read_intent {slug} --accept"
            )
            return
        refuse_handed_out(slug, [Split.PRACTICE])
        if file is None:
            row = accept_reading(scenario=slug)
        else:
            row = enter_intent(scenario=slug, document=read_json(file, what="intent"))
        self._say(row.intent)
        self.stdout.write(f"This is the intent of {slug} now ({row.intent_origin}).")

    def _say(self, document: object) -> None:
        for statement in list_statements(intent_from_document(document)):
            self.stdout.write(f"- {statement}")
