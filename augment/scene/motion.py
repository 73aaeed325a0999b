"""Motion of a scenario's agents after t0, its source, and its trails for stills and windows.

Frame: ego frame of t0. T steps, P points.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import lru_cache
from typing import Final

import numpy as np
from numpy.typing import NDArray

from augment.scene.entities import Modification, Scene, TrafficAgent, apply
from augment.scene.lane_graph import LaneGraph
from augment.scene.planned_motion import AtPlace, AtTime
from augment.scene.planned_mover import HeldCourse, PlannedMover
from augment.scene.recording import Recording, track_agent

FloatArray = NDArray[np.float64]

STEP_S: Final = 0.1
HORIZON_S: Final = 6.0
"""So much of a motion is shown, in a still since it set out, and filmed and compared since t0."""
LENGTH_S: Final = 15.0
"""So far a scenario without a recording goes on: as long as the paper drives."""
# Between the outlines of a trail.
EVERY_S = 1.0
# Outlines nearer to the one before are left out.
_LEAST_M = 0.3

_STEPS, _EVERY = round(HORIZON_S / STEP_S), round(EVERY_S / STEP_S)


class MotionSource(StrEnum):
    """Source of an agent's motion after t0."""

    RECORDED = "recorded"
    WALK = "walk"
    HELD_SPEED = "held speed"
    STANDING = "standing"
    PLANNED = "planned"


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Movement:
    """One agent over time.

    Attributes:
        agent: As it is at t0, or where it is first seen.
        states: (T, 4): x_m, y_m, heading_rad, speed_mps of the box centre; NaN where it is not.
        started_s: When a planned motion or a walk set out, None where it never does or has none.
    """

    agent: TrafficAgent
    source: MotionSource
    states: FloatArray
    started_s: float | None = None

    @property
    def is_present(self) -> NDArray[np.bool_]:
        """At which steps it is there, (T,)."""
        return np.asarray(~np.isnan(self.states).any(axis=1))

    @property
    def stands(self) -> bool:
        """True if it is there from t0 to the end and never moves."""
        return self.source is MotionSource.STANDING


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Motion:
    """Everybody over time.

    Attributes:
        times_s: (T,) seconds since t0, every `STEP_S`, the first is 0.
        others: The scene's agents in its order, then who appears later.
    """

    times_s: FloatArray
    ego: Movement
    others: tuple[Movement, ...]


Expectation = Callable[[Scene, Modification], Recording | None]
"""Tracks of a scene after a change, of who was recorded or drives by rules, and the ego's."""


def find_motion(
    scene: Scene, *, recording: Recording | None = None, with_later: bool = False
) -> Motion:
    """Return the motion of the scene's agents after t0, with assumptions where it is unknown.

    Who has a planned motion carries it out; who has a track follows it, else carries a walk out;
    who moves otherwise holds the speed of t0 along its lane, or straight on where there is none;
    all others stand. Nobody reacts to the ego but by the start of a motion. The ego is there at
    every step: where its recording has a gap it goes straight across, and after the last step
    that was recorded it goes on like someone who was not.

    Args:
        scene: After its change.
        recording: What was recorded after t0, without those whom a change moves or removes.
        with_later: Whether who appears after t0 is part of it.
    """
    if recording is not None and round(float(recording.times_s[-1]) / STEP_S) < 1:
        recording = None  # of one moment nothing follows
    last_s = LENGTH_S if recording is None else float(recording.times_s[-1])
    times_s = np.asarray(np.arange(round(last_s / STEP_S) + 1) * STEP_S, dtype=np.float64)
    graph = LaneGraph(scene)
    ego = _ego_movement(scene.ego, recording, times_s, graph)
    tracks = {} if recording is None else {track.agent_id: track for track in recording.tracks}
    others: dict[str, Movement] = {}
    for agent in scene.agents:
        track = tracks.get(agent.id)
        if recording is not None and track is not None:
            is_ruled = scene.options.interplan is not None
            start = track.states[0] if is_ruled else _state(agent)
            others[agent.id] = _resample_track(agent, track.states, recording, times_s, start)
        else:
            others[agent.id] = _assume_movement(agent, times_s, graph)
    if recording is not None and with_later:
        taken = {agent.id for agent in scene.everyone}
        others |= {movement.agent.id: movement for movement in _later(recording, times_s, taken)}
    # Last of all: triggers watch where everybody else is.
    movers = [
        PlannedMover(agent, graph)
        for agent in scene.agents
        if agent.motion or (agent.walk_to_m and agent.id not in tracks)
    ]
    others |= _plan_movements(movers, times_s, {ego.agent.id: ego} | others)
    return Motion(times_s=times_s, ego=ego, others=tuple(others.values()))


def with_movers_alone(scene: Scene, besides: Collection[str] = ()) -> Scene:
    """Return the scene with those alone on whom planned motions depend, and some besides."""
    motions = [(agent.id, agent.motion) for agent in scene.agents if agent.motion is not None]
    names = {*besides, *(name for name, _ in motions)}
    names |= {motion.start.agent_id for _, motion in motions if isinstance(motion.start, AtPlace)}
    return replace(scene, agents=tuple(agent for agent in scene.agents if agent.id in names))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trail:
    """One changed agent that moves.

    Attributes:
        way_m: (P, 2) centres from t0 to `HORIZON_S` after it set out; of one that does not set out
            within that time, where it would go if it did so at once.
        spots: The agent every second since it set out, but where it has hardly moved.
        sets_out: Whether it does within `HORIZON_S`; without, there are no spots.
    """

    agent: TrafficAgent
    way_m: FloatArray
    spots: tuple[TrafficAgent, ...]
    sets_out: bool


@lru_cache(maxsize=32)
def find_trails(
    scene: Scene,
    modification: Modification,
    recording: Recording | None = None,
    *,
    with_held: bool = False,
) -> tuple[Trail, ...]:
    """Return the trail of every changed agent with a motion, in the order of the modification.

    Args:
        scene: Before the change.
        modification: What changes.
        recording: What is expected after t0, as in `find_motion`.
        with_held: Whether who drives on without a motion has a trail as well.

    Raises:
        InvalidModification: The change does not fit the scene, or a path its lanes.
    """
    driving_on = {
        agent.id
        for agent in modification.changed
        if with_held and agent.speed_mps > 0.0 and not (agent.motion or agent.walk_to_m)
    }
    if not (driving_on or modification.has_motion):
        return ()
    after = apply(scene, modification)
    motion = find_motion(with_movers_alone(after, driving_on), recording=recording)
    starts_s = {
        movement.agent.id: math.inf if movement.started_s is None else movement.started_s
        for movement in motion.others
    } | dict.fromkeys(driving_on, 0.0)
    late = {name for name, start_s in starts_s.items() if start_s > HORIZON_S}
    at_once = tuple(
        replace(agent, motion=replace(agent.motion, start=AtTime()))
        for agent in after.agents
        if agent.motion is not None and agent.id in late
    )
    movements = (*motion.others, *find_motion(replace(after, agents=at_once)).others)
    states = {movement.agent.id: movement.states for movement in movements}
    trails = []
    for agent in modification.changed:
        if agent.motion is None and agent.id not in driving_on:
            continue
        sets_out, way = agent.id not in late, states[agent.id]
        start = round(starts_s[agent.id] / STEP_S) if sets_out else 0
        # The way counts from t0, the outlines since it set out.
        way_m, spots_at = way[: start + _STEPS + 1, :2], way[start : start + _STEPS + 1 : _EVERY]
        trail = Trail(
            agent=agent,
            way_m=way_m[~np.isnan(way_m).any(axis=1)],
            spots=_spots(agent, spots_at) if sets_out else (),
            sets_out=sets_out,
        )
        trails.append(trail)
    return tuple(trails)


@lru_cache(maxsize=8)
def ego_spots(scene: Scene, recording: Recording | None = None) -> tuple[TrafficAgent, ...]:
    """Return the ego every second of a film, as recorded or at its speed."""
    motion = find_motion(replace(scene, agents=()), recording=recording)
    return _spots(scene.ego, motion.ego.states[: _STEPS + 1 : _EVERY])


# Private


def _plan_movements(
    movers: Sequence[PlannedMover], times_s: FloatArray, moves: Mapping[str, Movement]
) -> dict[str, Movement]:
    """Return the agents with a motion or a walk, who watch everybody for their triggers."""
    if not movers:
        return {}
    rows: dict[str, list[FloatArray]] = {mover.agent.id: [] for mover in movers}
    for step, time_s in enumerate(times_s.tolist()):
        places = {name: movement.states[step, :2].tolist() for name, movement in moves.items()}
        for mover in movers:
            mover.advance(time_s)
            places[mover.agent.id] = mover.state()[:2].tolist()
        for mover in movers:
            mover.react(places)
            rows[mover.agent.id].append(mover.state())
    return {
        mover.agent.id: _to_movement(mover, np.array(rows[mover.agent.id])) for mover in movers
    }


def _to_movement(mover: PlannedMover, states: FloatArray) -> Movement:
    """A motion or a walk with its states; a walk that leads nowhere, or never begins, stands."""
    agent, started_s, source = mover.agent, mover.started_s, MotionSource.PLANNED
    if agent.motion is None:
        walks = np.ptp(states[:, :2], axis=0).any()
        source = MotionSource.WALK if walks else MotionSource.STANDING
        started_s = started_s if walks else None
    return Movement(agent=agent, source=source, states=states, started_s=started_s)


def _ego_movement(
    ego: TrafficAgent, recording: Recording | None, times_s: FloatArray, graph: LaneGraph
) -> Movement:
    """The ego's recorded motion, completed so that it is there at every step."""
    if recording is None or not recording.shows_ego:
        return _assume_movement(ego, times_s, graph, stays=True)
    read = _resample_track(ego, recording.ego, recording, times_s, _state(ego))
    # (T, 4), and the steps at which the ego was seen.
    states, seen = read.states, np.flatnonzero(read.is_present)
    last = int(seen[-1])
    gaps = np.flatnonzero(~read.is_present[:last])
    visible = states[seen]
    # Unwrapped for the interpolation over gaps, wrapped again after it.
    visible[:, 2] = np.unwrap(visible[:, 2])
    for column in range(4):
        states[gaps, column] = np.interp(times_s[gaps], times_s[seen], visible[:, column])
    states[gaps, 2] = _wrap_angles(states[gaps, 2])
    if last + 1 < len(times_s):
        x_m, y_m, heading_rad, speed_mps = states[last].tolist()
        lane_id = graph.under(x_m, y_m, heading_rad)
        there = replace(
            ego, x_m=x_m, y_m=y_m, heading_rad=heading_rad, speed_mps=speed_mps, lane_id=lane_id
        )
        # From the last step seen on by itself, its own time 0 there.
        states[last:] = _assume_movement(
            there, times_s[last:] - times_s[last], graph, stays=True
        ).states
    return read


def _resample_track(
    agent: TrafficAgent,
    states: FloatArray,
    recording: Recording,
    times_s: FloatArray,
    start: FloatArray | tuple[float, ...],
) -> Movement:
    """A track, read at even times; its first state is that of the scene, to the last digit.

    By interPlan's rules drivers begin on the middle of their lanes, and some are not there.
    """
    read = read_at(states, recording.times_s, times_s)
    read[0] = start
    return Movement(agent=agent, source=MotionSource.RECORDED, states=read)


def read_at(states: FloatArray, recorded_s: FloatArray, times_s: FloatArray) -> FloatArray:
    """Return states between two recorded ones; NaN beside a step where nothing was seen."""
    # (T,) the recorded steps around each time; 1e-9 s, as 0.1 has no exact binary form.
    after = np.clip(np.searchsorted(recorded_s, times_s - 1e-9), 1, len(recorded_s) - 1)
    before = after - 1
    share = (times_s - recorded_s[before]) / (recorded_s[after] - recorded_s[before])
    share = np.clip(share, 0.0, 1.0)[:, None]
    # A share of nothing of what was not seen is nothing, not NaN.
    low, high = states[before], states[after]
    step = high - low
    # The shorter way round, also over pi.
    step[:, 2] = _wrap_angles(step[:, 2])
    read = np.where(share < 1e-6, low, np.where(share > 1.0 - 1e-6, high, low + share * step))
    read[:, 2] = _wrap_angles(read[:, 2])
    return np.asarray(read, dtype=np.float64)


def _later(recording: Recording, times_s: FloatArray, taken: set[str]) -> Iterator[Movement]:
    for track in recording.tracks:
        if track.agent_id in taken:
            continue
        states = read_at(track.states, recording.times_s, times_s)
        seen = np.flatnonzero(~np.isnan(states).any(axis=1))
        if len(seen):
            agent = track_agent(track, states[seen[0]])
            yield Movement(agent=agent, source=MotionSource.RECORDED, states=states)


def _assume_movement(
    agent: TrafficAgent, times_s: FloatArray, graph: LaneGraph, *, stays: bool = False
) -> Movement:
    """Standing, or at the speed of t0 along the lane; past the map it is gone, or it `stays`."""
    states = np.tile(_state(agent), (len(times_s), 1))
    if agent.speed_mps <= 0.0:
        return Movement(agent=agent, source=MotionSource.STANDING, states=states)
    course = HeldCourse(agent, graph)
    for step in range(1, len(times_s)):
        # Speed times time: without a motion the velocity is held.
        pose = course.pose_at(float(times_s[step]) * agent.speed_mps)
        if pose is None:
            states[step:] = [*states[step - 1, :3], 0.0] if stays else np.nan
            break
        states[step, :3] = pose
    return Movement(agent=agent, source=MotionSource.HELD_SPEED, states=states)


def _wrap_angles(angles_rad: FloatArray) -> FloatArray:
    """Angles in (-pi, pi]."""
    # mod gives [0, 2 pi), turned round so that pi itself stays and -pi does not.
    return np.asarray(np.pi - np.mod(np.pi - angles_rad, 2.0 * np.pi), dtype=np.float64)


def _state(agent: TrafficAgent) -> tuple[float, float, float, float]:
    return agent.x_m, agent.y_m, agent.heading_rad, agent.speed_mps


def _spots(agent: TrafficAgent, states: FloatArray) -> tuple[TrafficAgent, ...]:
    spots = [agent]
    for x_m, y_m, heading_rad, _ in states[~np.isnan(states).any(axis=1)].tolist():
        if np.hypot(x_m - spots[-1].x_m, y_m - spots[-1].y_m) >= _LEAST_M:
            spots.append(replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return tuple(spots[1:])
