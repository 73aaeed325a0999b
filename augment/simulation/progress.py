"""The score's metrics of progress and of the rules: direction, speed limit, red lights."""

from __future__ import annotations

import numpy as np

from augment.simulation.drive import Drive
from augment.simulation.ego_lane import NO_WAY
from augment.simulation.expert import Expert
from augment.simulation.metric import Metric
from augment.simulation.states import SPEED, STEP_S, IntArray

LITTLE_M = 2.0
ENOUGH_PROGRESS = 0.2
DIRECTION_STEPS = 11
WRONG_WAY_FREE_M, WRONG_WAY_HALF_M = 2.0, 6.0
MAX_OVERSPEED_MPS = 2.23


def progress_ratio(drive: Drive, expert: Expert) -> float:
    """The ego's advance as a share of the expert's, 0 to 1; both count as 2 m at least."""
    stations, _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    advance = float(stations[1] - stations[0])
    if advance < -LITTLE_M:
        return 0.0
    return min(1.0, max(advance, LITTLE_M) / max(expert.progress_m, LITTLE_M))


def progress(drive: Drive, expert: Expert) -> Metric:
    """How far the ego came, measured by the expert."""
    stations, _ = drive.road.centreline.beside(drive.boxes[:, :2])
    return Metric(
        name="ego_progress_along_expert_route",
        value=progress_ratio(drive, expert),
        weight=5.0,
        parts={"ego_m": float(stations[-1] - stations[0]), "expert_m": expert.progress_m},
        series={"advance_m": stations - stations[0]},
    )


def making_progress(drive: Drive, expert: Expert) -> Metric:
    """1 from a ratio of 0.2 on."""
    ratio = progress_ratio(drive, expert)
    return Metric(
        name="ego_is_making_progress",
        value=float(ratio >= ENOUGH_PROGRESS),
        parts={"ratio": ratio},
    )


def direction(drive: Drive, ways: IntArray, *, weight: float | None = None) -> Metric:
    """By the longest way against the lane's direction in 1.1 s: < 2 m is 1, < 6 m 0.5, else 0.

    The first two moments on another way count nothing.
    """
    centres = drive.boxes[:, :2]
    steps = np.zeros(len(centres))
    fresh = 2
    for moment in range(1, len(centres)):
        fresh = fresh + 1 if ways[moment] == ways[moment - 1] else 0
        if ways[moment] == NO_WAY or fresh < 2:
            continue
        path = drive.road.way_path(int(ways[moment]))
        (before, here), _ = path.beside(centres[moment - 1 : moment + 1])
        steps[moment] = here - before
    window = np.convolve(steps, np.ones(DIRECTION_STEPS))[: len(steps)]
    against = max(0.0, -float(window.min()))
    half = 0.5 if against < WRONG_WAY_HALF_M else 0.0
    value = 1.0 if against < WRONG_WAY_FREE_M else half
    return Metric(
        name="driving_direction_compliance",
        value=value,
        weight=weight,
        parts={"against_m": against},
        series={"advance_in_1_1_s_m": window},
    )


def speed_limit(drive: Drive, ways: IntArray) -> Metric:
    """1 less the overspeed, integrated and held against 2.23 m/s throughout."""
    limits = np.append(drive.road.limits_mps, np.nan)[ways]
    over = np.nan_to_num(np.maximum(drive.states[:, SPEED] - limits, 0.0))
    value = None
    duration_s = max(drive.duration_s, STEP_S)
    if not np.isnan(limits).all():
        value = max(0.0, 1.0 - float(over.sum()) * STEP_S / (MAX_OVERSPEED_MPS * duration_s))
    return Metric(
        name="speed_limit_compliance",
        value=value,
        weight=4.0,
        parts={"most_over_mps": float(over.max())},
        series={"over_mps": over},
    )


def red_lights(drive: Drive) -> Metric:
    """0 if the ego's front ever crosses a red stop line. Not nuPlan's; off unless asked for."""
    stations, _ = drive.road.centreline.beside(drive.boxes[:, :2])
    front = stations + drive.body.length_m / 2.0
    red = drive.road.red_stations_m
    crossed = ((front[:-1, None] < red) & (front[1:, None] >= red)).any(axis=1)
    return Metric(
        name="red_light_compliance",
        value=float(not crossed.any()),
        parts={"crossed": float(crossed.sum())},
        series={"crossed": np.append(0.0, crossed.astype(np.float64))},
    )
