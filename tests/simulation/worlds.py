"""Long streets and drives made by hand, whose right answers can be seen by eye."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from augment.scene.entities import Scene, TrafficAgent
from augment.scene.recording import Recording, Track
from augment.simulation.drive import Drive
from augment.simulation.planning import Plan, Situation
from augment.simulation.road import Road
from augment.simulation.states import (
    HEADING,
    SPEED,
    STEP_S,
    EgoBody,
    FloatArray,
    Objects,
    X,
    Y,
    to_objects,
)
from tests.scenes import EGO, lanes, scene, vehicle

BODY = EgoBody()
LIMIT_MPS = 10.0


def street(
    length_m: float = 400.0, *, speed_mps: float = 8.0, limit_mps: float | None = LIMIT_MPS
) -> Scene:
    """Lane1 along y = 0 from x = -50 m on, Lane2 towards it along y = 3.5 m, nothing else."""
    both = lanes(0.0, oncoming_m=(3.5,), ends_m=(-50.0, length_m), speed_limit_mps=limit_mps)
    return scene(ego=replace(EGO, speed_mps=speed_mps), areas=(), lanes=both)


def states_along(
    speeds_mps: Sequence[float] | FloatArray, *, y_m: float = 0.0, heading_rad: float = 0.0
) -> FloatArray:
    """Rear-axle states (T, 6) of a centre that starts at (0, y) and goes straight."""
    speeds = np.asarray(speeds_mps, dtype=np.float64)
    made = np.zeros((len(speeds), 6))
    gone = np.concatenate([[0.0], np.cumsum(speeds[:-1]) * 0.1])
    made[:, X] = gone * np.cos(heading_rad) - BODY.centre_m * np.cos(heading_rad)
    made[:, Y] = y_m + gone * np.sin(heading_rad) - BODY.centre_m * np.sin(heading_rad)
    made[:, HEADING] = heading_rad
    made[:, SPEED] = speeds
    made[1:, 4] = np.diff(speeds) / 0.1
    return made


def driven(
    states: FloatArray, agents: Sequence[TrafficAgent] = (), *, on: Scene | None = None
) -> Drive:
    """A drive that went through these states, among agents that go on as they start."""
    road = Road(on or street())
    return Drive(road=road, body=BODY, states=states, objects=rows(agents, len(states)))


def rows(agents: Sequence[TrafficAgent], count: int) -> list[Objects]:
    start = to_objects(agents)
    return [replace(start, boxes=start.later(np.array(0.1 * step))) for step in range(count)]


class ConstantSpeed:
    """A planner that follows the route's centreline at one speed."""

    def __init__(self, speed_mps: float) -> None:
        self._way_m = speed_mps * STEP_S * np.arange(41, dtype=np.float64)

    def start(self, road: Road, body: EgoBody) -> None:
        self._line = road.centreline

    def plan(self, situation: Situation) -> Plan:
        return Plan(poses=self._line.poses(self._line.station_of(situation.ego) + self._way_m))


def track(agent: TrafficAgent, states: FloatArray) -> Track:
    size = {"length_m": agent.length_m, "width_m": agent.width_m}
    return Track(agent_id=agent.id, type=agent.type, states=states, **size)


def recorded_street(length_s: float = 15.0) -> tuple[Scene, Recording]:
    """The ego at 8 m/s, a car 40 m ahead as fast, one parked beside the lane 60 m ahead."""
    ahead = vehicle("Agent2", 40.0, 0.0, speed_mps=8.0, lane_id="Lane1")
    scene = replace(street(), agents=(ahead, vehicle("Agent3", 60.0, -3.2)))
    times_s = np.arange(round(length_s / STEP_S) + 1, dtype=np.float64) * STEP_S
    ego, *others = (
        np.array([agent.x_m, agent.y_m, 0.0, agent.speed_mps])
        + times_s[:, None] * np.array([agent.speed_mps, 0.0, 0.0, 0.0])
        for agent in scene.everyone
    )
    tracks = tuple(track(*row) for row in zip(scene.agents, others, strict=True))
    return scene, Recording(times_s=times_s, ego=ego, tracks=tracks)
