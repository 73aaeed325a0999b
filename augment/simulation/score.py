"""The driving score: nuPlan's closed-loop score, or interPlan's by scenario type.

Sources: nuPlan's metric configuration and interPlan's aggregator, by the facts in
docs/simulation.md, which also says what differs.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from augment.scene.entities import Modification, ScenarioType
from augment.simulation.comfort import comfort_signals, is_comfortable
from augment.simulation.drive import Drive, Expert
from augment.simulation.encounters import Collision, collisions, ego_ways
from augment.simulation.metrics import (
    Metric,
    allows_detour,
    combine,
    direction,
    drivable_area,
    lane_changes_to_goal,
    making_progress,
    no_fault_collisions,
    passed_obstacles,
    progress,
    speed_limit,
    time_to_collision,
)
from augment.simulation.states import HEADING


class ScoreKind(StrEnum):
    """Whose score."""

    NUPLAN = "nuplan"
    INTERPLAN = "interplan"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Score:
    """A drive's score.

    Attributes:
        value: 0 to 1.
        metrics: Its parts.
        collisions: Who was touched.
        expert: What progress was measured by.
    """

    kind: ScoreKind
    value: float
    metrics: tuple[Metric, ...]
    collisions: tuple[Collision, ...]
    expert: Expert


def score_drive(
    drive: Drive,
    expert: Expert,
    *,
    kind: ScoreKind = ScoreKind.NUPLAN,
    scenario_type: ScenarioType | None = None,
    modification: Modification | None = None,
) -> Score:
    """Score a drive.

    Args:
        drive: What happened.
        expert: What progress is measured by.
        kind: nuPlan's or interPlan's.
        scenario_type: Decides the roles in interPlan's score; its defaults when None.
        modification: Names the obstacles that interPlan wants passed; none when None.
    """
    met = collisions(drive)
    ways = ego_ways(drive.road, drive.boxes[:, :2], drive.states[:, HEADING])
    is_special = kind is ScoreKind.INTERPLAN and allows_detour(scenario_type)
    parts = [
        no_fault_collisions(drive, met),
        drivable_area(drive),
        making_progress(drive, expert),
        direction(drive, ways, weight=1.0 if is_special else None),
        progress(drive, expert),
        time_to_collision(drive, met),
        speed_limit(drive, ways),
        comfort(drive),
    ]
    if kind is ScoreKind.INTERPLAN:
        parts.append(lane_changes_to_goal(drive, ways))
        if scenario_type is not None:
            parts.append(passed_obstacles(drive, expert, modification))
    metrics = tuple(parts)
    return Score(kind=kind, value=combine(metrics), metrics=metrics, collisions=met, expert=expert)


def comfort(drive: Drive) -> Metric:
    """1 if every signal stays within its limits throughout."""
    if len(drive.states) < 2:
        return Metric(name="ego_is_comfortable", value=None, weight=2.0)
    signals = comfort_signals(drive.states, drive.body)
    parts = {f"most_{name}": float(np.abs(series).max()) for name, series in signals.items()}
    return Metric(
        name="ego_is_comfortable",
        value=float(is_comfortable(signals).all()),
        weight=2.0,
        parts=parts,
        series=signals,
    )
