"""Everybody but the ego through a drive: replayed, walking, driving or standing.

D drivers, K pairs of a driver and an object in its way.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, apply
from augment.scene.recording import Recording, Track, agent_of
from augment.simulation.path import Path, dense
from augment.simulation.planning import Idm
from augment.simulation.road import Road
from augment.simulation.states import (
    NOBODY,
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    IntArray,
    Objects,
    corners,
    join_objects,
    kinds_of,
    meet,
    radii,
)

TRAFFIC_IDM = Idm(1.0, 2.0, 4.0)
"""nuPlan's reactive traffic."""
ACTIVE_WITHIN_M = 50.0
"""A walker appears once the ego has no further to go than this along its centreline."""
WALK_STEPS = 150
"""A walk takes this long, however far it leads: 15 s."""
FALLBACK_MPS = 10.0
"""The wished speed where the map has no limit: nuPlan's."""
SWEEP_S = 1.5
"""Gaps are measured from the road that a driver covers in this time, but for the first step:
nuPlan's way."""
PATH_M = 400.0
_LOOK_M = 80.0
_KEPT_WAYS = 5
"""nuPlan keeps this many ways of a driver's route; the limit of the last one is its wish."""
STANDS_BELOW_MPS = 0.5
"""Recorded speeds of what is parked are not quite 0."""
EGO_ID = "the ego"
"""What the ego is called among the objects that lane drivers look at."""
_ON_LANES = (AgentType.VEHICLE, AgentType.BUS, AgentType.BICYCLE)


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveSetting:
    """What is to be driven: a scene with its change, and what was recorded after t0.

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


def objects_of(agents: Sequence[TrafficAgent]) -> Objects:
    """Return agents as they stand in the scene."""
    boxes = [(a.x_m, a.y_m, a.heading_rad, a.length_m, a.width_m) for a in agents]
    return Objects(
        ids=tuple(agent.id for agent in agents),
        kinds=kinds_of([agent.type for agent in agents]),
        boxes=np.array(boxes, dtype=np.float64).reshape(-1, 5),
        speeds_mps=np.array([agent.speed_mps for agent in agents], dtype=np.float64),
    )


def lane_under(road: Road, agent: TrafficAgent) -> str | None:
    """Return the way under an agent that leads where it heads, None off every such way."""
    name = road.graph.under(agent.x_m, agent.y_m, agent.heading_rad)
    if name is None:
        return None
    line = road.graph.lanes[name].centerline
    heading = line.heading_at(line.project(agent.x_m, agent.y_m).s_m)
    return name if np.cos(heading - agent.heading_rad) > 0.0 else None


class Walkers:
    """People with a walk, as interPlan has them.

    They are not there until the ego has come within `ACTIVE_WITHIN_M` of their start along the
    centreline; then they go from start to end in 15 s, however far that is, and report a speed of
    0, so that a planner takes them for standing.
    """

    def __init__(self, agents: Sequence[TrafficAgent], centreline: Path) -> None:
        base = objects_of(agents)
        ends = np.array([agent.walk_to_m for agent in agents], dtype=np.float64).reshape(-1, 2)
        self._walks = ends - base.boxes[:, :2]
        far = np.hypot(*self._walks.T) > 1e-6
        base.boxes[far, 2] = np.arctan2(self._walks[far, 1], self._walks[far, 0])
        self._base = replace(base, speeds_mps=np.zeros(len(base)))
        self._centreline = centreline
        self._stations = centreline.beside(base.boxes[:, :2])[0]
        self._since = np.full(len(base), -1, dtype=np.int64)
        self._step = 0

    def objects(self) -> Objects:
        """Return those who have set out."""
        gone = np.clip((self._step - self._since) / WALK_STEPS, 0.0, 1.0)
        boxes = self._base.boxes.copy()
        boxes[:, :2] += gone[:, None] * self._walks
        return replace(self._base, boxes=boxes).chosen(self._since >= 0)

    def wake(self, ego_box: FloatArray) -> None:
        """Let those set out whom the ego (5,) has come near to."""
        ego_m = self._centreline.station_of(ego_box)
        near = (self._stations - ego_m <= ACTIVE_WITHIN_M) & (self._since < 0)
        self._since[near] = self._step

    def step(self) -> None:
        """Go one step on."""
        self._step += 1


class _Lane:
    """One driver's path along the lanes from where it starts, its limits and its red lights."""

    def __init__(self, road: Road, agent: TrafficAgent) -> None:
        name = lane_under(road, agent)
        if name is None:
            raise ValueError(f"{agent.id} is on no lane")
        lanes = road.graph.lanes
        start_m = lanes[name].centerline.project(agent.x_m, agent.y_m).s_m
        route = road.graph.route(name, start_m + PATH_M)
        self.path = Path(dense(np.vstack([lanes[way].centerline.points_m for way in route]), 1.0))
        self.start_m = self.path.station_of(np.array([agent.x_m, agent.y_m]))
        self._ends = np.cumsum([lanes[way].centerline.length_m for way in route])
        limits = road.limits_mps[[road.index[way] for way in route]]
        self._limits = np.where(np.isnan(limits), FALLBACK_MPS, limits)
        if agent.type is AgentType.BICYCLE:
            self._limits = np.full(len(route), agent.speed_mps)
        red = [number for number, way in enumerate(route) if way in road.red]
        self._stops = [float(self._ends[number - 1]) if number else 0.0 for number in red]

    def wish_mps(self, s_m: float) -> float:
        """The speed that the driver wishes at s."""
        here = int(np.searchsorted(self._ends, s_m, side="right"))
        return float(self._limits[min(here + _KEPT_WAYS - 1, len(self._limits) - 1)])

    def red_ahead(self, front_m: float) -> float:
        """Where the next red stop line is, inf without one."""
        return min((stop for stop in self._stops if stop >= front_m), default=np.inf)


class LaneDrivers:
    """D drivers who follow the lanes under them by the IDM.

    Args:
        agents: Moving, each on a lane.
        road: The map.
    """

    def __init__(self, agents: Sequence[TrafficAgent], road: Road) -> None:
        self._sweep_s = 0.0
        self._lanes = [_Lane(road, agent) for agent in agents]
        self._base = objects_of(agents)
        self.stations = np.array([lane.start_m for lane in self._lanes], dtype=np.float64)
        self.speeds = self._base.speeds_mps.copy()
        self._ends = np.array([lane.path.length_m for lane in self._lanes], dtype=np.float64)
        # Poses (D, M, 3) at every whole metre, the last of each path repeated.
        whole = np.arange(int(self._ends.max(initial=0.0)) + 2, dtype=np.float64)
        samples = [lane.path.poses(whole) for lane in self._lanes]
        self._samples = np.array(samples).reshape(len(agents), len(whole), 3)

    def objects(self) -> Objects:
        """Return those who are still on the map."""
        boxes = self._base.boxes.copy()
        for row, lane in enumerate(self._lanes):
            boxes[row, :3] = lane.path.poses(self.stations[row])
        now = replace(self._base, boxes=boxes, speeds_mps=self.speeds.copy())
        return now.chosen(self.stations < self._ends)

    def step(self, everybody: Objects) -> None:
        """Go one step on, given all objects of this moment with the ego among them."""
        gap, leader_speed = self._leaders(everybody)
        wishes = [lane.wish_mps(s) for lane, s in zip(self._lanes, self.stations, strict=True)]
        pull = TRAFFIC_IDM.clipped(self.speeds, np.array(wishes), gap, leader_speed)
        self.stations = self.stations + self.speeds * STEP_S
        self.speeds = np.maximum(self.speeds + pull * STEP_S, 0.0)
        self._sweep_s = SWEEP_S

    def _leaders(self, everybody: Objects) -> tuple[FloatArray, FloatArray]:
        """Gap and speed along the path of each driver's leader, (D,) each; inf without one."""
        noses = self.stations + self._base.boxes[:, 3] / 2.0
        front = noses + self._sweep_s * self.speeds
        stops = [lane.red_ahead(nose) for lane, nose in zip(self._lanes, noses, strict=True)]
        gap, speed = np.array(stops) - front, np.zeros(len(front))
        driver, other, hit = self._first_inside(*self._near(everybody), everybody, noses)
        pose = self._samples[driver, hit]
        tangent = np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=1)
        offset = corners(everybody.boxes[other]) - pose[:, None, :2]
        gaps = hit + (offset * tangent[:, None, :]).sum(axis=-1).min(axis=1) - front[driver]
        along = everybody.speeds_mps[other] * np.cos(everybody.boxes[other, 2] - pose[:, 2])
        for row in np.argsort(-gaps, kind="stable"):  # the nearest is written last
            if gaps[row] < gap[driver[row]]:
                gap[driver[row]], speed[driver[row]] = gaps[row], along[row]
        return gap, speed

    def _near(self, everybody: Objects) -> tuple[IntArray, IntArray]:
        """Driver and object (K,) that come near and are not behind."""
        mine, boxes = self.objects(), everybody.boxes
        rows = np.flatnonzero(self.stations < self._ends)
        look = np.minimum(_LOOK_M, 10.0 + mine.speeds_mps * (SWEEP_S + 4.0))
        offset = boxes[None, :, :2] - mine.boxes[:, None, :2]
        heading = mine.boxes[:, None, 2]
        ahead = offset[..., 0] * np.cos(heading) + offset[..., 1] * np.sin(heading)
        near = (offset**2).sum(axis=-1) < (look[:, None] + radii(boxes)) ** 2
        near &= ahead > -radii(boxes)
        near &= np.array(mine.ids, dtype=object)[:, None] != np.array(everybody.ids, dtype=object)
        driver, other = np.nonzero(near)
        return rows[driver], other

    def _first_inside(
        self, driver: IntArray, other: IntArray, everybody: Objects, noses: FloatArray
    ) -> tuple[IntArray, IntArray, IntArray]:
        """Driver, object, and the first sample of the driver's path inside the object, (K,)."""
        start = np.floor(noses[driver]).astype(np.int64)
        at = np.minimum(start[:, None] + np.arange(int(_LOOK_M)), self._samples.shape[1] - 1)
        points, box = self._samples[driver[:, None], at], everybody.boxes[other][:, None]
        dx, dy = points[..., 0] - box[..., 0], points[..., 1] - box[..., 1]
        cos, sin = np.cos(box[..., 2]), np.sin(box[..., 2])
        margin = self._base.boxes[driver, None, 4] / 2.0
        inside = np.abs(dx * cos + dy * sin) <= box[..., 3] / 2.0 + margin
        inside &= np.abs(dy * cos - dx * sin) <= box[..., 4] / 2.0 + margin
        hit = inside.any(axis=1)
        first = at[np.arange(len(at)), inside.argmax(axis=1)]
        return driver[hit], other[hit], first[hit]


class Replay:
    """Tracks, read every 0.1 s; who was not seen at a moment is not there.

    Args:
        recording: Its times need not be even; each step takes the nearest moment.
        tracks: Those of the recording that are replayed.
    """

    def __init__(self, recording: Recording, tracks: Sequence[Track]) -> None:
        self._tracks, self._times = tuple(tracks), recording.times_s
        self._step, self._last_step = 0, round(float(self._times[-1]) / STEP_S)

    def objects(self) -> Objects:
        """Return those who are seen now."""
        return NOBODY if self._step > self._last_step else objects_of(self.agents())

    @property
    def ends_now(self) -> bool:
        """Whether this is the last step that was recorded."""
        return self._step == self._last_step

    def agents(self) -> list[TrafficAgent]:
        """Return those who are seen now, as agents."""
        at = int(np.abs(self._times - self._step * STEP_S).argmin())
        seen = [track for track in self._tracks if not np.isnan(track.states[at]).any()]
        return [agent_of(track, track.states[at]) for track in seen]

    def step(self) -> None:
        """Go one step on."""
        self._step += 1


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
        if start_clear_of is not None:
            taken = np.vstack([start_clear_of[None], objects_of(standing).boxes])
            clear = []
            for agent in driving:
                box = objects_of([agent]).boxes
                if not meet(taken, np.broadcast_to(box, taken.shape)).any():
                    clear.append(agent)
                    taken = np.vstack([taken, box])
            driving = clear
        self._straight = objects_of(standing + drifting)
        self._drivers = LaneDrivers(driving, road)

    def objects(self) -> Objects:
        """Return those who are still on the map."""
        return join_objects([self._straight, self._drivers.objects()])

    def step(self, everybody: Objects) -> None:
        """Go one step on, given all objects of this moment with the ego among them."""
        self._drivers.step(everybody)
        self._straight = replace(self._straight, boxes=self._straight.later(np.array(STEP_S)))


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
        self._replay = Replay(setting.recording, replayed) if setting.recording else None
        walking = [agent for agent in own if agent.walk_to_m is not None]
        self._walkers = Walkers(walking, road.centreline)
        self._walkers.wake(body.boxes(ego))
        moving = [agent for agent in own if agent.walk_to_m is None]
        self._crowds = [_Crowd(moving, road, start_clear_of=body.boxes(ego))]

    def objects(self) -> Objects:
        """Return everybody who is there now."""
        parts = [crowd.objects() for crowd in self._crowds]
        parts.append(self._walkers.objects())
        if self._replay is not None:
            parts.append(self._replay.objects())
        return join_objects(parts)

    def step(self, ego: FloatArray, objects: Objects) -> None:
        """Go one step on, given the ego's state (6,) and the objects of this moment."""
        ego_box = self._body.boxes(ego)
        me = Objects(
            ids=(EGO_ID,),
            kinds=kinds_of([AgentType.VEHICLE]),
            boxes=ego_box[None],
            speeds_mps=np.array([ego[SPEED]]),
        )
        if self._replay is not None:
            if self._replay.ends_now:
                # Who hardly moves at the end stands from then on.
                going_on = [
                    replace(agent, speed_mps=0.0) if agent.speed_mps < STANDS_BELOW_MPS else agent
                    for agent in self._replay.agents()
                ]
                self._crowds.append(_Crowd(going_on, self._road))
            self._replay.step()
        for crowd in self._crowds:
            crowd.step(join_objects([objects, me]))
        self._walkers.step()
        self._walkers.wake(ego_box)


def _replayed(setting: DriveSetting, road: Road) -> list[Track]:
    """The tracks that are played back."""
    if setting.recording is None or not setting.replay:
        return []
    at_start = {agent.id: agent for agent in setting.scene.agents}
    moved = {agent.id for agent in setting.modification.moved}
    replayed = []
    for track in setting.recording.tracks:
        agent = at_start.get(track.agent_id)
        if track.agent_id in moved or track.agent_id in setting.modification.removed:
            continue
        answers = setting.reactive and track.type in _ON_LANES and _moves(track)
        # Who comes into sight later has no lane at t0 to start on; it stays away.
        if answers and (agent is None or lane_under(road, agent) is not None):
            continue
        replayed.append(track)
    return replayed


def _moves(track: Track) -> bool:
    """Whether a track goes anywhere: a metre or more from its first seen place."""
    seen = track.states[~np.isnan(track.states).any(axis=1), :2]
    return bool(len(seen) and np.hypot(*(seen - seen[0]).T).max() >= 1.0)
