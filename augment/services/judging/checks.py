"""What all checks measure about a stored augmentation, also against its scenario's intent.

The reference and anybody's labels stay out of it.
"""

from __future__ import annotations

from augment.checks import Finding, Ground
from augment.checks.registry import check_against_intent
from augment.models import Augmentation
from augment.scene.codec import modification_from_document
from augment.services.scenarios.scenes import intent_of, scene_of


def findings_of(row: Augmentation) -> tuple[Finding, ...]:
    """The findings about a row that has a modification, its scenario and scene loaded.

    Raises:
        InvalidDocument: The stored scene, intent or modification can't be read.
        InvalidModification: They do not fit together.
    """
    ground = Ground.of(scene_of(row.scenario))
    return check_against_intent(
        ground, modification_from_document(row.modification), intent_of(row.scenario)
    )
