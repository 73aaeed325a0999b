"""Planner interface: observation and plan, and parts shared by the built-in planners.

Whoever fits `Planner` can be driven. A planner of your own is a class without arguments in a
module that can be imported, named by its dotted path (docs/simulation.md has an example).

Shared are the intelligent driver model and who is ahead on each of several parallel paths. Nobody
is expected to change speed or heading. Every object is laid beside the centreline once; beside a
path that runs so far to the left of it, it lies as much further to the right. P paths, F slices
of 0.2 s, A objects.
"""

import math
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from augment.simulation import shapes
from augment.simulation.path import Path
from augment.simulation.road import Road
from augment.simulation.states import SPEED, STEP_S, EgoBody, FloatArray, Kind, Objects

FALLBACK_LIMIT_MPS = 15.0
SLICE_S = 0.2
STEPS_A_SLICE = 2
RADIUS_M = 50.0
MOST: dict[Kind, int] = {Kind.VEHICLE: 50, Kind.PEDESTRIAN: 25, Kind.BICYCLE: 10, Kind.STATIC: 50}
"""How many of each kind PDM-Closed looks at, nearest first."""
# Who is further behind the ego along the centreline is not laid beside the paths.
_BEHIND_M = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Situation:
    """One moment, as a planner sees it.

    Attributes:
        step: Counted from 0, `STEP_S` apart.
        ego: The state (6,) of the rear axle.
        objects: Everybody who is there, wherever they are.
    """

    step: int
    ego: FloatArray
    objects: Objects


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Proposals:
    """Proposals of a planner, for people to look at; nothing depends on it.

    Attributes:
        states: (B, T, 3 or more): rear-axle poses over the planner's horizon.
        scores: (B,).
        chosen: The row that won.
    """

    states: FloatArray
    scores: FloatArray
    chosen: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Plan:
    """Plan for the ego.

    Attributes:
        poses: (T, 3), rear axle, every `STEP_S` from this moment on, T >= 2. The tracker reads
            a second ahead, so give it that much.
        proposals: What was considered, None if nothing is to be shown.
        braking: Whether this is an emergency brake.
    """

    poses: FloatArray
    proposals: Proposals | None = None
    braking: bool = False


@runtime_checkable
class Planner(Protocol):
    """Drives one scene; `start` comes once before the first `plan`."""

    def start(self, road: Road, body: EgoBody) -> None:
        """Get to know the map and the car; forget every drive before."""

    def plan(self, situation: Situation) -> Plan:
        """Return the plan from this moment on."""


def is_of_signal(error: BaseException) -> bool:
    """Return whether a signal ends the process: a worker exits with a code below zero then."""
    code = error.code if isinstance(error, SystemExit) else None
    return isinstance(code, int) and code < 0


@dataclass(frozen=True, slots=True)
class Idm:
    """The intelligent driver model.

    Attributes:
        max_acceleration_mps2: On a free road from rest; also the upper clip.
        max_deceleration_mps2: Comfortable braking; also the lower clip (as a negative).
        exponent: How late a driver near the wished speed eases off.
        min_gap_m: To a standing leader.
        headway_s: The time that the gap grows by with the speed.
    """

    max_acceleration_mps2: float
    max_deceleration_mps2: float
    exponent: float
    min_gap_m: float = 1.0
    headway_s: float = 1.5

    def acceleration(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """Return the law itself, m/s2, not clipped; all arrays in m and m/s and of one shape.

        `gap` is from bumper to bumper; `inf` is a free road.
        """
        # a (1 - (v / v0)^d - (s* / s)^2), and the wished gap
        # s* = s0 + max(0, v T + v (v - v_leader) / (2 sqrt(a b))).
        root = 2.0 * math.sqrt(self.max_acceleration_mps2 * self.max_deceleration_mps2)
        moving = self.headway_s * speed + speed * (speed - leader_speed) / root
        wished = self.min_gap_m + np.maximum(moving, 0.0)
        free = (speed / np.maximum(target, 1e-9)) ** self.exponent
        return self.max_acceleration_mps2 * (1.0 - free - (wished / gap) ** 2)

    def clip(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """Return the law with the gap held at the minimum gap, within the driver's limits."""
        wished = self.acceleration(speed, target, np.maximum(gap, self.min_gap_m), leader_speed)
        return wished.clip(-self.max_deceleration_mps2, self.max_acceleration_mps2)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forecast:
    """Objects and their boxes (F, A, 5) at 0, 0.2, 0.4 ... s from now."""

    objects: Objects
    boxes: FloatArray


def foresee(objects: Objects, horizon_s: float) -> Forecast:
    """Return where objects will be at constant velocity along their headings."""
    # (F,), both ends included.
    times = np.arange(round(horizon_s / SLICE_S) + 1) * SLICE_S
    return Forecast(objects=objects, boxes=objects.later(times))


def nearest(objects: Objects, place_m: FloatArray, radius_m: float = RADIUS_M) -> Objects:
    """Return those within the radius of a place (2,), of each kind the nearest `MOST`."""
    away = np.hypot(*(objects.boxes[:, :2] - place_m).T)
    is_kept = np.zeros(len(objects), dtype=np.bool_)
    for kind, most in MOST.items():
        rows = np.flatnonzero((objects.kinds == kind) & (away <= radius_m))
        is_kept[rows[np.argsort(away[rows], kind="stable")[:most]]] = True
    return objects.chosen(is_kept)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor:
    """Road that each object takes up on each path.

    Attributes:
        near_m: (F, P, A) where it begins on the path; inf where it does not meet the corridor.
        middle_m: (F, P, A) where its centre is.
        speeds_mps: (F, A) along the centreline.
    """

    near_m: FloatArray
    middle_m: FloatArray
    speeds_mps: FloatArray


class ParallelPaths:
    """The centreline and its parallels, one an offset (P,) to the left of it.

    Attributes:
        paths: One an offset.
        ends_m: (P,) their lengths.
    """

    def __init__(self, centreline: Path, offsets_m: FloatArray) -> None:
        self._centreline, self._offsets = centreline, offsets_m
        self.paths = [centreline.offset(float(left)) for left in offsets_m]
        self.ends_m = np.array([path.length_m for path in self.paths])
        # Arc lengths on the centreline that belong to those of each path's points.
        self._on_centre = [
            # Increasing, as interpolation needs it: in bends feet of parallels can step back.
            np.maximum.accumulate(centreline.beside(path.points_m)[0])
            if path is not centreline
            else centreline.stations_m
            for path in self.paths
        ]

    def stations(self, centre_m: FloatArray) -> FloatArray:
        """Return arc lengths (P, ...) on the paths, of arc lengths (...) on the centreline."""
        stations = np.empty((len(self.paths), *centre_m.shape))
        for row, on_centre in enumerate(self._on_centre):
            # Beyond the ends the paths go on straight, a metre a metre.
            inside = np.clip(centre_m, on_centre[0], on_centre[-1])
            on_path = np.interp(inside, on_centre, self.paths[row].stations_m)
            stations[row] = on_path + (centre_m - inside)
        return stations

    def poses(self, stations_m: FloatArray) -> FloatArray:
        """Return poses (P, ..., 3) of arc lengths (P, ...), each row on its own path."""
        return np.stack(
            [path.poses(row) for path, row in zip(self.paths, stations_m, strict=True)]
        )

    def corridor(
        self, forecast: Forecast, ego_m: float, reach_m: float, body: EgoBody
    ) -> Corridor:
        """Return who meets half the ego's width either side of each path, up to the reach."""
        boxes = forecast.boxes
        # (F, A, 2): along the centreline, left of it.
        middle = self._beside(boxes[..., :2])
        # Half the diagonal of each, (A,): whoever cannot come near in any slice is left out.
        size = np.hypot(boxes[0, :, 3], boxes[0, :, 4]) / 2.0
        widest = float(np.abs(self._offsets).max()) + body.width_m / 2.0
        near = np.abs(middle[..., 1]) < widest + size
        near &= (middle[..., 0] > ego_m - _BEHIND_M) & (middle[..., 0] < ego_m + reach_m + size)
        columns = np.flatnonzero(near.any(axis=0))
        boxes, middle = boxes[:, columns], middle[:, columns]
        # (F, A', 4, 2): A' of A are left.
        edges = self._beside(shapes.corners(boxes))
        low, high = edges[..., 1].min(axis=-1), edges[..., 1].max(axis=-1)
        # (F, P, A'): (F, 1, A') against offsets (P, 1).
        meets = low[:, None] <= self._offsets[:, None] + body.width_m / 2.0
        meets &= high[:, None] >= self._offsets[:, None] - body.width_m / 2.0
        # The rear edge on each path: stations (P, F, A') become (F, P, A').
        begin = np.moveaxis(self.stations(edges[..., 0].min(axis=-1)), 0, 1)
        heading = self._centreline.poses(middle[..., 0])[..., 2]
        return Corridor(
            near_m=np.where(meets, begin, np.inf),
            middle_m=np.moveaxis(self.stations(middle[..., 0]), 0, 1),
            speeds_mps=forecast.objects.speeds_mps[columns] * np.cos(boxes[..., 2] - heading),
        )

    def _beside(self, points_m: FloatArray) -> FloatArray:
        """Arc length and distance to the left (..., 2) of points (..., 2)."""
        beside = np.stack(self._centreline.beside(points_m.reshape(-1, 2)), axis=1)
        return beside.reshape(points_m.shape)


PLANNER_IDM = Idm(1.0, 3.0, 4.0)
"""nuPlan's IDM planner."""
TARGET_MPS = 10.0
# Who is further from the ego's centre does not count.
_IDM_RADIUS_M = 40.0
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
        seen = nearest(situation.objects, body.boxes(ego)[:2], _IDM_RADIUS_M)
        corridor = self._paths.corridor(foresee(seen, 0.0), start_m, _IDM_RADIUS_M, body)
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
            pull = PLANNER_IDM.clip(*(np.array(part) for part in (speed, wish, gap, leader)))
            station += speed * STEP_S
            speed = max(0.0, speed + float(pull) * STEP_S)
            rear_m += leader * STEP_S
            stations.append(station)
        return np.array(stations)
