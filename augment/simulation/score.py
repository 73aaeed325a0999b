"""The driving score: nuPlan's closed-loop score, or interPlan's by scenario type.

Sources: nuPlan's metric configuration and interPlan's aggregator, by the facts in
docs/simulation.md, which also says what differs.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from augment.scene.entities import Modification, ScenarioType
from augment.simulation.drive import Drive, Expert
from augment.simulation.metrics import (
    Collision,
    Metric,
    allows_detour,
    collisions,
    combine,
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
from augment.simulation.proposal_scores import comfort_signals, is_comfortable
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


CROSSING_RAD = math.radians(20.0)
"""Paths that meet at a flatter angle follow each other; they have no encroachment."""
_CLOSEST_M = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Criticality:
    """None where nothing of the kind happened.

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
    """The measures of one drive."""
    ttc = float(ttc_series(drive, met, only_relevant=False).min())
    needed = [_deceleration(drive, moment) for moment in range(len(drive.states))]
    closest = [_distance(drive, moment) for moment in range(len(drive.states))]
    pet = _encroachment(drive)
    return Criticality(
        least_ttc_s=None if math.isinf(ttc) else ttc,
        least_pet_s=None if math.isinf(pet) else pet,
        most_deceleration_mps2=max(needed) or None,
        least_distance_m=None if math.isinf(min(closest)) else min(closest),
    )


# Private


def _deceleration(drive: Drive, moment: int) -> float:
    """(closing speed)^2 / (2 gap) to whoever is in the strip straight ahead, the largest."""
    objects, state = drive.objects[moment], drive.states[moment]
    if not len(objects):
        return 0.0
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


def _distance(drive: Drive, moment: int) -> float:
    """From the ego's body to the nearest other."""
    import shapely

    objects, box = drive.objects[moment], drive.boxes[moment]
    if not len(objects):
        return math.inf
    apart = np.hypot(*(objects.boxes[:, :2] - box[:2]).T)
    least = apart - radii(objects.boxes) - radii(box)
    most = apart - objects.boxes[:, 4] / 2.0 - box[4] / 2.0
    near = objects.chosen(least <= most.min())
    bodies = shapely.polygons(corners(near.boxes))
    return float(shapely.distance(bodies, shapely.Polygon(corners(box))).min())


def _encroachment(drive: Drive) -> float:
    """The least |time of the ego - time of the other| at one place, over crossing ways."""
    least_s = math.inf
    mine = drive.boxes
    for moments, boxes in _tracks(drive.objects).values():
        if np.ptp(boxes[:, :2], axis=0).max() < 1.0:
            continue
        reach = radii(mine[0]) + radii(boxes[0])
        apart = ((mine[:, None, :2] - boxes[None, :, :2]) ** 2).sum(axis=-1)
        ego, other = np.nonzero(apart <= reach**2)
        angle = np.abs(np.sin(mine[ego, 2] - boxes[other, 2]))
        crossing = angle >= math.sin(CROSSING_RAD)
        ego, other = ego[crossing], other[crossing]
        hit = meet(mine[ego], boxes[other])
        if hit.any():
            lag = np.abs(ego[hit] - moments[other[hit]]).min() * STEP_S
            least_s = min(least_s, float(lag))
    return least_s


def _tracks(rows: list[Objects]) -> dict[str, tuple[FloatArray, FloatArray]]:
    """Moments (K,) and boxes (K, 5) of each object."""
    moments: dict[str, list[int]] = {}
    boxes: dict[str, list[FloatArray]] = {}
    for moment, objects in enumerate(rows):
        for name, box in zip(objects.ids, objects.boxes, strict=True):
            moments.setdefault(name, []).append(moment)
            boxes.setdefault(name, []).append(box)
    return {name: (np.array(moments[name]), np.array(boxes[name])) for name in moments}
