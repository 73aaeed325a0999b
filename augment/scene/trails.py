"""Trails of planned motions: outlines in stills, and places that windows must hold.

Frame: ego frame of t0. P points.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from augment.scene.entities import Modification, Scene, TrafficAgent, apply
from augment.scene.motion import HORIZON_S, STEP_S, FloatArray, find_motion, with_movers_alone
from augment.scene.planned_motion import AtTime
from augment.scene.recording import Recording

# Between the outlines of a trail.
EVERY_S = 1.0
# Outlines nearer to the one before are left out.
_LEAST_M = 0.3

_STEPS, _EVERY = round(HORIZON_S / STEP_S), round(EVERY_S / STEP_S)


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


def _spots(agent: TrafficAgent, states: FloatArray) -> tuple[TrafficAgent, ...]:
    spots = [agent]
    for x_m, y_m, heading_rad, _ in states[~np.isnan(states).any(axis=1)].tolist():
        if np.hypot(x_m - spots[-1].x_m, y_m - spots[-1].y_m) >= _LEAST_M:
            spots.append(replace(agent, x_m=x_m, y_m=y_m, heading_rad=heading_rad))
    return tuple(spots[1:])
