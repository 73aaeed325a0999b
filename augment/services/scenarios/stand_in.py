"""What the stand-in language model may look up: intents by the text of their instruction."""

from __future__ import annotations

from django.db import connection

from augment.fake_llm.sight import same_text
from augment.models import Scenario
from augment.scene.codec import intent_from_document
from augment.scene.intent import Intent


class StoredIntents:
    """The intents of all scenarios, by the texts of their instructions.

    Asked from the threads of a server: each leaves no connection behind. What was found once is
    remembered; what was not is looked for again, because scenarios and intents come later.
    """

    def __init__(self) -> None:
        self._found: dict[str, Intent] = {}

    def __call__(self, instruction: str) -> Intent | None:
        """The intent of the first scenario with that instruction, None where none has one."""
        text = same_text(instruction)
        if text not in self._found:
            try:
                self._look_again()
            finally:
                connection.close()
        return self._found.get(text)

    def _look_again(self) -> None:
        rows = Scenario.objects.exclude(intent=None).order_by("-pk")
        for instruction, document in rows.values_list("instruction", "intent"):
            self._found[same_text(instruction)] = intent_from_document(document)
