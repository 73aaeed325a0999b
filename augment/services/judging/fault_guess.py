"""The automatic first guess of a stored augmentation's faults."""

from __future__ import annotations

from augment.checks.finding import FaultClass
from augment.errors import InvalidDocument, InvalidModification
from augment.metrics.fault_guess import first_guess
from augment.models import Augmentation
from augment.services.judging.findings import findings_of

__all__ = ["FaultClass", "guess_faults"]


def guess_faults(row: Augmentation) -> frozenset[FaultClass] | None:
    """What the checks make of a row; None where it can't be read or has no modification."""
    if row.modification is None:
        return None
    try:
        return first_guess(findings_of(row))
    except (InvalidDocument, InvalidModification):
        return None
