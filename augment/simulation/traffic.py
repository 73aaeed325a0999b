"""Everybody but the ego through a drive: replayed, walking, driving or standing.

D drivers, K pairs of a driver and an object in its way. Whoever moves has `objects()`, those who
are there now, and `step(ego_box, everybody)`, which goes one step on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from augment.scene.entities import STEERED, AgentType, Modification, Scene, TrafficAgent, apply
from augment.scene.motion import LENGTH_S, read_at
from augment.scene.planned_motion import EGO_ID
from augment.scene.planned_mover import HeldCourse, PlannedMover
from augment.scene.recording import Recording, Track, track_agent
from augment.simulation import shapes
from augment.simulation.path import Path
from augment.simulation.planning import Idm
from augment.simulation.road import Road
from augment.simulation.states import (
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    IntArray,
    Kind,
    Objects,
    join_objects,
    to_objects,
)

VERSION = 2
"""Of drives, raised when others move otherwise; in 1 all followed their lane by the IDM."""
TRAFFIC_IDM = Idm(1.0, 2.0, 4.0)
"""nuPlan's reactive traffic."""
ACTIVE_WITHIN_M = 50.0
"""A walker appears once the ego has no further to go than this along its centreline."""
WALK_STEPS, LAST_STEP = 150, 301
"""Steps: interPlan's walk takes 15 s and its delay once more, at most to the scenario's end."""
FALLBACK_MPS = 10.0
"""The wished speed where the map has no limit: nuPlan's."""
SWEEP_S = 1.5
"""Gaps begin after the road that is covered in this time, but in the first step, as in nuPlan."""
PATH_M = 400.0
_LOOK_M = 80.0
_KEPT_WAYS = 5
"""nuPlan keeps this many ways of a driver's route; the limit of the last one is its wish."""


@dataclass(frozen=True, kw_only=True, eq=False)
class DriveSetting:
    """Setting of a drive: a scene with its change, and the recording after t0.

    Attributes:
        scene: Before the change.
        modification: What changes; nothing by default.
        recording: Tracks and ego motion after t0, None where nothing was recorded. It also says
            which way the ego takes and how far an expert came.
        reactive: Whether recorded vehicles that move follow their lanes and answer to the ego,
            instead of doing what they did. Who was never recorded answers in any case.
    """

    scene: Scene
    modification: Modification = field(default_factory=Modification)
    recording: Recording | None = None
    reactive: bool = False

    @cached_property
    def after(self) -> Scene:
        """The scene after the change.

        Raises:
            InvalidModification: The change does not fit the scene.
        """
        return apply(self.scene, self.modification)


def lane_under(road: Road, agent: TrafficAgent) -> str | None:
    """Return the way under an agent that leads where it heads, None off every such way."""
    name = road.graph.under(agent.x_m, agent.y_m, agent.heading_rad)
    if name is None:
        return None
    line = road.graph.lanes[name].centerline
    heading = line.heading_at(line.project(agent.x_m, agent.y_m).s_m)
    return name if np.cos(heading - agent.heading_rad) > 0.0 else None


class Walkers:
    """People with a walk in interPlan's scenarios.

    They are not there until the ego has come within `ACTIVE_WITHIN_M` of their start along its
    lane, and straight on from its end; who is as far behind stays away. Then they go from start
    to end in 15 s and as long again as it took until then, and report a speed of 0, so that a
    planner takes them for standing.

    Args:
        agents: Each with a walk.
        road: With the ego's route.
        ego_box: The ego (5,) at t0.
    """

    def __init__(self, agents: Sequence[TrafficAgent], road: Road, ego_box: FloatArray) -> None:
        self._road, base = road, to_objects(agents)
        ends = np.array([agent.walk_to_m for agent in agents], dtype=np.float64).reshape(-1, 2)
        self._walks = ends - base.boxes[:, :2]
        far = np.hypot(*self._walks.T) > 1e-6
        base.boxes[far, 2] = np.arctan2(self._walks[far, 1], self._walks[far, 0])
        self._base = replace(base, speeds_mps=np.zeros(len(base)))
        self._stations = road.centreline.beside(base.boxes[:, :2])[0]
        self._since = np.full(len(base), -1, dtype=np.int64)
        self._step = 0
        self._wake(ego_box)

    def objects(self) -> Objects:
        """Return those who have set out."""
        # Step 0 is for interPlan no step at all.
        since = np.where(self._since == 0, 1, self._since)
        lasts = np.minimum(since + WALK_STEPS, LAST_STEP)
        gone = np.clip((self._step - since) / lasts, 0.0, 1.0)
        boxes = self._base.boxes.copy()
        boxes[:, :2] += gone[:, None] * self._walks
        return replace(self._base, boxes=boxes).chosen(self._since >= 0)

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Go on, and let those set out whom the ego (5,) has come near to."""
        self._step += 1
        self._wake(ego_box)

    def _wake(self, ego_box: FloatArray) -> None:
        ends, stations = self._road.route_ends_m, self._stations
        ego_m = self._road.centreline.station_of(ego_box)
        end_m = ends[min(int(np.searchsorted(ends, ego_m, side="right")), len(ends) - 1)]
        onwards = self._base.boxes[:, :2] - self._road.centreline.poses(end_m)[:2]
        away_m = np.where(stations > end_m - 0.1, end_m + np.hypot(*onwards.T), stations)
        near = (np.abs(away_m - ego_m) <= ACTIVE_WITHIN_M) & (self._since < 0)
        self._since[near] = self._step


class Replay:
    """Tracks, read every 0.1 s as `find_motion` reads them; who was not seen is not there.

    Args:
        recording: Its times need not be even.
        tracks: Those of the recording that are replayed.
    """

    def __init__(self, recording: Recording, tracks: Sequence[Track]) -> None:
        self.steps_left = round(float(recording.times_s[-1]) / STEP_S)
        times_s: FloatArray = np.asarray(STEP_S * np.arange(self.steps_left + 1), np.float64)
        read = read_at if self.steps_left else lambda states, recorded_s, times_s: states
        self._rows = [(one, read(one.states, recording.times_s, times_s)) for one in tracks]
        self._step = 0

    def agents(self) -> list[TrafficAgent]:
        """Return those who are seen now, as agents."""
        now = ((track, states[self._step]) for track, states in self._rows)
        return [track_agent(track, state) for track, state in now if not np.isnan(state).any()]

    def objects(self) -> Objects:
        """Return those who are seen now."""
        return to_objects(self.agents() if self.steps_left >= 0 else [])

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Go one step on."""
        self._step += 1
        self.steps_left -= 1


class StraightOn:
    """Agents who stand or go straight on at their speed."""

    def __init__(self, agents: Sequence[TrafficAgent]) -> None:
        self._objects = to_objects(agents)

    def objects(self) -> Objects:
        """Return all of them."""
        return self._objects

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Go one step on."""
        self._objects = replace(self._objects, boxes=self._objects.later(np.array(STEP_S)))


class PlannedMovers:
    """Agents with a motion or a walk, who react to nobody but for their triggers."""

    def __init__(self, agents: Sequence[TrafficAgent], road: Road) -> None:
        self._base, self._step = to_objects(agents), 0
        self._movers = [PlannedMover(agent, road.graph) for agent in agents]

    def objects(self) -> Objects:
        """Return those who are still on the map."""
        states = np.array([mover.state() for mover in self._movers]).reshape(-1, 4)
        boxes = np.column_stack([states[:, :3], self._base.boxes[:, 3:]])
        now = replace(self._base, boxes=boxes, speeds_mps=states[:, 3])
        return now.chosen(~np.isnan(states[:, 0]))

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Let those set out whose trigger fires, and go one step on."""
        centres: list[list[float]] = everybody.boxes[:, :2].tolist()
        places = {name: (x, y) for name, (x, y) in zip(everybody.ids, centres, strict=True)}
        self._step += 1
        for mover in self._movers:
            mover.react(places)
            mover.advance(self._step * STEP_S)


class LaneDrivers:
    """D drivers who follow the lanes under them by the IDM.

    Args:
        agents: Moving, each on a lane.
        road: The map.
    """

    def __init__(self, agents: Sequence[TrafficAgent], road: Road) -> None:
        self._base, self._sweep_s = to_objects(agents), 0.0
        self.speeds = self._base.speeds_mps
        routes = [_find_route(road, agent) for agent in agents]
        paths = [road.path_over(route, spacing_m=1.0) for route in routes]
        stations = [
            path.station_of(box) for path, box in zip(paths, self._base.boxes, strict=True)
        ]
        self.stations = np.array(stations, dtype=np.float64)
        self._ends = np.array([path.length_m for path in paths], dtype=np.float64)
        # (D, M, 5) at every whole metre, the last of each path repeated: x, y, heading, the
        # wished speed, and where the next red stop line is.
        metres = np.arange(int(self._ends.max(initial=0.0)) + 2, dtype=np.float64)
        tables = [
            _driver_table(road, *row, metres) for row in zip(agents, routes, paths, strict=True)
        ]
        self._tables = np.array(tables).reshape(len(agents), len(metres), 5)
        self._rows = np.arange(len(agents))

    def objects(self) -> Objects:
        """Return those who are still on the map."""
        boxes, poses = self._base.boxes.copy(), self._poses()
        boxes[:, :3] = poses
        now = replace(self._base, boxes=boxes, speeds_mps=self.speeds)
        return now.chosen(~np.isnan(poses[:, 0]))

    def _poses(self) -> FloatArray:
        """Poses (D, 3) now; NaN past the map."""
        share = (self.stations % 1.0)[:, None]
        poses = (1.0 - share) * self._at(self.stations)[:, :3]
        poses += share * self._at(self.stations + 1.0)[:, :3]
        poses[self.stations >= self._ends] = np.nan
        return poses

    def _at(self, stations: FloatArray) -> FloatArray:
        """The rows (D, 5) of the tables at the whole metres before stations (D,)."""
        metre = np.clip(stations.astype(np.int64), 0, self._tables.shape[1] - 1)
        return np.asarray(self._tables[self._rows, metre])

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Go one step on, given all objects of this moment with the ego among them."""
        gap, leader_speed = self._leaders(everybody)
        wishes = self._at(self.stations)[:, 3]
        pull = TRAFFIC_IDM.clip(self.speeds, wishes, gap, leader_speed)
        self.stations = self.stations + self.speeds * STEP_S
        self.speeds = np.maximum(self.speeds + pull * STEP_S, 0.0)
        self._sweep_s = SWEEP_S

    def _leaders(self, everybody: Objects) -> tuple[FloatArray, FloatArray]:
        """Gap and speed along the path of each driver's leader, (D,) each; inf without one."""
        noses = self.stations + self._base.boxes[:, 3] / 2.0
        front = noses + self._sweep_s * self.speeds
        gap, speed = self._at(noses)[:, 4] - front, np.zeros(len(front))
        driver, other, hit = self._first_inside(*self._near(everybody), everybody, noses)
        pose = self._tables[driver, hit]
        tangent = np.stack([np.cos(pose[:, 2]), np.sin(pose[:, 2])], axis=1)
        offset = shapes.corners(everybody.boxes[other]) - pose[:, None, :2]
        gaps = hit + (offset * tangent[:, None, :]).sum(axis=-1).min(axis=1) - front[driver]
        along = everybody.speeds_mps[other] * np.cos(everybody.boxes[other, 2] - pose[:, 2])
        for row in np.argsort(-gaps, kind="stable"):  # the nearest is written last
            if gaps[row] < gap[driver[row]]:
                gap[driver[row]], speed[driver[row]] = gaps[row], along[row]
        return gap, speed

    def _near(self, everybody: Objects) -> tuple[IntArray, IntArray]:
        """Driver and object (K,) that come near and are not behind."""
        mine, boxes = self.objects(), everybody.boxes
        rows = np.flatnonzero(~np.isnan(self._poses()[:, 0]))
        look = np.minimum(_LOOK_M, 10.0 + mine.speeds_mps * (SWEEP_S + 4.0))
        offset = boxes[None, :, :2] - mine.boxes[:, None, :2]
        heading = mine.boxes[:, None, 2]
        ahead = offset[..., 0] * np.cos(heading) + offset[..., 1] * np.sin(heading)
        near = (offset**2).sum(axis=-1) < (look[:, None] + shapes.radii(boxes)) ** 2
        near &= ahead > -shapes.radii(boxes)
        near &= np.array(mine.ids, dtype=object)[:, None] != np.array(everybody.ids, dtype=object)
        driver, other = np.nonzero(near)
        return rows[driver], other

    def _first_inside(
        self, driver: IntArray, other: IntArray, everybody: Objects, noses: FloatArray
    ) -> tuple[IntArray, IntArray, IntArray]:
        """Driver, object, and the first sample of the driver's path inside the object, (K,)."""
        start = np.floor(noses[driver]).astype(np.int64)
        at = np.minimum(start[:, None] + np.arange(int(_LOOK_M)), self._tables.shape[1] - 1)
        points, box = self._tables[driver[:, None], at], everybody.boxes[other][:, None]
        dx, dy = points[..., 0] - box[..., 0], points[..., 1] - box[..., 1]
        cos, sin = np.cos(box[..., 2]), np.sin(box[..., 2])
        margin = self._base.boxes[driver, None, 4] / 2.0
        inside = np.abs(dx * cos + dy * sin) <= box[..., 3] / 2.0 + margin
        inside &= np.abs(dy * cos - dx * sin) <= box[..., 4] / 2.0 + margin
        hit = inside.any(axis=1)
        first = at[np.arange(len(at)), inside.argmax(axis=1)]
        return driver[hit], other[hit], first[hit]


class HeldDrivers(LaneDrivers):
    """D drivers who hold their velocity along their lanes; they brake for the ego alone.

    Without the ego they are where `find_motion` has them.

    Args:
        agents: Moving.
        courses: Their courses, each along a lane.
    """

    def __init__(self, agents: Sequence[TrafficAgent], courses: Sequence[HeldCourse]) -> None:
        self._base, self._sweep_s, self._courses = to_objects(agents), 0.0, courses
        self.speeds, self.stations = self._base.speeds_mps, np.zeros(len(agents))
        # (D, M, 5) as of drivers by the IDM, but for limits and lights.
        furthest_m = LENGTH_S * self.speeds.max(initial=0.0) + _LOOK_M
        tables = np.full((len(agents), int(furthest_m), 5), np.inf)
        tables[:, :, 3] = self.speeds[:, None]
        for table, course in zip(tables, courses, strict=True):
            for metre in range(len(table)):
                pose = course.pose_at(float(metre))
                table[metre, :3] = table[max(metre - 1, 0), :3] if pose is None else pose
        self._tables, self._rows = tables, np.arange(len(agents))

    def step(self, ego_box: FloatArray, everybody: Objects) -> None:
        """Go one step on, given all objects of this moment with the ego among them."""
        is_ego = np.array([name == EGO_ID for name in everybody.ids], dtype=np.bool_)
        super().step(ego_box, everybody.chosen(is_ego))

    def _poses(self) -> FloatArray:
        poses = map(HeldCourse.pose_at, self._courses, self.stations.tolist())
        gone = (math.nan, math.nan, math.nan)
        return np.array([pose or gone for pose in poses], dtype=np.float64).reshape(-1, 3)


def _find_route(road: Road, agent: TrafficAgent) -> list[str]:
    """The ways that a driver follows from the one under it on."""
    name = lane_under(road, agent)
    assert name is not None, agent.id
    start_m = road.graph.lanes[name].centerline.project(agent.x_m, agent.y_m).s_m
    return road.graph.route(name, start_m + PATH_M)


def _driver_table(
    road: Road, agent: TrafficAgent, route: Sequence[str], path: Path, metres: FloatArray
) -> FloatArray:
    """One driver's row of `LaneDrivers`' tables, (M, 5)."""
    ends = np.cumsum([road.graph.lanes[way].centerline.length_m for way in route])
    limits = road.limits_mps[[road.index[way] for way in route]]
    limits = np.where(np.isnan(limits), FALLBACK_MPS, limits)
    if agent.type is AgentType.BICYCLE:
        limits = np.full(len(route), agent.speed_mps)
    way = np.searchsorted(ends, metres, side="right") + _KEPT_WAYS - 1
    wishes = limits[np.minimum(way, len(route) - 1)]
    stops = np.array([0.0, *ends])[:-1][[way in road.red for way in route]]
    next_stop = np.append(stops, np.inf)[np.searchsorted(stops, metres)]
    return np.column_stack([path.poses(metres), wishes, next_stop])


def _hold_course(agents: Sequence[TrafficAgent], road: Road) -> list[StraightOn | LaneDrivers]:
    """Let agents go on as `find_motion` has them: along their lane, straight on, or standing."""
    courses = [(agent, HeldCourse(agent, road.graph)) for agent in agents if agent.speed_mps > 0.0]
    courses = [(agent, course) for agent, course in courses if course.lane_id is not None]
    driving = [agent for agent, _ in courses]
    straight_on = StraightOn([agent for agent in agents if agent not in driving])
    return [straight_on, HeldDrivers(driving, [course for _, course in courses])]


def _set_moving(
    agents: Sequence[TrafficAgent], road: Road, start_clear_of: FloatArray | None = None
) -> list[StraightOn | LaneDrivers]:
    """Let agents go on by themselves: they stand, follow their lane by the IDM or go straight.

    Args:
        agents: As they start.
        road: The map.
        start_clear_of: The ego's box (5,): who starts in a collision on its lane is dropped, as
            in nuPlan; None to keep everybody.
    """
    standing = [agent for agent in agents if agent.speed_mps <= 0.0]
    moving = [agent for agent in agents if agent.speed_mps > 0.0]
    driving = [agent for agent in moving if agent.type in STEERED and lane_under(road, agent)]
    straight_on = StraightOn([*standing, *(agent for agent in moving if agent not in driving)])
    if start_clear_of is not None:
        taken, clear = np.vstack([start_clear_of[None], to_objects(standing).boxes]), []
        for agent in driving:
            box = to_objects([agent]).boxes
            if not shapes.meet(taken, box).any():
                clear.append(agent)
                taken = np.vstack([taken, box])
        driving = clear
    return [straight_on, LaneDrivers(driving, road)]


class Traffic:
    """All objects of one drive.

    A recorded agent is replayed, unless the drive is reactive and it is a vehicle that moves on a
    lane, which it then follows by the IDM; where the recording ends before the drive, they go on
    from there by the IDM or straight on. All others are where `find_motion` has them, but who
    holds its velocity along a lane brakes for the ego. In interPlan's scenarios all who move on a
    lane follow it by the IDM, and its walks differ.
    """

    def __init__(self, setting: DriveSetting, road: Road, body: EgoBody, ego: FloatArray) -> None:
        self._body, self._road, ego_box = body, road, body.boxes(ego)
        replayed = _list_replayed(setting, road)
        names = {track.agent_id for track in replayed}
        own = [agent for agent in setting.after.agents if agent.id not in names]
        is_interplans = setting.scene.options.interplan is not None
        walking = [agent for agent in own if agent.walk_to_m is not None and is_interplans]
        planned = [
            agent for agent in own if agent.motion or (agent.walk_to_m and not is_interplans)
        ]
        plain = [agent for agent in own if agent not in (*walking, *planned)]
        recorded = setting.recording.tracks if setting.recording else ()
        tracked = {track.agent_id for track in recorded} - setting.modification.replaced
        answering = [agent for agent in plain if is_interplans or agent.id in tracked]
        self._movers: list[StraightOn | LaneDrivers | Walkers | PlannedMovers | Replay] = [
            *_hold_course([agent for agent in plain if agent not in answering], road),
            *_set_moving(answering, road, ego_box),
            Walkers(walking, road, ego_box),
            PlannedMovers(planned, road),
        ]
        self._replay = Replay(setting.recording, replayed) if setting.recording else None
        self._movers += [self._replay] if self._replay else []

    def objects(self) -> Objects:
        """Return everybody who is there now."""
        return join_objects([mover.objects() for mover in self._movers])

    def step(self, ego: FloatArray, objects: Objects, *, sees_ego: bool = True) -> None:
        """Go one step on, given the ego's state (6,), whom drivers may not see, and the others."""
        ego_box = self._body.boxes(ego)
        me = Objects(
            ids=(EGO_ID,),
            kinds=np.array([Kind.VEHICLE], dtype=np.int64),
            boxes=ego_box[None],
            speeds_mps=np.array([ego[SPEED]]),
        )
        if self._replay is not None and self._replay.steps_left == 0:
            # Who hardly moves at the end stands from then on.
            going_on = [
                # Recorded speeds of what is parked are not quite 0.
                replace(agent, speed_mps=0.0) if agent.is_stopped else agent
                for agent in self._replay.agents()
            ]
            self._movers += _set_moving(going_on, self._road)
        everybody = join_objects([objects, me])
        for mover in self._movers:
            is_blind = not sees_ego and isinstance(mover, LaneDrivers)
            mover.step(ego_box, objects if is_blind else everybody)


def _list_replayed(setting: DriveSetting, road: Road) -> list[Track]:
    """The tracks that are played back."""
    if setting.recording is None:
        return []
    at_start = {agent.id: agent for agent in setting.scene.agents}
    moved = {agent.id for agent in setting.modification.moved}
    replayed = []
    for track in setting.recording.tracks:
        agent = at_start.get(track.agent_id)
        if track.agent_id in moved or track.agent_id in setting.modification.removed:
            continue
        if agent is not None and (agent.motion is not None or agent.walk_to_m is not None):
            continue
        answers = setting.reactive and track.type in STEERED and _moves(track)
        # Who comes into sight later has no lane at t0 to start on; it stays away.
        if answers and (agent is None or lane_under(road, agent) is not None):
            continue
        replayed.append(track)
    return replayed


def _moves(track: Track) -> bool:
    """Return whether a track moves a metre or more from its first place."""
    seen = track.states[~np.isnan(track.states).any(axis=1), :2]
    return bool(len(seen) and np.hypot(*(seen - seen[0]).T).max() >= 1.0)
