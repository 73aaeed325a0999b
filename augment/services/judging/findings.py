"""Geometric checks of a scene's change: findings and guesses of faults.

The reference and anybody's labels stay out of it.
"""

import math
from collections import defaultdict
from collections.abc import Collection, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from augment.checks import Finding as Finding
from augment.checks import FindingKind as FindingKind
from augment.checks import Ground, Severity
from augment.checks.finding import FaultClass as FaultClass
from augment.checks.purpose import check_drive
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace, InvalidDocument, InvalidModification, UnknownName
from augment.metrics.fault_guess import first_guess
from augment.models import Augmentation, Scenario, Simulation
from augment.scene import codec
from augment.scene.intent import Intent
from augment.scene.planned_motion import EGO_ID as EGO_ID
from augment.services.judging.measures import Measure, rows_by_scenario
from augment.services.scenarios import editing
from augment.services.scenarios.scenes import LoadedScenario
from augment.simulation.planners import NAMED

_WAY_STEPS = 10
_ORDER = (Severity.WRONG, Severity.DOUBTFUL, Severity.FACT)


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedRow:
    """All findings about a change, the worst first.

    Attributes:
        findings: Their sentences call agents by their ids in the modification.
        problem: Why nothing could be checked, empty where it was.
        is_against_intent: Whether the scenario has an intent that it was held against.
        modification: Of an edit, the document as it would be kept; None where it can't be.
        presets: Of an edit, what its motions are, by the ids of who moves.
        ways: Of an edit, where they are each second from t0 on.
    """

    findings: tuple[Finding, ...] = ()
    is_against_intent: bool = False
    problem: str = ""
    modification: dict[str, Any] | None = None
    presets: dict[str, dict[str, Any]] = field(default_factory=dict)
    ways: dict[str, list[list[float]]] = field(default_factory=dict)

    @property
    def faults(self) -> list[Finding]:
        """Findings that are wrong or doubtful."""
        return [finding for finding in self.findings if finding.is_fault]

    @property
    def facts(self) -> list[Finding]:
        """Plain measurements."""
        return [finding for finding in self.findings if not finding.is_fault]


def _compute(ids: Collection[int]) -> dict[int, tuple[Finding, ...]]:
    """Check all rows that can be checked; a scene is read once."""
    findings = {}
    changed = Augmentation.objects.filter(pk__in=ids).exclude(modification=None)
    for scenario, rows in rows_by_scenario(changed):
        try:
            loaded = LoadedScenario(scenario)
            ground, intent = loaded.ground, loaded.intent
        except InvalidDocument:
            continue
        for row in rows:
            with suppress(InvalidDocument, InvalidModification):
                findings[row.pk] = _check(row, ground, intent)
    return findings


def read_findings(ids: Collection[int]) -> dict[int, tuple[Finding, ...]]:
    """Return the findings about rows that can be checked, those of their drives among them."""
    findings, driven = FINDINGS.of(ids), _check_drives(ids)
    return {pk: _worst_first((*own, *driven.get(pk, ()))) for pk, own in findings.items()}


FINDINGS = Measure("findings", tuple[Finding, ...], _compute)
"""The findings about rows that can be checked, the worst first."""


def check_augmentation(row: Augmentation) -> CheckedRow | None:
    """Check a row whose scenario and scene are loaded; None without a modification."""
    if row.modification is None:
        return None
    try:
        loaded = LoadedScenario(row.scenario)
        findings = _check(row, loaded.ground, loaded.intent)
        findings = _worst_first((*findings, *_check_drives([row.pk]).get(row.pk, ())))
    except (InvalidDocument, InvalidModification) as error:
        return CheckedRow(problem=str(error))
    return CheckedRow(findings=findings, is_against_intent=row.scenario.intent is not None)


def check_edit(
    scenario: Scenario, document: object, *, snapped: str = "", preset: object = None
) -> CheckedRow:
    """Check a change that is being made by hand, before anything is kept.

    Args:
        scenario: Whose scene is changed.
        document: The modification.
        snapped: The id of an agent that is to be put on the nearest centreline first.
        preset: What somebody is made to do first, as `PresetEdit` has it.
    """
    try:
        modification = editing.read_edit(scenario, document)
        if snapped:
            modification = editing.snap(scenario, modification, snapped)
        if preset is not None:
            modification = editing.give_preset(scenario, modification, preset)
        ground, intent = editing.editable_ground(scenario), LoadedScenario(scenario).intent
        findings = check_against_intent(ground, modification, intent)
    except (InvalidDocument, InvalidModification, CannotPlace, UnknownName) as error:
        return CheckedRow(problem=str(error))
    motion = ground.motion_after(modification, of_all=False) if modification.has_motion else None
    return CheckedRow(
        modification=codec.modification_to_document(modification),
        findings=_worst_first(findings),
        is_against_intent=intent is not None,
        presets=editing.motion_presets(scenario, modification),
        ways={
            movement.agent.id: movement.states[movement.is_present, :2][::_WAY_STEPS]
            .round(2)
            .tolist()
            for movement in (motion.others if motion else ())
            if movement.agent.motion is not None
        },
    )


def guess_faults(row: Augmentation) -> frozenset[FaultClass] | None:
    """Guess a row's faults by its findings; None without a modification that can be read."""
    findings = read_findings([row.pk]).get(row.pk)
    return None if findings is None else first_guess(findings)


# --- Private -----------------------------------------------------------------------------------


def _check(row: Augmentation, ground: Ground, intent: Intent | None) -> tuple[Finding, ...]:
    modification = codec.modification_from_document(row.modification)
    return _worst_first(check_against_intent(ground, modification, intent))


def _check_drives(ids: Collection[int]) -> dict[int, list[Finding]]:
    """Hold drives of the built-in planners, with recorded traffic, against open wishes."""
    driven = Simulation.objects.filter(augmentation__in=ids, state=Simulation.State.DONE)
    plain = driven.filter(planner__in=NAMED, offsets="paper", is_reactive=False)
    rows = plain.filter(scenario__intent__has_key="purpose").order_by("planner", "version")
    columns = rows.values_list("augmentation", "planner", "document", "scenario__intent")
    newest = {(pk, planner): rest for pk, planner, *rest in columns}
    by_row: defaultdict[int, list[Finding]] = defaultdict(list)
    for (pk, planner), (drive, intent) in newest.items():
        purpose, document = codec.intent_from_document(intent).purpose, drive or {}
        critical = document.get("criticality", {})
        if purpose is not None and "required_braking_mps2" in critical:
            by_row[pk] += check_drive(
                purpose,
                planner,
                braking_mps2=critical["required_braking_mps2"],
                ttc_s=math.inf if critical["least_ttc_s"] is None else critical["least_ttc_s"],
                crashes=bool(document["collisions"]),
            )
    return by_row


def _worst_first(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    return tuple(sorted(findings, key=lambda finding: _ORDER.index(finding.severity)))
