"""What all checks measure about a stored augmentation, also against its instruction.

The reference and anybody's labels stay out of it.
"""

from __future__ import annotations

from augment.checks import Finding, Ground
from augment.checks.against_intent import judged
from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.instruction.intent import Intent
from augment.models import Augmentation, Scenario
from augment.scene.codec import modification_from_document
from augment.services.scenes import scene_of


def intent_of(scenario: Scenario) -> Intent | None:
    """What the scenario's instruction asks for, None where the grammar does not understand it."""
    try:
        return parse(scenario.instruction)
    except InstructionNotUnderstood:
        return None


def findings_of(row: Augmentation) -> tuple[Finding, ...]:
    """The findings about a row that has a modification, its scenario and scene loaded.

    Raises:
        InvalidDocument: The stored scene or modification can't be read.
        InvalidModification: They do not fit together.
    """
    ground = Ground.of(scene_of(row.scenario))
    return judged(ground, modification_from_document(row.modification), intent_of(row.scenario))
