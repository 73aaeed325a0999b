"""Everybody but the ego through a drive: who stands, walks, drives a lane or is replayed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.recording import Track
from augment.simulation.lane_drivers import LaneDrivers, free_agents, lane_under
from augment.simulation.objects import Kind, Objects, join_objects
from augment.simulation.replay import Replay, moves
from augment.simulation.road import Road
from augment.simulation.setting import DriveSetting
from augment.simulation.states import SPEED, EgoBody, FloatArray
from augment.simulation.walkers import Drifters, Walkers, objects_of

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
    made = []
    for track in setting.recording.tracks:
        agent = at_start.get(track.agent_id)
        if track.agent_id in setting.replaced:
            continue
        answers = setting.reactive and track.type in _ON_LANES and moves(track)
        # Who comes into sight later has no lane at t0 to start on; it stays away.
        if answers and (agent is None or lane_under(road, agent) is not None):
            continue
        made.append(track)
    return made
