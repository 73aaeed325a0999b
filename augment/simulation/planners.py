"""Planners by name, and anybody's own by the dotted path of its class."""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Collection
from functools import partial

import numpy as np

from augment.errors import CannotDrive, UnknownName
from augment.simulation.pdm_closed import (
    ORIGINAL_OFFSETS_M,
    PAPER_OFFSETS_M,
    ParallelPaths,
    PdmClosed,
    foresee,
    nearest,
)
from augment.simulation.road import Road
from augment.simulation.states import (
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    Plan,
    Planner,
    Situation,
    X,
    Y,
)
from augment.simulation.traffic import PLANNER_IDM

TARGET_MPS = 10.0
RADIUS_M = 40.0
HORIZON_S = 8.0
FALLBACK_LIMIT_MPS = 15.0


class IdmPlanner:
    """nuPlan's IDM planner.

    Args:
        target_mps: The wished speed, None for the speed limit of the lane (the expert that
            progress is measured by, where nobody recorded one).
    """

    def __init__(self, target_mps: float | None = TARGET_MPS) -> None:
        self._target = target_mps

    def start(self, road: Road, body: EgoBody) -> None:
        """Take the centreline as the path."""
        self._road, self._body = road, body
        self._paths = ParallelPaths(road.centreline, np.zeros(1))

    def plan(self, situation: Situation) -> Plan:
        """The IDM behind the nearest object on the path, which goes on at its speed."""
        ego, body = situation.ego, self._body
        start_m = float(self._road.centreline.beside(ego[None, [X, Y]])[0][0])
        seen = nearest(situation.objects, body.centre(ego), RADIUS_M)
        corridor = self._paths.corridor(foresee(seen, 0.0), start_m, RADIUS_M, body)
        near, middle = corridor.near_m[0, 0], corridor.middle_m[0, 0]
        rear, speed = self._stop(start_m + body.front_m), 0.0
        for row in np.argsort(near, kind="stable"):
            if middle[row] > start_m + body.centre_m and near[row] < rear:
                rear, speed = float(near[row]), float(corridor.speeds_mps[0, row])
                break
        return Plan(poses=self._driven(start_m, float(ego[SPEED]), rear, speed))

    def _stop(self, front_m: float) -> float:
        """The next red light, or the end of the path."""
        red = self._road.red_stations_m
        return float(min([*red[red >= front_m], self._road.centreline.length_m]))

    def _driven(self, start_m: float, speed: float, rear_m: float, leader: float) -> FloatArray:
        """The poses (T, 3) over the horizon."""
        station, stations = start_m, [start_m]
        for _ in range(round(HORIZON_S / STEP_S)):
            gap = rear_m - station - self._body.front_m
            pull = PLANNER_IDM.clipped(
                np.array(speed), np.array(self._wish_mps(station)), np.array(gap), np.array(leader)
            )
            station += speed * STEP_S
            speed = max(0.0, speed + float(pull) * STEP_S)
            rear_m += leader * STEP_S
            stations.append(station)
        return self._road.centreline.poses(np.array(stations))

    def _wish_mps(self, s_m: float) -> float:
        if self._target is not None:
            return self._target
        limit = self._road.limit_at(s_m)
        return FALLBACK_LIMIT_MPS if math.isnan(limit) else limit


OFFSETS_M: dict[str, tuple[float, ...]] = {
    "paper": PAPER_OFFSETS_M,
    "original": ORIGINAL_OFFSETS_M,
}
"""The lateral offsets of PDM-Closed: the paper's up to 4 m, the released code's of 1 m."""

PDM_CLOSED, IDM = "pdm-closed", "idm"
NAMED = (PDM_CLOSED, IDM)


def planner_named(name: str, *, offsets: str = "paper", allowed: Collection[str] = ()) -> Planner:
    """Return a fresh planner; the only place where a planner's module is imported.

    Args:
        name: One of `NAMED`, or one of `allowed`.
        offsets: One of `OFFSETS_M`; PDM-Closed's alone.
        allowed: Dotted paths of classes without arguments that may be imported.

    Raises:
        UnknownName: The name is not allowed, or there are no such offsets.
        CannotDrive: The path leads to nothing, or to something that is no planner.
    """
    if offsets not in OFFSETS_M:
        raise UnknownName("offsets", offsets, list(OFFSETS_M))
    known: dict[str, Callable[[], Planner]] = {
        PDM_CLOSED: partial(PdmClosed, OFFSETS_M[offsets]),
        IDM: IdmPlanner,
    }
    if name in known:
        return known[name]()
    paths = [path for path in allowed if "." in path]
    if name not in paths:
        raise UnknownName("planner", name, [*NAMED, *paths])
    return _of_path(name)


def _of_path(path: str) -> Planner:
    module, _, attribute = path.rpartition(".")
    try:
        planner = getattr(importlib.import_module(module), attribute)()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise CannotDrive(
            f"The planner {path} can't be made: {error}. It is the dotted path of a "
            "class without arguments."
        ) from error
    if not isinstance(planner, Planner):
        raise CannotDrive(
            f"{path} is no planner: it needs the methods start(road, body) and plan(situation)."
        )
    return planner
