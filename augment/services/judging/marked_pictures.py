"""Pictures with the numbered faults that the checks found: for analysts, never for a vote.

The name of such a picture says what is on it, so one that no longer fits the findings is never
shown: another one is drawn under another name.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable

from django.core.files.storage import default_storage

from augment.checks import Finding, Severity
from augment.models import Augmentation
from augment.render.annotated import FaultMark, draw_annotated
from augment.scene.codec import modification_from_document
from augment.services.judging.findings import findings_of
from augment.services.scenarios.pictures import camera_of, store_as
from augment.services.scenarios.scenes import scene_of

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
