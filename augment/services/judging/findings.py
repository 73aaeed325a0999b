"""What the geometric checks say of a scene's change: findings, marked pictures, fault guesses.

The reference and anybody's labels stay out of it. Marked pictures are for analysts, never for a
vote; the name of one says what is on it, so one that no longer fits the findings is never shown.
"""

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from django.core.files.storage import default_storage

from augment.checks import Finding, FindingKind, Ground, Severity
from augment.checks.finding import FaultClass
from augment.checks.measures import LaneEdges, MeasureLine, find_measures, lane_edges_at
from augment.checks.registry import check_against_intent
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.fault_guess import first_guess
from augment.models import Augmentation, Scenario
from augment.render.bev import FaultMark, draw_annotated
from augment.scene.codec import EGO_ID, modification_from_document, modification_to_document
from augment.scene.entities import Scene
from augment.services.scenarios.editing import editable_scene, read_edit, snap
from augment.services.scenarios.pictures import camera_of, store_as
from augment.services.scenarios.scenes import intent_of, scene_of

__all__ = [
    "EGO_ID",
    "Checked",
    "FaultClass",
    "Finding",
    "FindingKind",
    "FindingLine",
    "LaneEdges",
    "MeasureLine",
    "check_augmentation",
    "check_edit",
    "draw_marked",
    "findings_of",
    "guess_faults",
    "lane_edges_of",
    "measures_of",
]

_LOOK = 2
"""Raised whenever the marked pictures look different."""

_ORDER = (Severity.WRONG, Severity.DOUBTFUL)


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingLine:
    """One finding.

    Attributes:
        severity: "wrong", "doubtful" or "fact".
        kind: What was measured, in words: "off road".
        fault: The class of fault that it speaks for, empty for a fact.
        finding: In full; its sentence calls agents by their ids in the modification.
    """

    severity: str
    kind: str
    fault: str
    finding: Finding


@dataclass(frozen=True, slots=True, kw_only=True)
class Checked:
    """All findings about a change, the worst first.

    Attributes:
        problem: Why nothing could be checked, empty where it was.
        is_against_intent: Whether the scenario has an intent that it was held against.
        picture: The name of the picture that shows the faults by their numbers, empty without.
        is_drawn: Whether that picture is there.
        modification: Of an edit, the document as it would be kept; None where it can't be.
    """

    lines: tuple[FindingLine, ...] = ()
    is_against_intent: bool = False
    picture: str = ""
    is_drawn: bool = False
    problem: str = ""
    modification: dict[str, Any] | None = None

    @property
    def faults(self) -> list[FindingLine]:
        """What is wrong or doubtful, in the order of the numbers in the picture."""
        return [line for line in self.lines if line.severity != Severity.FACT]

    @property
    def facts(self) -> list[FindingLine]:
        """Plain measurements."""
        return [line for line in self.lines if line.severity == Severity.FACT]


def findings_of(row: Augmentation) -> tuple[Finding, ...]:
    """Return the findings about a row that has a modification, its scenario and scene loaded.

    Raises:
        InvalidDocument: The stored scene, intent or modification can't be read.
        InvalidModification: They do not fit together.
    """
    modification = modification_from_document(row.modification)
    ground = Ground.of(scene_of(row.scenario))
    return check_against_intent(ground, modification, intent_of(row.scenario))


def check_augmentation(row: Augmentation) -> Checked | None:
    """Check a row whose scenario and scene are loaded; None without a modification."""
    if row.modification is None:
        return None
    try:
        findings = findings_of(row)
    except (InvalidDocument, InvalidModification) as error:
        return Checked(problem=str(error))
    name = _marked_name(row, findings)
    return Checked(
        lines=_lines(findings),
        is_against_intent=row.scenario.intent is not None,
        picture=name,
        is_drawn=bool(name) and default_storage.exists(name),
    )


def check_edit(scenario: Scenario, document: object, *, snapped: str = "") -> Checked:
    """Check a change that is being made by hand, before anything is kept.

    Args:
        scenario: Whose scene is changed.
        document: The modification.
        snapped: The id of an agent that is to be put on the nearest centreline first.
    """
    try:
        modification = read_edit(scenario, document)
        if snapped:
            modification = snap(scenario, modification, snapped)
        intent = intent_of(scenario)
        findings = check_against_intent(_ground_of(scenario), modification, intent)
    except (InvalidDocument, InvalidModification) as error:
        return Checked(problem=str(error))
    return Checked(
        modification=modification_to_document(modification),
        lines=_lines(findings),
        is_against_intent=intent is not None,
    )


def guess_faults(row: Augmentation) -> frozenset[FaultClass] | None:
    """Guess a row's faults by its findings; None without a modification that can be read."""
    if row.modification is None:
        return None
    try:
        return first_guess(findings_of(row))
    except (InvalidDocument, InvalidModification):
        return None


def draw_marked(*, augmentation_pk: int) -> str:
    """Draw a row's marked picture unless it is there; returns its name, for workers.

    Empty where there is nothing to mark.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: The modification does not fit the scene.
    """
    rows = Augmentation.objects.select_related("contestant", "scenario__base_scene")
    row = rows.get(pk=augmentation_pk)
    if row.modification is None:
        return ""
    findings = findings_of(row)
    name = _marked_name(row, findings)
    if not name or default_storage.exists(name):
        return name
    marks = [
        FaultMark(
            number=number,
            agents=fault.agents,
            is_wrong=fault.severity is Severity.WRONG,
            belongs_m=fault.belongs_m,
        )
        for number, fault in enumerate(_faults(findings), start=1)
    ]
    png = draw_annotated(
        scene_of(row.scenario),
        modification_from_document(row.modification),
        camera_of(row.scenario),
        marks,
        stamp="SIMULATED" if row.contestant.is_simulated else "",
    )
    store_as(name, png)
    return name


def measures_of(scenario: Scenario) -> tuple[MeasureLine, ...]:
    """Return the lines that help to measure a scenario's pictures, in their frame.

    No augmentation of the scenario is looked at.

    Raises:
        InvalidDocument: The stored scene or intent can't be read.
    """
    return find_measures(_ground_of(scenario), intent_of(scenario))


def lane_edges_of(scenario: Scenario, x_m: float, y_m: float) -> LaneEdges | None:
    """Return how far a point is from the edges of its lane, None off every lane.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return lane_edges_at(_ground_of(scenario), x_m, y_m)


# --- Private -----------------------------------------------------------------------------------


def _ground_of(scenario: Scenario) -> Ground:
    """Return the ground of a scenario's scene before any change."""
    return _ground(editable_scene(scenario))


@lru_cache(maxsize=4)
def _ground(scene: Scene) -> Ground:
    return Ground.of(scene)


def _faults(findings: Sequence[Finding]) -> list[Finding]:
    """Return the faults in the order of their numbers: the wrong ones, then the doubtful."""
    return [fault for severity in _ORDER for fault in findings if fault.severity is severity]


def _lines(findings: Sequence[Finding]) -> tuple[FindingLine, ...]:
    facts = [finding for finding in findings if not finding.is_fault]
    return tuple(
        FindingLine(
            severity=finding.severity.value,
            kind=finding.kind.value.replace("_", " "),
            fault=finding.fault.value if finding.is_fault else "",
            finding=finding,
        )
        for finding in (*_faults(findings), *facts)
    )


def _marked_name(row: Augmentation, findings: Sequence[Finding]) -> str:
    """Return the name of the row's marked picture, drawn or not; empty without a fault."""
    faults = _faults(findings)
    if not faults:
        return ""
    shown = {
        "look": _LOOK,
        "augmentation": str(row.code),
        "modification": row.modification,
        "reference": row.scenario.reference,
        "simulated": row.contestant.is_simulated,
        "faults": [
            [fault.severity, fault.agents, fault.belongs_m, fault.sentence()] for fault in faults
        ],
    }
    digest = hashlib.sha256(json.dumps(shown, sort_keys=True).encode()).hexdigest()
    return f"marked/{digest}.png"
