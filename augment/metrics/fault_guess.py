"""A first guess of the faults that an expert would see, from the checks alone."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum

from augment.checks import Finding, Kind, Severity


class FaultClass(StrEnum):
    """The paper's three classes of faults; a modification may have any of them, or none."""

    POSITION = "position"
    HEADING = "heading"
    LOGIC = "logic"


CLASS_OF = {
    Kind.EGO_OFFSET: FaultClass.POSITION,
    Kind.LANE_DISTANCE: FaultClass.POSITION,
    Kind.LANE: FaultClass.POSITION,
    Kind.OFF_ROAD: FaultClass.POSITION,
    Kind.OUTSIDE_MAP: FaultClass.POSITION,
    Kind.HEADING: FaultClass.HEADING,
    Kind.DEGREES: FaultClass.HEADING,
    Kind.WALK_HEADING: FaultClass.HEADING,
    Kind.LANE_NAMED: FaultClass.LOGIC,
    Kind.WALK_CROSSING: FaultClass.LOGIC,
    Kind.OVERLAP: FaultClass.LOGIC,
    Kind.DUPLICATE: FaultClass.LOGIC,
    Kind.SIZE: FaultClass.LOGIC,
    Kind.SPEED: FaultClass.LOGIC,
}


def first_guess(findings: Iterable[Finding]) -> frozenset[FaultClass]:
    """The classes in which anything was found wrong or doubtful; plain facts say nothing."""
    return frozenset(CLASS_OF[one.kind] for one in findings if one.severity is not Severity.FACT)
