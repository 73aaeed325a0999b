"""The driving score, and how close a drive came to going wrong.

The score is nuPlan's closed-loop score, or interPlan's by scenario type. Sources: nuPlan's metric
configuration and interPlan's aggregator, by the facts in docs/simulation.md, which also says what
differs.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import shapely

from augment.scene.entities import Modification, ScenarioType
from augment.simulation.drive import Drive, Expert
from augment.simulation.metrics import (
    Collision,
    Metric,
    allows_detour,
    collisions,
    combine,
    comfort,
    direction,
    drivable_area,
    ego_ways,
    lane_changes_to_goal,
    making_progress,
    no_fault_collisions,
    passed_obstacles,
    progress,
    speed_limit,
    time_to_collision,
    ttc_series,
)
from augment.simulation.states import HEADING, corners


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
        no_fault_collisions(met),
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


def criticality(drive: Drive, met: tuple[Collision, ...]) -> dict[str, float | None]:
    """Return the smallest time to collision below 3 s, and the least distance between bodies.

    None where nothing of the kind happened.
    """
    ttc_s = float(ttc_series(drive, met, only_relevant=False).min())
    closest = [
        float(shapely.distance(bodies, shapely.Polygon(corners(box))).min())
        for box, objects in zip(drive.boxes, drive.objects, strict=True)
        if len(objects)
        for bodies in [shapely.polygons(corners(objects.boxes))]
    ]
    return {
        "least_ttc_s": None if math.isinf(ttc_s) else ttc_s,
        "least_distance_m": min(closest, default=None),
    }
