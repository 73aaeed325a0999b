"""Small worlds for the checks: the catalogue's references, and scenes moved as one body."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

from augment.checks import Finding, FindingKind, Ground, Severity, findings_on
from augment.scene.codec import modification_from_document, scene_from_document
from augment.scene.entities import Modification, Scene, TrafficAgent, without_traffic

FIXTURES = Path(__file__).parents[2] / "fixtures"


class Reference(NamedTuple):
    """A scenario of the catalogue: its scene as experts see it, and what belongs into it."""

    slug: str
    scene: Scene
    modification: Modification


def references() -> list[Reference]:
    found = []
    for file in sorted((FIXTURES / "scenarios").glob("*.json")):
        document = json.loads(file.read_text())
        text = (FIXTURES / "scenes" / f"{document['scene']}.json").read_text()
        scene = scene_from_document(json.loads(text))
        shown = scene if document["keep_traffic"] else without_traffic(scene)
        reference = modification_from_document(document["reference"])
        found.append(Reference(document["slug"], shown, reference))
    return found


def findings(scene: Scene, change: Modification) -> tuple[Finding, ...]:
    return findings_on(Ground.of(scene), change)


def found_in(scene: Scene, *added: TrafficAgent) -> tuple[Finding, ...]:
    return findings(scene, Modification(added=added))


def of_kind(found: Iterable[Finding], kind: FindingKind) -> list[Finding]:
    return [finding for finding in found if finding.kind is kind]


def severities(found: Iterable[Finding]) -> set[tuple[FindingKind, Severity]]:
    """What speaks against a modification: the kinds that are more than facts."""
    return {(one.kind, one.severity) for one in found if one.severity is not Severity.FACT}
