"""Road users that move by themselves: interPlan's walkers, drifters, and drivers on lanes.

Drivers follow the lanes under them by the IDM. D drivers, K hits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from augment.scene.entities import AgentType, TrafficAgent
from augment.simulation.path import Path, dense
from augment.simulation.road import Road
from augment.simulation.states import (
    KIND_OF,
    STEP_S,
    FloatArray,
    IntArray,
    Objects,
    corners,
    meet,
    radii,
)
from augment.simulation.traffic import TRAFFIC_IDM

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
    0, so that a planner takes them for standing.
    """

    def __init__(self, agents: Sequence[TrafficAgent], centreline: Path) -> None:
        self._agents = tuple(agents)
        starts = np.array([(a.x_m, a.y_m) for a in agents], dtype=np.float64).reshape(-1, 2)
        ends = np.array([a.walk_to_m for a in agents], dtype=np.float64).reshape(-1, 2)
        self._starts, self._walks = starts, ends - starts
        self._centreline = centreline
        self._stations = centreline.beside(starts)[0] if len(starts) else np.zeros(0)
        self._since = np.full(len(starts), -1, dtype=np.int64)
        self._step = 0

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


FALLBACK_MPS = 10.0
"""The wished speed where the map has no limit: nuPlan's."""
SWEEP_S = 1.5
"""Gaps are measured from the road that a driver covers in this time, but for the first step:
nuPlan's way."""
PATH_M = 400.0
_LOOK_M = 80.0
_KEPT_WAYS = 5
"""nuPlan keeps this many ways of a driver's route; the limit of the last one is its wish."""


class LaneDrivers:
    """D drivers on their lanes.

    Args:
        agents: Moving, each on a lane.
        road: The map.
    """

    def __init__(self, agents: Sequence[TrafficAgent], road: Road) -> None:
        self._first = True
        self._agents = tuple(agents)
        lanes = [_Lane(road, agent) for agent in self._agents]
        self._lanes = lanes
        self._base = objects_of(self._agents, speeds=True)
        self.stations = np.array([lane.start_m for lane in lanes], dtype=np.float64)
        self.speeds = self._base.speeds_mps.copy()
        self._ends = np.array([lane.path.length_m for lane in lanes], dtype=np.float64)
        self._samples = _stacked([lane.path for lane in lanes])

    def objects(self) -> Objects:
        """Those who are still on the map."""
        boxes = self._base.boxes.copy()
        for row, lane in enumerate(self._lanes):
            boxes[row, :3] = lane.path.poses(self.stations[row : row + 1])[0]
        now = Objects(
            ids=self._base.ids, kinds=self._base.kinds, boxes=boxes, speeds_mps=self.speeds.copy()
        )
        return now.chosen(self.stations < self._ends)

    def step(self, everybody: Objects) -> None:
        """One step on, given all objects of this moment with the ego among them."""
        if not self._agents:
            return
        gap, leader_speed = self._leaders(everybody)
        targets = np.array(
            [lane.wish_mps(s) for lane, s in zip(self._lanes, self.stations, strict=True)]
        )
        pull = TRAFFIC_IDM.clipped(self.speeds, targets, gap, leader_speed)
        self.stations = self.stations + self.speeds * STEP_S
        self.speeds = np.maximum(self.speeds + pull * STEP_S, 0.0)
        self._first = False

    def _leaders(self, everybody: Objects) -> tuple[FloatArray, FloatArray]:
        """Gap and speed along the path of each driver's leader, (D,) each; inf without one."""
        half = self._base.boxes[:, 3] / 2.0
        front = self.stations + half + (0.0 if self._first else SWEEP_S) * self.speeds
        gap, speed = np.full(len(front), np.inf), np.zeros(len(front))
        for row, lane in enumerate(self._lanes):
            stop = lane.red_ahead(self.stations[row] + half[row])
            gap[row] = stop - front[row]
        driver, other, hit = self._hits(everybody, half)
        if len(driver):
            pose = self._samples[driver, hit]
            tangent = np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=1)
            offset = corners(everybody.boxes[other]) - pose[:, None, :2]
            near = hit + (offset * tangent[:, None, :]).sum(axis=-1).min(axis=1)
            gaps = near - front[driver]
            turn = everybody.boxes[other, 2] - pose[:, 2]
            along = everybody.speeds_mps[other] * np.cos(turn)
            for row in np.argsort(-gaps, kind="stable"):  # the nearest is written last
                if gaps[row] < gap[driver[row]]:
                    gap[driver[row]], speed[driver[row]] = gaps[row], along[row]
        return gap, speed

    def _hits(self, everybody: Objects, half: FloatArray) -> tuple[IntArray, IntArray, IntArray]:
        """Driver, object, and the first sample of the driver's path inside the object, (K,)."""
        none = np.zeros(0, dtype=np.int64)
        places = {name: number for number, name in enumerate(everybody.ids)}
        present = [row for row, name in enumerate(self._base.ids) if name in places]
        if not present:
            return none, none, none
        rows = np.array(present, dtype=np.int64)
        mine = np.array([places[self._base.ids[row]] for row in present], dtype=np.int64)
        here = everybody.boxes[mine]
        look = np.minimum(_LOOK_M, 10.0 + self.speeds[rows] * (SWEEP_S + 4.0))
        offset = everybody.boxes[None, :, :2] - here[:, None, :2]
        reach = look[:, None] + radii(everybody.boxes)[None]
        near = (offset**2).sum(axis=-1) < reach**2
        ahead = offset[..., 0] * np.cos(here[:, None, 2]) + offset[..., 1] * np.sin(
            here[:, None, 2]
        )
        near &= ahead > -radii(everybody.boxes)[None]
        near[np.arange(len(mine)), mine] = False
        driver, other = np.nonzero(near)
        if not len(driver):
            return none, none, none
        return self._first_inside(rows[driver], other, everybody, half)

    def _first_inside(
        self, driver: IntArray, other: IntArray, everybody: Objects, half: FloatArray
    ) -> tuple[IntArray, IntArray, IntArray]:
        count = int(_LOOK_M)
        start = np.floor(self.stations[driver] + half[driver]).astype(np.int64)
        at = np.minimum(start[:, None] + np.arange(count), self._samples.shape[1] - 1)
        points = self._samples[driver[:, None], at]
        box = everybody.boxes[other]
        dx, dy = points[..., 0] - box[:, None, 0], points[..., 1] - box[:, None, 1]
        cos, sin = np.cos(box[:, None, 2]), np.sin(box[:, None, 2])
        margin = self._base.boxes[driver, 4] / 2.0
        inside = np.abs(dx * cos + dy * sin) <= (box[:, 3] / 2.0 + margin)[:, None]
        inside &= np.abs(dy * cos - dx * sin) <= (box[:, 4] / 2.0 + margin)[:, None]
        hit = inside.any(axis=1)
        first = at[np.arange(len(at)), inside.argmax(axis=1)]
        return driver[hit], other[hit], first[hit]


def free_agents(agents: Sequence[TrafficAgent], taken: FloatArray) -> list[TrafficAgent]:
    """Return those who touch no box in `taken` (A, 5) and nobody before them, in their order."""
    kept: list[TrafficAgent] = []
    boxes = list(taken)
    for agent in agents:
        box = objects_of([agent], speeds=True).boxes
        if not meet(np.array(boxes), box).any():
            kept.append(agent)
            boxes.append(box[0])
    return kept


# Private


class _Lane:
    """One driver's path along the lanes from where it starts, its limits and its red lights."""

    def __init__(self, road: Road, agent: TrafficAgent) -> None:
        name = lane_under(road, agent)
        if name is None:
            raise ValueError(f"{agent.id} is on no lane")
        graph = road.graph
        place = graph.lanes[name].centerline.project(agent.x_m, agent.y_m)
        route = graph.route(name, place.s_m + PATH_M)
        lines = [graph.lanes[way].centerline.points_m for way in route]
        whole = np.vstack(lines)
        self.path = Path(dense(whole, 1.0))
        self.start_m = float(self.path.beside(np.array([[agent.x_m, agent.y_m]]))[0][0])
        lengths = np.cumsum([graph.lanes[way].centerline.length_m for way in route])
        self._ends = lengths
        limits = road.limits_mps[[road.index[way] for way in route]]
        self._limits = np.where(np.isnan(limits), FALLBACK_MPS, limits)
        if agent.type is AgentType.BICYCLE:
            self._limits = np.full(len(route), agent.speed_mps)
        red = [number for number, way in enumerate(route) if way in road.red]
        self._stops = [float(lengths[number - 1]) if number else 0.0 for number in red]

    def wish_mps(self, s_m: float) -> float:
        """The speed that the driver wishes at s."""
        here = int(np.searchsorted(self._ends, s_m, side="right"))
        return float(self._limits[min(here + _KEPT_WAYS - 1, len(self._limits) - 1)])

    def red_ahead(self, front_m: float) -> float:
        """Where the next red stop line is, inf without one."""
        return min((stop for stop in self._stops if stop >= front_m), default=np.inf)


def lane_under(road: Road, agent: TrafficAgent) -> str | None:
    """The way under an agent that leads where the agent heads, None off every such way."""
    name = road.graph.under(agent.x_m, agent.y_m, agent.heading_rad)
    if name is None:
        return None
    line = road.graph.lanes[name].centerline
    heading = line.heading_at(line.project(agent.x_m, agent.y_m).s_m)
    return name if np.cos(heading - agent.heading_rad) > 0.0 else None


def _stacked(paths: Sequence[Path]) -> FloatArray:
    """Poses (D, M, 3) at every whole metre, the last of each path repeated."""
    longest = max((int(path.length_m) + 2 for path in paths), default=0)
    poses = np.empty((len(paths), longest, 3))
    for row, path in enumerate(paths):
        poses[row] = path.poses(np.arange(longest, dtype=np.float64))
    return poses
