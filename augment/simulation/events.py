"""What happened in a drive that somebody should look at, moment by moment."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from augment.simulation.drive import Drive
from augment.simulation.safety import OFF_ROAD_M
from augment.simulation.score import Score
from augment.simulation.states import ACCELERATION, BoolArray, FloatArray

HARD_BRAKING_MPS2 = -3.0


class EventKind(StrEnum):
    """What it was."""

    COLLISION = "collision"
    TOUCHED = "touched"
    OFF_ROAD = "off_road"
    HARD_BRAKING = "hard_braking"
    EMERGENCY_BRAKE = "emergency_brake"
    MAP_END = "map_end"


@dataclass(frozen=True, slots=True, kw_only=True)
class DriveEvent:
    """One of them; `touched` is a collision that is not the ego's fault.

    Attributes:
        moment: When it began.
        object_id: With whom; empty where nobody else has part in it.
    """

    moment: int
    kind: EventKind
    object_id: str = ""


def events_of(drive: Drive, score: Score) -> tuple[DriveEvent, ...]:
    """All events in the order of time."""
    events = [
        DriveEvent(
            moment=collision.moment,
            kind=EventKind.COLLISION if collision.at_fault else EventKind.TOUCHED,
            object_id=collision.object_id,
        )
        for collision in score.collisions
    ]
    outside = _series(score, "drivable_area_compliance", "outside_m") >= OFF_ROAD_M
    events += [DriveEvent(moment=n, kind=EventKind.OFF_ROAD) for n in _starts(outside)]
    braking = np.array([plan.braking for plan in drive.plans], dtype=np.bool_)
    events += [DriveEvent(moment=n, kind=EventKind.EMERGENCY_BRAKE) for n in _starts(braking)]
    hard = drive.states[:, ACCELERATION] <= HARD_BRAKING_MPS2
    events += [DriveEvent(moment=n, kind=EventKind.HARD_BRAKING) for n in _starts(hard)]
    if drive.at_map_end:
        events.append(DriveEvent(moment=len(drive.states) - 1, kind=EventKind.MAP_END))
    return tuple(sorted(events, key=lambda event: (event.moment, event.kind)))


def _starts(holds: BoolArray) -> list[int]:
    """Where it begins to hold."""
    before = np.concatenate([[False], holds[:-1]])
    return [int(moment) for moment in np.flatnonzero(holds & ~before)]


def _series(score: Score, metric: str, name: str) -> FloatArray:
    return next(one.series[name] for one in score.metrics if one.name == metric)
