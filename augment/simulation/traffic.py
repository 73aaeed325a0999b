"""Everybody but the ego through a drive: who stands, walks, drives a lane or is replayed."""

from __future__ import annotations

import numpy as np

from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.recording import Track
from augment.simulation.lane_drivers import LaneDrivers, lane_under
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
    the IDM; anybody else who moves goes straight on.
    """

    def __init__(self, setting: DriveSetting, road: Road, body: EgoBody, ego: FloatArray) -> None:
        replayed = _replayed(setting, road)
        names = {track.agent_id for track in replayed}
        walking: list[TrafficAgent] = []
        driving: list[TrafficAgent] = []
        standing: list[TrafficAgent] = []
        drifting: list[TrafficAgent] = []
        for agent in setting.after.agents:
            if agent.id in names:
                continue
            if agent.walk_to_m is not None:
                walking.append(agent)
            elif agent.speed_mps <= 0.0:
                standing.append(agent)
            elif agent.type in _ON_LANES and lane_under(road, agent) is not None:
                driving.append(agent)
            else:
                drifting.append(agent)
        self._body = body
        self._standing = objects_of(standing, speeds=True)
        self._walkers = Walkers(walking, road.centreline)
        self._drifters = Drifters(drifting)
        self._replay = None
        if setting.recording is not None:
            self._replay = Replay(setting.recording, replayed)
        ego_box = body.boxes(ego)
        self._drivers = LaneDrivers(driving, road, ego_box, self._standing.boxes)
        self._walkers.wake(ego_box[:2])

    def objects(self) -> Objects:
        """Everybody who is there now."""
        parts = [self._standing, self._walkers.objects(), self._drifters.objects()]
        parts.append(self._drivers.objects())
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
        self._drivers.step(join_objects([objects, me]))
        self._drifters.step()
        self._walkers.step()
        self._walkers.wake(ego_box[:2])
        if self._replay is not None:
            self._replay.step()


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
        answers = setting.reactive and AgentType(track.type) in _ON_LANES and moves(track)
        # Who comes into sight later has no lane at t0 to start on; it stays away.
        if answers and (agent is None or lane_under(road, agent) is not None):
            continue
        made.append(track)
    return made
