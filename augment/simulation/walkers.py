"""Who walks or stands: interPlan's walkers, others on foot, and everything that never moves."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from augment.scene.entities import TrafficAgent
from augment.simulation.objects import KIND_OF, Objects
from augment.simulation.path import Path
from augment.simulation.states import STEP_S, FloatArray

ACTIVE_WITHIN_M = 50.0
"""A walker appears once the ego has no further to go than this along its centreline."""
WALK_STEPS = 150
"""A walk takes this long, however far it leads: 15 s."""


def objects_of(agents: Sequence[TrafficAgent], *, speeds: bool) -> Objects:
    """Agents as they stand in the scene; with their speeds, or all reported as standing."""
    boxes = [(a.x_m, a.y_m, a.heading_rad, a.length_m, a.width_m) for a in agents]
    return Objects(
        ids=tuple(agent.id for agent in agents),
        kinds=np.array([KIND_OF[agent.type] for agent in agents], dtype=np.int64),
        boxes=np.array(boxes, dtype=np.float64).reshape(-1, 5),
        speeds_mps=np.array([agent.speed_mps if speeds else 0.0 for agent in agents]),
    )


class Drifters:
    """Who goes straight on at the speed of t0: on foot without a goal, or off every lane."""

    def __init__(self, agents: Sequence[TrafficAgent]) -> None:
        self._now = objects_of(agents, speeds=True)

    def objects(self) -> Objects:
        """Where they are."""
        return self._now

    def step(self) -> None:
        """One step on."""
        boxes = self._now.boxes.copy()
        way = self._now.speeds_mps * STEP_S
        boxes[:, 0] += way * np.cos(boxes[:, 2])
        boxes[:, 1] += way * np.sin(boxes[:, 2])
        now = self._now
        self._now = Objects(ids=now.ids, kinds=now.kinds, boxes=boxes, speeds_mps=now.speeds_mps)


class Walkers:
    """People with a walk, as interPlan has them.

    They are not there until the ego has come within `ACTIVE_WITHIN_M` of their start along the
    centreline; then they go from start to end in 15 s, however far that is, and report a speed of
    0, so that a planner takes them for standing unless `report_speed` says otherwise.
    """

    def __init__(
        self, agents: Sequence[TrafficAgent], centreline: Path, *, report_speed: bool = False
    ) -> None:
        self._agents = tuple(agents)
        starts = np.array([(a.x_m, a.y_m) for a in agents], dtype=np.float64).reshape(-1, 2)
        ends = np.array([a.walk_to_m for a in agents], dtype=np.float64).reshape(-1, 2)
        self._starts, self._walks = starts, ends - starts
        self._centreline = centreline
        self._stations = centreline.beside(starts)[0] if len(starts) else np.zeros(0)
        self._since = np.full(len(starts), -1, dtype=np.int64)
        self._step = 0
        self._report_speed = report_speed

    def objects(self) -> Objects:
        """Those who have set out."""
        out = np.flatnonzero(self._since >= 0)
        chosen = objects_of([self._agents[row] for row in out], speeds=False)
        gone = np.clip((self._step - self._since[out]) / WALK_STEPS, 0.0, 1.0)
        walks = self._walks[out]
        chosen.boxes[:, :2] = self._starts[out] + gone[:, None] * walks
        for row, (dx, dy) in enumerate(walks):
            if math.hypot(dx, dy) > 1e-6:
                chosen.boxes[row, 2] = math.atan2(dy, dx)
        if self._report_speed:
            moving = gone < 1.0
            chosen.speeds_mps[:] = moving * np.hypot(*walks.T) / (WALK_STEPS * STEP_S)
        return chosen

    def wake(self, ego_centre_m: FloatArray) -> None:
        """Let those set out whom the ego (2,) has come near to."""
        if (self._since >= 0).all():
            return
        ego_m = float(self._centreline.beside(ego_centre_m[None])[0][0])
        near = (self._stations - ego_m <= ACTIVE_WITHIN_M) & (self._since < 0)
        self._since[near] = self._step

    def step(self) -> None:
        """One step on."""
        self._step += 1
