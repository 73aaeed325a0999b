"""Everybody but the ego through a drive: replayed, walking, driving or standing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, apply
from augment.scene.recording import Recording, Track, agent_of
from augment.simulation.path import Path, dense
from augment.simulation.road import Road
from augment.simulation.states import (
    KIND_OF,
    NOBODY,
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    corners,
    join_objects,
    meet,
    radii,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Idm:
    """The driver's wishes.

    Attributes:
        min_gap_m: To a standing leader.
        headway_s: The time that the gap grows by with the speed.
        max_acceleration_mps2: On a free road from rest; also the upper clip.
        max_deceleration_mps2: Comfortable braking; also the lower clip (as a negative).
        exponent: How late a driver near the wished speed eases off.
    """

    min_gap_m: float
    headway_s: float
    max_acceleration_mps2: float
    max_deceleration_mps2: float
    exponent: float

    def acceleration(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """The law itself, m/s2, not clipped; all arrays in m and m/s and of one shape.

        `gap` is from bumper to bumper; `inf` is a free road.
        """
        root = 2.0 * math.sqrt(self.max_acceleration_mps2 * self.max_deceleration_mps2)
        moving = self.headway_s * speed + speed * (speed - leader_speed) / root
        wished = self.min_gap_m + np.maximum(moving, 0.0)
        free = (speed / np.maximum(target, 1e-9)) ** self.exponent
        return self.max_acceleration_mps2 * (1.0 - free - (wished / gap) ** 2)

    def clipped(
        self, speed: FloatArray, target: FloatArray, gap: FloatArray, leader_speed: FloatArray
    ) -> FloatArray:
        """The law with the gap held at the minimum gap, within the driver's two limits."""
        wished = self.acceleration(speed, target, np.maximum(gap, self.min_gap_m), leader_speed)
        low, high = -self.max_deceleration_mps2, self.max_acceleration_mps2
        return np.minimum(np.maximum(wished, low), high)


PROPOSAL_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.5,
    max_deceleration_mps2=3.0,
    exponent=10.0,
)
"""PDM-Closed's policies."""
TRAFFIC_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=2.0,
    exponent=4.0,
)
"""nuPlan's reactive traffic."""
PLANNER_IDM = Idm(
    min_gap_m=1.0,
    headway_s=1.5,
    max_acceleration_mps2=1.0,
    max_deceleration_mps2=3.0,
    exponent=4.0,
)
"""nuPlan's IDM planner."""


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


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveSetting:
    """A scene with its change.

    Attributes:
        scene: Before the change.
        modification: What changes; nothing by default.
        recording: Tracks and ego motion after t0, None where nothing was recorded. It also says
            which way the ego takes and how far an expert came.
        replay: Whether the recorded others are part of the drive; interPlan clears them.
        reactive: Whether recorded vehicles that move follow their lanes and answer to the ego,
            instead of doing what they did. Who was never recorded answers in any case.
    """

    scene: Scene
    modification: Modification = field(default_factory=Modification)
    recording: Recording | None = None
    replay: bool = True
    reactive: bool = False

    @cached_property
    def after(self) -> Scene:
        """The scene after the change.

        Raises:
            InvalidModification: The change does not fit the scene.
        """
        return apply(self.scene, self.modification)

    @property
    def replaced(self) -> frozenset[str]:
        """Ids whose recorded tracks no longer count."""
        return frozenset(
            [agent.id for agent in self.modification.moved] + list(self.modification.removed)
        )


STANDS_BELOW_MPS = 0.5
"""Recorded speeds of what is parked are not quite 0."""


class Replay:
    """Tracks, read every 0.1 s; who was not seen at a moment is not there.

    Args:
        recording: Its times need not be even; each step takes the nearest moment.
        tracks: Those of the recording that are replayed.
    """

    def __init__(self, recording: Recording, tracks: Sequence[Track]) -> None:
        self._tracks = tuple(tracks)
        self._times = recording.times_s
        states = [track.states for track in self._tracks]
        self._states = np.array(states).reshape(len(states), len(self._times), 4)
        self._kinds = np.array([KIND_OF[t.type] for t in tracks], dtype=np.int64)
        self._sizes = np.array([(t.length_m, t.width_m) for t in tracks]).reshape(-1, 2)
        self._step, self._last_step = 0, round(float(self._times[-1]) / STEP_S)

    def objects(self) -> Objects:
        """Those who are seen now."""
        if self._step > self._last_step or not self._tracks:
            return NOBODY
        states, rows = self._seen()
        return Objects(
            ids=tuple(self._tracks[row].agent_id for row in rows),
            kinds=self._kinds[rows],
            boxes=np.hstack([states[:, :3], self._sizes[rows]]),
            speeds_mps=states[:, 3],
        )

    @property
    def ends_now(self) -> bool:
        """Whether this is the last step that was recorded."""
        return self._step == self._last_step

    def agents(self) -> list[TrafficAgent]:
        """Those who are seen now, as agents who go on from here; who hardly moves stands."""
        states, rows = self._seen()
        tracks = [self._tracks[row] for row in rows]
        states[states[:, 3] < STANDS_BELOW_MPS, 3] = 0.0
        return [agent_of(track, state) for track, state in zip(tracks, states, strict=True)]

    def step(self) -> None:
        """One step on."""
        self._step += 1

    def _seen(self) -> tuple[FloatArray, IntArray]:
        """States (A, 4) and rows (A,) of those who are seen now."""
        at = int(np.abs(self._times - self._step * STEP_S).argmin())
        states = self._states[:, at]
        rows = np.flatnonzero(~np.isnan(states).any(axis=1))
        return states[rows], rows


def moves(track: Track) -> bool:
    """Whether a track goes anywhere: a metre or more from its first seen place."""
    seen = track.states[~np.isnan(track.states).any(axis=1), :2]
    return bool(len(seen) and np.hypot(*(seen - seen[0]).T).max() >= 1.0)


EGO_ID = "the ego"
"""What the ego is called among the objects that lane drivers look at."""
_ON_LANES = (AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)


class Traffic:
    """All objects of one drive.

    Who has a walk walks; what stands stays; a recorded agent is replayed, unless the drive is
    reactive and it is a vehicle that moves on a lane; who moves on a lane otherwise follows it by
    the IDM; anybody else who moves goes straight on. Where the recording ends before the drive,
    those who are replayed go on from there in the same ways.
    """

    def __init__(self, setting: DriveSetting, road: Road, body: EgoBody, ego: FloatArray) -> None:
        replayed = _replayed(setting, road)
        names = {track.agent_id for track in replayed}
        own = [agent for agent in setting.after.agents if agent.id not in names]
        self._body, self._road = body, road
        self._walkers = Walkers(
            [agent for agent in own if agent.walk_to_m is not None], road.centreline
        )
        self._replay = None
        if setting.recording is not None:
            self._replay = Replay(setting.recording, replayed)
        ego_box = body.boxes(ego)
        moving = [agent for agent in own if agent.walk_to_m is None]
        self._crowds = [_Crowd(moving, road, start_clear_of=ego_box)]
        self._walkers.wake(ego_box[:2])

    def objects(self) -> Objects:
        """Everybody who is there now."""
        parts = [crowd.objects() for crowd in self._crowds]
        parts.append(self._walkers.objects())
        if self._replay is not None:
            parts.append(self._replay.objects())
        return join_objects(parts)

    def step(self, ego: FloatArray, objects: Objects) -> None:
        """One step on, given the ego's state (6,) and the objects of this moment."""
        ego_box = self._body.boxes(ego)
        me = Objects(
            ids=(EGO_ID,),
            kinds=np.array([Kind.VEHICLE], dtype=np.int64),
            boxes=ego_box[None],
            speeds_mps=np.array([ego[SPEED]]),
        )
        if self._replay is not None:
            if self._replay.ends_now:
                self._crowds.append(_Crowd(self._replay.agents(), self._road))
            self._replay.step()
        for crowd in self._crowds:
            crowd.step(join_objects([objects, me]))
        self._walkers.step()
        self._walkers.wake(ego_box[:2])


class _Crowd:
    """Agents who go on by themselves: they stand, follow their lane by the IDM or go straight.

    Args:
        agents: As they start.
        road: The map.
        start_clear_of: The ego's box (5,): who starts in a collision on its lane is dropped, as
            in nuPlan; None to keep everybody.
    """

    def __init__(
        self,
        agents: Sequence[TrafficAgent],
        road: Road,
        *,
        start_clear_of: FloatArray | None = None,
    ) -> None:
        standing, driving, drifting = [], [], []
        for agent in agents:
            if agent.speed_mps <= 0.0:
                standing.append(agent)
            elif agent.type in _ON_LANES and lane_under(road, agent) is not None:
                driving.append(agent)
            else:
                drifting.append(agent)
        self._standing = objects_of(standing, speeds=True)
        self._drifters = Drifters(drifting)
        if start_clear_of is not None:
            taken = np.vstack([start_clear_of[None], self._standing.boxes])
            driving = free_agents(driving, taken)
        self._drivers = LaneDrivers(driving, road)

    def objects(self) -> Objects:
        """Those who are still on the map."""
        return join_objects([self._standing, self._drifters.objects(), self._drivers.objects()])

    def step(self, everybody: Objects) -> None:
        """One step on, given all objects of this moment with the ego among them."""
        self._drivers.step(everybody)
        self._drifters.step()


def _replayed(setting: DriveSetting, road: Road) -> list[Track]:
    """The tracks that are played back."""
    if setting.recording is None or not setting.replay:
        return []
    at_start = {agent.id: agent for agent in setting.scene.agents}
    replayed = []
    for track in setting.recording.tracks:
        agent = at_start.get(track.agent_id)
        if track.agent_id in setting.replaced:
            continue
        answers = setting.reactive and track.type in _ON_LANES and moves(track)
        # Who comes into sight later has no lane at t0 to start on; it stays away.
        if answers and (agent is None or lane_under(road, agent) is not None):
            continue
        replayed.append(track)
    return replayed
