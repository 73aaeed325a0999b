"""What the checks say of a change that is being made by hand, before anything is kept."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from augment.checks import Ground
from augment.checks.registry import check_against_intent
from augment.errors import InvalidDocument, InvalidModification
from augment.models import Scenario
from augment.scene.entities import Scene
from augment.services.judging.findings import FindingLine, list_lines
from augment.services.scenarios.editing import edit_to_document, editable_scene, read_edit, snap
from augment.services.scenarios.scenes import intent_of


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedEdit:
    """A change and its findings, the worst first.

    Attributes:
        modification: The document as it would be kept; None where it can't be.
        problem: Why not, empty where it can.
        is_against_intent: Whether the scenario has an intent that it was held against.
    """

    modification: dict[str, Any] | None
    lines: tuple[FindingLine, ...] = ()
    problem: str = ""
    is_against_intent: bool = False


def check_edit(scenario: Scenario, document: object, *, snapped: str = "") -> CheckedEdit:
    """A change as it would be kept, with what the checks find.

    Args:
        scenario: Whose scene is changed.
        document: The modification.
        snapped: The id of an agent that is to be put on the nearest centreline first.
    """
    try:
        modification = read_edit(scenario, document)
        if snapped:
            modification = snap(scenario, modification, snapped)
        ground = ground_of(scenario)
        intent = intent_of(scenario)
        findings = check_against_intent(ground, modification, intent)
    except (InvalidDocument, InvalidModification) as error:
        return CheckedEdit(modification=None, problem=str(error))
    return CheckedEdit(
        modification=edit_to_document(modification),
        lines=list_lines(findings),
        is_against_intent=intent is not None,
    )


def ground_of(scenario: Scenario) -> Ground:
    """The ground of a scenario's scene before any change; the last ones asked for are kept.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return _ground(editable_scene(scenario))


@lru_cache(maxsize=4)
def _ground(scene: Scene) -> Ground:
    return Ground.of(scene)
