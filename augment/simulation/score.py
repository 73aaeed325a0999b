"""The driving score, and how close a drive came to going wrong.

The score is nuPlan's closed-loop score, or interPlan's by scenario type. Sources: nuPlan's metric
configuration and interPlan's aggregator, by the facts in docs/simulation.md, which also says what
differs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
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
from augment.simulation.states import (
    HEADING,
    SPEED,
    STEP_S,
    FloatArray,
    Objects,
    corners,
    meet,
    radii,
)

CROSSING_RAD = math.radians(20.0)
"""Paths that meet at a flatter angle follow each other; they have no encroachment."""
_CLOSEST_M = 0.1


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Criticality:
    """Measures of the safety literature; None where nothing of the kind happened.

    Attributes:
        least_ttc_s: The shortest time, below 3 s, to a collision if both go on as they do.
        least_pet_s: The shortest time between one leaving a place and the other entering it,
            where their ways cross; 0 if they met.
        most_deceleration_mps2: The hardest constant braking that was needed to match the speed
            of somebody straight ahead.
        least_distance_m: Between the bodies; 0 if they met.
    """

    least_ttc_s: float | None
    least_pet_s: float | None
    most_deceleration_mps2: float | None
    least_distance_m: float | None


def criticality(drive: Drive, met: tuple[Collision, ...]) -> Criticality:
    """Measure one drive."""
    ttc_s = float(ttc_series(drive, met, only_relevant=False).min())
    busy = [moment for moment, objects in enumerate(drive.objects) if len(objects)]
    needed = [_deceleration(drive, moment) for moment in busy]
    closest = [_distance(drive.boxes[moment], drive.objects[moment]) for moment in busy]
    pet_s = min((_encroachment(drive, name) for name in _names(drive)), default=math.inf)
    return Criticality(
        least_ttc_s=None if math.isinf(ttc_s) else ttc_s,
        least_pet_s=None if math.isinf(pet_s) else pet_s,
        most_deceleration_mps2=max(needed, default=0.0) or None,
        least_distance_m=min(closest, default=None),
    )


# Private


def _deceleration(drive: Drive, moment: int) -> float:
    """(closing speed)^2 / (2 gap) to whoever is in the strip straight ahead, the largest."""
    objects, state = drive.objects[moment], drive.states[moment]
    cos, sin = math.cos(state[HEADING]), math.sin(state[HEADING])
    rim = corners(objects.boxes) - drive.boxes[moment, :2]
    along = rim[..., 0] * cos + rim[..., 1] * sin
    across = rim[..., 1] * cos - rim[..., 0] * sin
    half = drive.body.width_m / 2.0
    gap = along.min(axis=1) - drive.body.length_m / 2.0
    ahead = (gap > 0.0) & (across.min(axis=1) < half) & (across.max(axis=1) > -half)
    away = objects.speeds_mps * np.cos(objects.boxes[:, 2] - state[HEADING])
    closing = np.maximum(state[SPEED] - away, 0.0)
    needed = np.where(ahead, closing**2 / (2.0 * np.maximum(gap, _CLOSEST_M)), 0.0)
    return float(needed.max())


def _distance(box: FloatArray, objects: Objects) -> float:
    """From the ego's body to the nearest other."""
    bodies = shapely.polygons(corners(objects.boxes))
    return float(shapely.distance(bodies, shapely.Polygon(corners(box))).min())


def _names(drive: Drive) -> list[str]:
    return list(dict.fromkeys(name for objects in drive.objects for name in objects.ids))


def _encroachment(drive: Drive, name: str) -> float:
    """The least |time of the ego - time of an object| at one place, over crossing ways."""
    moments = np.array([t for t, objects in enumerate(drive.objects) if name in objects.ids])
    rows = [drive.objects[moment] for moment in moments]
    theirs = np.array([objects.boxes[objects.ids.index(name)] for objects in rows])
    if np.ptp(theirs[:, :2], axis=0).max() < 1.0:
        return math.inf
    reach = radii(drive.boxes[0]) + radii(theirs[0])
    apart = ((drive.boxes[:, None, :2] - theirs[None, :, :2]) ** 2).sum(axis=-1)
    turns = np.abs(np.sin(drive.boxes[:, None, 2] - theirs[None, :, 2]))
    ego, other = np.nonzero((apart <= reach**2) & (turns >= math.sin(CROSSING_RAD)))
    hit = meet(drive.boxes[ego], theirs[other])
    lags = np.abs(ego[hit] - moments[other[hit]])
    return float(lags.min()) * STEP_S if len(lags) else math.inf
