"""Recordings cut to 3, 6, 8 and 15 s, each driven for 15 s at half of the expert's mean speed."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from augment.scene.entities import Scene
from augment.scene.recording import Recording, Track
from augment.simulation.drive import Drive, Expert, expert_of, run
from augment.simulation.planning import Plan, Situation
from augment.simulation.road import Road
from augment.simulation.score import score_drive
from augment.simulation.states import STEP_S, EgoBody
from augment.simulation.traffic import DriveSetting
from tests.scenes import vehicle
from tests.simulation.worlds import street

LENGTHS_S = (3.0, 6.0, 8.0, 15.0)
EGO_MPS = 8.0


class ConstantSpeed:
    """Follows the route's centreline at one speed."""

    def __init__(self, speed_mps: float) -> None:
        self._speed_mps = speed_mps

    def start(self, road: Road, body: EgoBody) -> None:
        """Keep the line."""
        self._line = road.centreline

    def plan(self, situation: Situation) -> Plan:
        """Poses every 0.1 s."""
        (start_m,), _ = self._line.beside(situation.ego[None, :2])
        return Plan(poses=self._line.poses(start_m + STEP_S * self._speed_mps * np.arange(41)))


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfSpeed:
    """A drive at half the expert's speed on a recording that was cut."""

    recorded_s: float
    drive: Drive
    expert: Expert
    score: float


def recorded_street() -> tuple[Scene, Recording]:
    """The ego at 8 m/s for 15 s, a car ahead as fast, one parked beside the lane 60 m ahead."""
    scene = street(speed_mps=EGO_MPS)
    ahead = replace(vehicle("Agent2", 40.0, 0.0), speed_mps=EGO_MPS, lane_id="Lane1")
    parked = replace(vehicle("Agent3", 60.0, -3.2), speed_mps=0.0)
    times_s = np.asarray(np.arange(151) * STEP_S, dtype=np.float64)
    tracks = tuple(
        Track(
            agent_id=agent.id,
            type=agent.type,
            length_m=agent.length_m,
            width_m=agent.width_m,
            states=np.column_stack(
                [
                    agent.x_m + agent.speed_mps * times_s,
                    np.full_like(times_s, agent.y_m),
                    np.zeros_like(times_s),
                    np.full_like(times_s, agent.speed_mps),
                ]
            ),
        )
        for agent in (replace(scene.ego, speed_mps=EGO_MPS), ahead, parked)
    )
    recording = Recording(times_s=times_s, ego=tracks[0].states, tracks=tracks[1:])
    return replace(scene, agents=(ahead, parked)), recording


def cut(recording: Recording, length_s: float) -> Recording:
    """The recording's first seconds."""
    kept = recording.times_s <= length_s + STEP_S / 2.0
    return Recording(
        times_s=recording.times_s[kept],
        ego=recording.ego[kept],
        tracks=tuple(replace(one, states=one.states[kept]) for one in recording.tracks),
    )


def half_speed_drives(scene: Scene, recording: Recording) -> Iterator[HalfSpeed]:
    """One drive for each length."""
    road = Road(scene, recording)
    for length_s in LENGTHS_S:
        setting = DriveSetting(scene=scene, recording=cut(recording, length_s))
        expert = expert_of(setting, road)
        drive = run(setting, ConstantSpeed(expert.progress_m / 15.0 / 2.0), road=road)
        value = score_drive(drive, expert).value
        yield HalfSpeed(recorded_s=length_s, drive=drive, expert=expert, score=value)
