"""PDM-Closed: the best of several rolled-out proposals, or an emergency brake."""

from __future__ import annotations

import math

import numpy as np

from augment.simulation.pdm_closed import (
    FALLBACK_LIMIT_MPS,
    HORIZON_STEPS,
    PAPER_OFFSETS_M,
    SPEED_SHARES,
    WHOLE_STEPS,
    Corridor,
    ParallelPaths,
    Rollout,
    foresee,
    nearest,
    roll_out,
)
from augment.simulation.planning import Plan, Proposals, Situation
from augment.simulation.proposal_scores import ProposalScores, score_proposals
from augment.simulation.road import Road
from augment.simulation.states import (
    ACCELERATION,
    HEADING,
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    Objects,
    X,
    Y,
    meet,
)
from augment.simulation.tracker import track

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
