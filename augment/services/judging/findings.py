"""What the geometric checks measure about a stored augmentation, as sentences."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from django.core.files.storage import default_storage

from augment.checks import Finding as Finding
from augment.checks import FindingKind as FindingKind
from augment.checks import Ground, Severity
from augment.checks.finding import FaultClass as FaultClass
from augment.checks.measures import LaneEdges as LaneEdges
from augment.checks.measures import MeasureLine as MeasureLine
from augment.checks.measures import Measures, find_measures, lane_edges_at
from augment.checks.registry import check_against_intent
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.fault_guess import first_guess
from augment.models import Augmentation, Scenario
from augment.render.bev import FaultMark, draw_annotated
from augment.scene.codec import EGO_ID as EGO_ID
from augment.scene.codec import modification_from_document
from augment.scene.entities import Scene
from augment.services.scenarios.editing import edit_to_document, editable_scene, read_edit, snap
from augment.services.scenarios.pictures import camera_of, store_as
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


_LOOK = 2
"""Raised whenever the pictures look different."""
_ORDER = (Severity.WRONG, Severity.DOUBTFUL)
_STAMP = "SIMULATED"


def order_faults(found: Iterable[Finding]) -> list[Finding]:
    """The faults in the order of their numbers, from 1: the wrong ones, then the doubtful."""
    faults = list(found)
    return [fault for severity in _ORDER for fault in faults if fault.severity is severity]


def marked_name(row: Augmentation, found: Iterable[Finding]) -> str:
    """The name of the row's picture with these findings, whether it is drawn yet or not.

    Empty where there is no fault to mark.
    """
    faults = order_faults(found)
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


def is_drawn(name: str) -> bool:
    """Whether a worker has drawn the picture of that name."""
    return bool(name) and default_storage.exists(name)


def draw_marked(*, augmentation_pk: int) -> str:
    """Draw a row's marked picture unless it is there, and say its name; for workers.

    Empty where there is nothing to mark.

    Raises:
        InvalidDocument: What is stored can't be read.
        InvalidModification: The modification does not fit the scene.
    """
    row = Augmentation.objects.select_related("contestant", "scenario__base_scene").get(
        pk=augmentation_pk
    )
    if row.modification is None:
        return ""
    findings = findings_of(row)
    name = marked_name(row, findings)
    if not name or is_drawn(name):
        return name
    scene = scene_of(row.scenario)
    png = draw_annotated(
        scene,
        modification_from_document(row.modification),
        camera_of(row.scenario),
        [
            FaultMark(
                number=number,
                agents=one.agents,
                is_wrong=one.severity is Severity.WRONG,
                belongs_m=one.belongs_m,
            )
            for number, one in enumerate(order_faults(findings), start=1)
        ],
        stamp=_STAMP if row.contestant.is_simulated else "",
    )
    store_as(name, png)
    return name


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
    """All findings of one augmentation, the worst first.

    Attributes:
        problem: Why nothing could be checked, empty where it was.
        is_against_intent: Whether the scenario has an intent that it was held against.
        picture: The name of the picture that shows the faults by their numbers, empty without.
        is_drawn: Whether that picture is there.
    """

    lines: tuple[FindingLine, ...] = ()
    is_against_intent: bool = False
    picture: str = ""
    is_drawn: bool = False
    problem: str = ""

    @property
    def faults(self) -> list[FindingLine]:
        """What is wrong or doubtful, in the order of the numbers in the picture."""
        return [line for line in self.lines if line.severity != Severity.FACT]

    @property
    def facts(self) -> list[FindingLine]:
        """Plain measurements."""
        return [line for line in self.lines if line.severity == Severity.FACT]


def check_augmentation(row: Augmentation) -> Checked | None:
    """The findings of a row whose scenario and scene are loaded; None without a modification."""
    if row.modification is None:
        return None
    try:
        findings = findings_of(row)
    except (InvalidDocument, InvalidModification) as error:
        return Checked(problem=str(error))
    name = marked_name(row, findings)
    return Checked(
        lines=list_lines(findings),
        is_against_intent=row.scenario.intent is not None,
        picture=name,
        is_drawn=is_drawn(name),
    )


def list_lines(findings: Sequence[Finding]) -> tuple[FindingLine, ...]:
    """The findings as lines: the wrong, the doubtful, then plain measurements."""
    facts = [one for one in findings if not one.is_fault]
    return tuple(_line(one) for one in (*order_faults(findings), *facts))


def _line(one: Finding) -> FindingLine:
    return FindingLine(
        severity=one.severity.value,
        kind=one.kind.value.replace("_", " "),
        fault=one.fault.value if one.is_fault else "",
        finding=one,
    )


def guess_faults(row: Augmentation) -> frozenset[FaultClass] | None:
    """What the checks make of a row; None where it can't be read or has no modification."""
    if row.modification is None:
        return None
    try:
        return first_guess(findings_of(row))
    except (InvalidDocument, InvalidModification):
        return None


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


def measures_of(scenario: Scenario, *, reach_m: float) -> Measures:
    """The lines and rings of a scenario, in the frame of its pictures.

    Args:
        scenario: With its scene; no augmentation of it is looked at.
        reach_m: The radius up to which rings are drawn.

    Raises:
        InvalidDocument: The stored scene or intent can't be read.
    """
    return find_measures(ground_of(scenario), intent_of(scenario), reach_m=reach_m)


def lane_edges_of(scenario: Scenario, x_m: float, y_m: float) -> LaneEdges | None:
    """How far a point is from the edges of its lane, None off every lane.

    Raises:
        InvalidDocument: The stored scene can't be read.
    """
    return lane_edges_at(ground_of(scenario), x_m, y_m)
