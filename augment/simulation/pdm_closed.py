"""PDM-Closed: the best of several rolled-out proposals, or an emergency brake."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from augment.simulation.path import Path
from augment.simulation.proposal_scores import ProposalScores, score_proposals
from augment.simulation.road import Road
from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    Kind,
    Objects,
    Plan,
    Proposals,
    Situation,
    X,
    Y,
    corners,
    meet,
)
from augment.simulation.tracker import track
from augment.simulation.traffic import PROPOSAL_IDM

SLICE_S = 0.2
STEPS_A_SLICE = 2
RADIUS_M = 50.0
MOST: dict[Kind, int] = {Kind.VEHICLE: 50, Kind.PEDESTRIAN: 25, Kind.BICYCLE: 10, Kind.STATIC: 50}
"""How many of each kind PDM-Closed looks at, nearest first."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Forecast:
    """Objects and their boxes (F, A, 5) at 0, 0.2, 0.4 ... s from now."""

    objects: Objects
    boxes: FloatArray


def foresee(objects: Objects, horizon_s: float) -> Forecast:
    """Constant velocity along each object's heading (backwards where its speed is negative)."""
    times = np.arange(round(horizon_s / SLICE_S) + 1) * SLICE_S
    boxes = np.broadcast_to(objects.boxes, (len(times), *objects.boxes.shape)).copy()
    heading = objects.boxes[:, 2]
    boxes[..., 0] += times[:, None] * (objects.speeds_mps * np.cos(heading))
    boxes[..., 1] += times[:, None] * (objects.speeds_mps * np.sin(heading))
    return Forecast(objects=objects, boxes=boxes)


def nearest(objects: Objects, place_m: FloatArray, radius_m: float = RADIUS_M) -> Objects:
    """Those within the radius of a place (2,), of each kind as many as PDM-Closed looks at."""
    away = np.hypot(*(objects.boxes[:, :2] - place_m).T)
    kept = np.zeros(len(objects), dtype=np.bool_)
    for kind, most in MOST.items():
        rows = np.flatnonzero((objects.kinds == kind) & (away <= radius_m))
        kept[rows[np.argsort(away[rows], kind="stable")[:most]]] = True
    return objects.chosen(kept)


_BEHIND_M = 10.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Corridor:
    """Which road each object takes up on each path.

    Attributes:
        near_m: (F, P, A) where it begins on the path; inf where it does not meet the corridor.
        middle_m: (F, P, A) where its centre is.
        speeds_mps: (F, A) along the centreline.
    """

    near_m: FloatArray
    middle_m: FloatArray
    speeds_mps: FloatArray


class ParallelPaths:
    """The centreline and its parallels, one an offset.

    Attributes:
        offsets_m: (P,) to the left of the centreline.
    """

    def __init__(self, centreline: Path, offsets_m: FloatArray) -> None:
        self.centreline = centreline
        self.offsets_m = offsets_m
        self.paths = [centreline.offset(float(left)) for left in offsets_m]
        self._from_centre = [
            (centreline.stations_m, path.stations_m)
            if path is centreline
            else _matched(path, self)
            for path in self.paths
        ]

    def stations(self, centre_m: FloatArray) -> FloatArray:
        """Arc lengths (P, ...) on the paths, of arc lengths (...) on the centreline."""
        stations = np.empty((len(self.paths), *centre_m.shape))
        for row, (on_centre, on_path) in enumerate(self._from_centre):
            inside = np.clip(centre_m, on_centre[0], on_centre[-1])
            stations[row] = np.interp(inside, on_centre, on_path) + (centre_m - inside)
        return stations

    def poses(self, stations_m: FloatArray) -> FloatArray:
        """Poses (P, ..., 3) of arc lengths (P, ...), each row on its own path."""
        return np.stack(
            [path.poses(row) for path, row in zip(self.paths, stations_m, strict=True)]
        )

    def corridor(
        self, forecast: Forecast, ego_m: float, reach_m: float, body: EgoBody
    ) -> Corridor:
        """Who meets the corridor of half the ego's width either side, between ego and reach."""
        boxes = forecast.boxes
        slices, count = boxes.shape[:2]
        middle = self._laid(boxes[..., :2].reshape(-1, 2)).reshape(slices, count, 2)
        size = np.hypot(boxes[0, :, 3], boxes[0, :, 4]) / 2.0
        widest = float(np.abs(self.offsets_m).max()) + body.width_m / 2.0
        near = np.abs(middle[..., 1]) < widest + size
        near &= (middle[..., 0] > ego_m - _BEHIND_M) & (middle[..., 0] < ego_m + reach_m + size)
        kept = np.flatnonzero(near.any(axis=0))
        boxes, middle = boxes[:, kept], middle[:, kept]
        edges = self._laid(corners(boxes).reshape(-1, 2)).reshape(slices, len(kept), 4, 2)
        low, high = edges[..., 1].min(axis=-1), edges[..., 1].max(axis=-1)
        first = edges[..., 0].min(axis=-1)
        left = self.offsets_m[:, None] + body.width_m / 2.0
        right = self.offsets_m[:, None] - body.width_m / 2.0
        meets = (low[:, None] <= left) & (high[:, None] >= right)
        begin = np.moveaxis(self.stations(first), 0, 1)
        heading = self.centreline.poses(middle[..., 0])[..., 2]
        speeds = forecast.objects.speeds_mps[kept]
        return Corridor(
            near_m=np.where(meets, begin, np.inf),
            middle_m=np.moveaxis(self.stations(middle[..., 0]), 0, 1),
            speeds_mps=speeds * np.cos(boxes[..., 2] - heading),
        )

    def _laid(self, points_m: FloatArray) -> FloatArray:
        """Arc length and distance to the left (N, 2) of points (N, 2)."""
        return np.stack(self.centreline.beside(points_m), axis=1)


def _matched(path: Path, family: ParallelPaths) -> tuple[FloatArray, FloatArray]:
    """Arc lengths on the centreline and on a parallel that belong together."""
    on_centre, _ = family.centreline.beside(path.points_m)
    rising = np.maximum.accumulate(on_centre)
    return rising, path.stations_m


ORIGINAL_OFFSETS_M = (0.0, -1.0, 1.0)
"""The centreline first: of equal scores, all zero among them, the lowest number wins."""
PAPER_OFFSETS_M = (0.0, -1.0, 1.0, -2.0, 2.0, -3.0, 3.0, -4.0, 4.0)
"""The paper says up to 4 m; steps of 1 m and their order are our reading."""
SPEED_SHARES = (0.2, 0.4, 0.6, 0.8, 1.0)
HORIZON_STEPS = 40
WHOLE_STEPS = 80
FALLBACK_LIMIT_MPS = 15.0


@dataclass(slots=True, eq=False)
class Rollout:
    """Arc lengths and speeds of proposals, on their paths.

    Attributes:
        stations_m: (P, V, T) of the rear axle.
        speeds_mps: (P, V) at the end.
    """

    stations_m: FloatArray
    speeds_mps: FloatArray


def roll_out(
    start_m: FloatArray,
    speed_mps: float,
    targets_mps: FloatArray,
    corridor: Corridor,
    ends_m: FloatArray,
    body: EgoBody,
    *,
    first: int = 0,
    last: int = HORIZON_STEPS,
) -> Rollout:
    """Every policy on every path, from one step of the horizon to another.

    Args:
        start_m: (P,) where the rear axle is on each path.
        speed_mps: At the start.
        targets_mps: (V,) wished speeds.
        corridor: Who is on the paths.
        ends_m: (P,) where the paths end; something stands there.
        body: The ego.
        first: The step that the start belongs to.
        last: Where to end.
    """
    shape = (len(start_m), len(targets_mps))
    station = np.repeat(start_m[:, None], shape[1], axis=1)
    speed = np.full(shape, max(speed_mps, 0.0))
    targets = np.broadcast_to(targets_mps, shape)
    reach = float(targets_mps.max()) * WHOLE_STEPS * STEP_S
    stations = np.empty((last - first + 1, *shape))
    stations[0] = station
    near, leader = np.zeros(shape), np.zeros(shape)
    for step in range(first, last):
        if step % STEPS_A_SLICE == 0:
            near, leader = _leaders(station, corridor, step // STEPS_A_SLICE, ends_m, reach, body)
        gap = near - station - body.front_m
        pull = PROPOSAL_IDM.clipped(speed, targets, gap, leader)
        station = station + speed * STEP_S
        speed = np.maximum(speed + pull * STEP_S, 0.0)
        stations[step + 1 - first] = station
    return Rollout(stations_m=np.moveaxis(stations, 0, -1), speeds_mps=speed)


def _leaders(
    station: FloatArray,
    corridor: Corridor,
    moment: int,
    ends_m: FloatArray,
    reach: float,
    body: EgoBody,
) -> tuple[FloatArray, FloatArray]:
    """Where the leader's rear is (P, V), and its speed; nearest first, of equal ones the first."""
    # As released: ahead is whose centre lies beyond the rear axle, even beside the ego itself.
    end = np.broadcast_to((ends_m - body.length_m / 2.0)[:, None], station.shape)
    moment = min(moment, len(corridor.near_m) - 1)
    near = corridor.near_m[moment][:, None, :]
    if near.shape[-1] == 0:
        return end, np.zeros(station.shape)
    middle = corridor.middle_m[moment][:, None, :]
    front = station[..., None]
    ahead = (middle > front) & (near - front < reach)
    rear = np.where(ahead, near, np.inf)
    which = rear.argmin(axis=-1)
    nearest = np.take_along_axis(rear, which[..., None], axis=-1)[..., 0]
    speeds = corridor.speeds_mps[moment][which]
    beyond = nearest >= end
    return np.where(beyond, end, nearest), np.where(beyond, 0.0, speeds)


FAULT_WITHIN_S = 2.0
AT_MOST_MPS = 5.0
_LOW_MPS = 0.2
_HARDEST, _SOFTEST = -4.05, 2.40


def must_brake(fault_s: float, speed_mps: float) -> bool:
    """Whether even the best proposal hits somebody soon, at a speed that braking can end."""
    return fault_s <= FAULT_WITHIN_S and speed_mps <= AT_MOST_MPS


def brake(ego: FloatArray, body: EgoBody) -> FloatArray:
    """Poses (T, 3) straight ahead from the ego's centre, at one commanded speed.

    The commanded speed may be negative; the tracker turns that into hard braking.
    """
    speed = float(ego[SPEED])
    if speed > _LOW_MPS:
        pull = min(max(-10.0 * speed, _HARDEST), _SOFTEST)
        commanded = 1.1 * (speed + pull)
    else:
        pull = min(max(-4.0 * speed - float(ego[ACCELERATION]), _HARDEST), _SOFTEST)
        commanded = speed + pull
    way = commanded * STEP_S * np.arange(WHOLE_STEPS + 1)
    heading = float(ego[HEADING])
    x_m, y_m = body.centre(ego)
    poses = np.empty((len(way), 3))
    poses[:, 0] = x_m + way * np.cos(heading)
    poses[:, 1] = y_m + way * np.sin(heading)
    poses[:, 2] = heading
    return poses


class PdmClosed:
    """The planner of the paper's benchmark.

    Args:
        offsets_m: Lateral offsets of the paths (P,), to the left; the paper's by default.
    """

    def __init__(self, offsets_m: tuple[float, ...] = PAPER_OFFSETS_M) -> None:
        self._offsets = np.array(offsets_m, dtype=np.float64)
        self._shares = np.array(SPEED_SHARES, dtype=np.float64)
        self._touched: set[str] = set()

    def start(self, road: Road, body: EgoBody) -> None:
        """Lay the paths beside the centreline."""
        self._road, self._body = road, body
        self._paths = ParallelPaths(road.centreline, self._offsets)
        self._ends = np.array([path.length_m for path in self._paths.paths])
        self._touched = set()

    def plan(self, situation: Situation) -> Plan:
        """One step: roll out, simulate, judge, and continue the best, or brake."""
        ego, body = situation.ego, self._body
        forecast = foresee(self._seen(situation), WHOLE_STEPS * STEP_S)
        ego_m = float(self._road.centreline.beside(ego[None, [X, Y]])[0][0])
        limit = self._road.limit_at(ego_m)
        targets = self._shares * (FALLBACK_LIMIT_MPS if math.isnan(limit) else limit)
        reach_m = float(targets.max()) * WHOLE_STEPS * STEP_S
        corridor = self._with_red(
            self._paths.corridor(forecast, ego_m, reach_m, body), ego_m + body.front_m
        )
        starts = self._paths.stations(np.array([ego_m]))[:, 0]
        speed = float(ego[SPEED])
        rolled = roll_out(starts, speed, targets, corridor, self._ends, body)
        poses = self._poses(rolled)
        states = track(poses, ego, body)
        judged = score_proposals(states, forecast, self._road, body)
        # Scores that differ by rounding alone are equal, and the lowest number wins.
        best = int(judged.scores.round(9).argmax())
        shown = Proposals(states=states, scores=judged.scores, chosen=best)
        if must_brake(float(judged.fault_s[best]), speed):
            return Plan(poses=brake(ego, body), proposals=shown, braking=True)
        path, policy = divmod(best, len(targets))
        stations = self._continued(path, policy, rolled, targets, corridor)
        return Plan(poses=self._paths.paths[path].poses(stations), proposals=shown)

    def judge(self, states: FloatArray, objects: Objects) -> ProposalScores:
        """The judgement of given states (B, T, 6) among objects; for tests and comparisons."""
        forecast = foresee(objects, WHOLE_STEPS * STEP_S)
        return score_proposals(states, forecast, self._road, self._body)

    def _seen(self, situation: Situation) -> Objects:
        """The objects that count: near, and not touching the ego since some step."""
        box = self._body.boxes(situation.ego)
        near = nearest(situation.objects, box[:2])
        touching = meet(np.broadcast_to(box, near.boxes.shape), near.boxes)
        self._touched |= {name for name, hit in zip(near.ids, touching, strict=True) if hit}
        return near.chosen(np.array([name not in self._touched for name in near.ids], dtype=bool))

    def _with_red(self, corridor: Corridor, front_m: float) -> Corridor:
        """The corridor with something standing at each red light ahead."""
        red = self._road.red_stations_m
        red = red[red >= front_m]
        if not len(red):
            return corridor
        slices = len(corridor.near_m)
        stops = np.broadcast_to(self._paths.stations(red), (slices, len(self._ends), len(red)))
        return Corridor(
            near_m=np.concatenate([corridor.near_m, stops], axis=-1),
            middle_m=np.concatenate([corridor.middle_m, stops + 1.0], axis=-1),
            speeds_mps=np.hstack([corridor.speeds_mps, np.zeros((slices, len(red)))]),
        )

    def _poses(self, rolled: Rollout) -> FloatArray:
        """The proposals' poses (P * V, T, 3)."""
        poses = self._paths.poses(rolled.stations_m)
        return poses.reshape(-1, HORIZON_STEPS + 1, 3)

    def _continued(
        self, path: int, policy: int, rolled: Rollout, targets: FloatArray, corridor: Corridor
    ) -> FloatArray:
        """The winner's own rollout, carried on from 4 s to 8 s: arc lengths (T,) on its path."""
        own = Corridor(
            near_m=corridor.near_m[:, path : path + 1],
            middle_m=corridor.middle_m[:, path : path + 1],
            speeds_mps=corridor.speeds_mps,
        )
        begun = rolled.stations_m[path, policy]
        rest = roll_out(
            begun[-1:],
            float(rolled.speeds_mps[path, policy]),
            targets[policy : policy + 1],
            own,
            self._ends[path : path + 1],
            self._body,
            first=HORIZON_STEPS,
            last=WHOLE_STEPS,
        )
        return np.concatenate([begun, rest.stations_m[0, 0, 1:]])
