"""Everybody but the ego through a drive: replayed, walking, driving or standing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.recording import Recording, Track, agent_of
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
    join_objects,
)
from augment.simulation.traffic import (
    Drifters,
    DriveSetting,
    LaneDrivers,
    Walkers,
    free_agents,
    lane_under,
    objects_of,
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
