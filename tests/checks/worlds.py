"""Findings of the checks on small worlds."""

from collections.abc import Iterable

from augment.checks import Finding, FindingKind, Ground, Severity, findings_on
from augment.checks.registry import check_against_intent
from augment.scene.entities import Modification, Scene, TrafficAgent
from augment.scene.intent import Intent


def findings(scene: Scene, change: Modification) -> tuple[Finding, ...]:
    return findings_on(Ground.of(scene), change)


def found_in(scene: Scene, *added: TrafficAgent) -> tuple[Finding, ...]:
    return findings(scene, Modification(added=added))


def of_kind(found: Iterable[Finding], kind: FindingKind) -> list[Finding]:
    return [finding for finding in found if finding.kind is kind]


def severities(found: Iterable[Finding]) -> set[tuple[FindingKind, Severity]]:
    """What speaks against a modification: the kinds that are more than facts."""
    return {(one.kind, one.severity) for one in found if one.severity is not Severity.FACT}


def faults_against(base: Scene, change: Modification, intent: Intent | None) -> list[Finding]:
    """What speaks against a modification, held against what was asked for."""
    found = check_against_intent(Ground.of(base), change, intent)
    return [one for one in found if one.is_fault]
