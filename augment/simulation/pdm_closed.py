"""PDM-Closed: many IDM rollouts on parallel paths, simulated, judged, and the best one driven."""

from __future__ import annotations

import math

import numpy as np

from augment.simulation.braking import brake, must_brake
from augment.simulation.forecast import foresee, nearest
from augment.simulation.leaders import Corridor, ParallelPaths
from augment.simulation.objects import Objects
from augment.simulation.overlap import meet
from augment.simulation.planning import Plan, Proposals, Situation
from augment.simulation.proposal_scores import ProposalScores, score_proposals
from augment.simulation.proposals import (
    FALLBACK_LIMIT_MPS,
    HORIZON_STEPS,
    PAPER_OFFSETS_M,
    SPEED_SHARES,
    WHOLE_STEPS,
    Quirks,
    Rollout,
    roll_out,
)
from augment.simulation.road import Road
from augment.simulation.states import SPEED, STEP_S, EgoBody, FloatArray, X, Y
from augment.simulation.tracker import track


class PdmClosed:
    """The planner of the paper's benchmark.

    Args:
        offsets_m: Lateral offsets of the paths (P,), to the left; the paper's by default.
        speed_shares: Target speeds (V,) as parts of the speed limit.
        quirks: Which oddities of the released code to copy.
    """

    def __init__(
        self,
        offsets_m: tuple[float, ...] = PAPER_OFFSETS_M,
        speed_shares: tuple[float, ...] = SPEED_SHARES,
        quirks: Quirks | None = None,
    ) -> None:
        self._offsets = np.array(offsets_m, dtype=np.float64)
        self._shares = np.array(speed_shares, dtype=np.float64)
        self._quirks = quirks or Quirks()
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
        rolled = roll_out(starts, speed, targets, corridor, self._ends, body, self._quirks)
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
            lengths_m=np.concatenate([corridor.lengths_m, np.zeros(len(red))]),
        )

    def _poses(self, rolled: Rollout) -> FloatArray:
        """The proposals' poses (P * V, T, 3)."""
        poses = self._paths.poses(rolled.stations_m)
        return poses.reshape(-1, HORIZON_STEPS + 1, 3)

    def _continued(
        self, path: int, policy: int, rolled: Rollout, targets: FloatArray, corridor: Corridor
    ) -> FloatArray:
        """The winner's own rollout, carried on from 4 s to 8 s: arc lengths (T,) on its path."""
        one = Corridor(
            near_m=corridor.near_m[:, path : path + 1],
            middle_m=corridor.middle_m[:, path : path + 1],
            speeds_mps=corridor.speeds_mps,
            lengths_m=corridor.lengths_m,
        )
        begun = rolled.stations_m[path, policy]
        rest = roll_out(
            begun[-1:],
            float(rolled.speeds_mps[path, policy]),
            targets[policy : policy + 1],
            one,
            self._ends[path : path + 1],
            self._body,
            self._quirks,
            first=HORIZON_STEPS,
            last=WHOLE_STEPS,
        )
        return np.concatenate([begun, rest.stations_m[0, 0, 1:]])
