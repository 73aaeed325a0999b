"""Planners by name, and anybody's own by the dotted path of its class."""

import importlib
import math
from collections.abc import Callable, Collection
from functools import partial

import numpy as np

from augment.errors import CannotDrive, UnknownName
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PAPER_OFFSETS_M, PdmClosed
from augment.simulation.planning import (
    FALLBACK_LIMIT_MPS,
    Idm,
    ParallelPaths,
    Plan,
    Planner,
    Situation,
    foresee,
    nearest,
)
from augment.simulation.road import Road
from augment.simulation.states import SPEED, STEP_S, EgoBody, FloatArray

PLANNER_IDM = Idm(1.0, 3.0, 4.0)
"""nuPlan's IDM planner."""
TARGET_MPS = 10.0
RADIUS_M = 40.0
HORIZON_S = 8.0


class IdmPlanner:
    """nuPlan's IDM planner: along the centreline behind whoever is ahead, and nothing else.

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
        """Follow the nearest object on the path, which goes on at its speed."""
        ego, body, line = situation.ego, self._body, self._road.centreline
        start_m = line.station_of(ego)
        seen = nearest(situation.objects, body.boxes(ego)[:2], RADIUS_M)
        corridor = self._paths.corridor(foresee(seen, 0.0), start_m, RADIUS_M, body)
        near, middle = corridor.near_m[0, 0], corridor.middle_m[0, 0]
        red = self._road.red_stations_m
        rear, speed = float(min([*red[red >= start_m + body.front_m], line.length_m])), 0.0
        ahead = np.where(middle > start_m + body.centre_m, near, np.inf)
        if len(ahead) and ahead.min() < rear:
            rear, speed = float(ahead.min()), float(corridor.speeds_mps[0, ahead.argmin()])
        return Plan(poses=line.poses(self._stations(start_m, float(ego[SPEED]), rear, speed)))

    def _stations(self, station: float, speed: float, rear_m: float, leader: float) -> FloatArray:
        """The arc lengths (T,) over the horizon."""
        stations = [station]
        for _ in range(round(HORIZON_S / STEP_S)):
            gap = rear_m - station - self._body.front_m
            limit = self._road.limit_at(station) if self._target is None else self._target
            wish = FALLBACK_LIMIT_MPS if math.isnan(limit) else limit
            pull = PLANNER_IDM.clipped(*(np.array(part) for part in (speed, wish, gap, leader)))
            station += speed * STEP_S
            speed = max(0.0, speed + float(pull) * STEP_S)
            rear_m += leader * STEP_S
            stations.append(station)
        return np.array(stations)


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
    module, _, attribute = name.rpartition(".")
    try:
        planner = getattr(importlib.import_module(module), attribute)()
    except (ImportError, AttributeError, TypeError, ValueError) as error:
        raise CannotDrive(
            f"The planner {name} can't be made: {error}. It is the dotted path of a "
            "class without arguments."
        ) from error
    if not isinstance(planner, Planner):
        raise CannotDrive(
            f"{name} is no planner: it needs the methods start(road, body) and plan(situation)."
        )
    return planner
