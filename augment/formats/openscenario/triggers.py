"""When a motion starts, and where it leads from then on, as an OpenSCENARIO file says it.

Positions there are rear axles' while our distances run between centres, and our triggers fire at
steps. What is written is what holds between the axles at the step at which a trigger fires: with
our ego the moment is exact, and with another one it is as far off as the axles are from the
centres. Frame: the ego frame of t0. T steps.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from augment.formats.writing import Cell
from augment.geometry.polyline import FloatArray
from augment.scene.entities import Point, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import STEP_S, MotionSource, Movement, find_motion
from augment.scene.planned_motion import EGO_ID, AtPlace, AtTime, NearEgo, PlannedMotion
from augment.scene.planned_mover import carry_out, walk_as_motion

_MARGIN_M = 1e-4
"""So that a comparison at the very step does not hang on the last digit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WrittenDistance:
    """A condition on a distance between points of reference.

    Attributes:
        who: Whose distance is looked at.
        place_m: To where, None for to the ego.
        off_m: How far it may be off where the ego, or who is watched, comes another way.
        early_s: So much earlier than ours it holds already with our ego; 0 as a rule.
    """

    who: str
    within_m: float
    place_m: Point | None
    off_m: float
    early_s: float


def with_motion(movement: Movement) -> TrafficAgent | None:
    """Return the agent with its motion, None without; a walk starts once the ego is near."""
    agent = movement.agent
    if movement.source is MotionSource.RECORDED:
        return None
    goes_nowhere = agent.walk_to_m and math.dist((agent.x_m, agent.y_m), agent.walk_to_m) < 1e-6
    moving = walk_as_motion(agent)
    return None if goes_nowhere or moving.motion is None else moving


def motion_in(agent: TrafficAgent) -> PlannedMotion:
    """Return the motion of an agent that has one."""
    assert agent.motion is not None
    return agent.motion


def list_unstarted_states(cell: Cell, agent: TrafficAgent) -> FloatArray:
    """Return states (T, 4) of an agent whose motion never starts; NaN past the map."""
    alone = replace(cell.after, agents=(replace(agent, motion=None),))
    recording = cell.recording and cell.recording.without({agent.id})
    return find_motion(alone, recording=recording).others[0].states


def states_since_start(cell: Cell, agent: TrafficAgent, started_s: float) -> FloatArray:
    """Return states (T, 4) from the start of its motion on; NaN past the map."""
    motion = replace(motion_in(agent), start=AtTime(after_s=started_s))
    times_s = (started_s + cell.motion.times_s).tolist()
    return carry_out(replace(agent, motion=motion), LaneGraph(cell.after), times_s)


def distance_condition(
    cell: Cell,
    agent: TrafficAgent,
    start: NearEgo | AtPlace,
    started_s: float | None,
    ahead_m: Callable[[TrafficAgent], float],
) -> WrittenDistance:
    """Return the condition by which a motion starts.

    Args:
        cell: What is written.
        agent: Who has the motion.
        start: The motion's.
        started_s: When it starts in the cell, None where it never does.
        ahead_m: From an agent's point of reference to its centre.
    """
    moves = {move.agent.id: move for move in (cell.motion.ego, *cell.motion.others)}
    waits_for_ego = isinstance(start, NearEgo)
    watched = moves[EGO_ID if isinstance(start, NearEgo) else start.agent_id]
    back_m = ahead_m(watched.agent)
    centres, axles = watched.states[:, :2], _behind(watched.states, back_m)
    if isinstance(start, NearEgo):
        # Once it starts it looks along its path, so what counts is how it stood before.
        own = list_unstarted_states(cell, agent)
        goals, marks = own[:, :2], _behind(own, ahead_m(agent))
        off_m = back_m + ahead_m(agent)
    else:
        goals = marks = np.tile((start.x_m, start.y_m), (len(centres), 1))
        off_m = back_m
    within_m = start.within_m
    step = None if started_s is None else round(started_s / STEP_S)
    if step is not None:
        way = goals[step] - centres[step]
        gap_m = float(np.hypot(*way))
        passed_m = within_m - gap_m if step else 0.0
        if waits_for_ego:
            within_m += float(np.hypot(*(marks[step] - axles[step]))) - gap_m - passed_m
        else:
            ahead = way / gap_m if gap_m > 1e-6 else np.zeros(2)
            marks = marks - goals + axles[step] + (gap_m + passed_m) * ahead
    holds = np.hypot(*(marks - axles).T) <= within_m + _MARGIN_M
    early = 0 if step is None else step - int(holds.argmax())
    return WrittenDistance(
        who=agent.id if waits_for_ego else watched.agent.id,
        within_m=within_m + _MARGIN_M,
        place_m=None if waits_for_ego else (float(marks[0, 0]), float(marks[0, 1])),
        off_m=off_m,
        early_s=early * STEP_S,
    )


# Private


def _behind(states: FloatArray, back_m: float) -> FloatArray:
    """Points of reference (T, 2): so far behind the centres."""
    back = back_m * np.column_stack([np.cos(states[:, 2]), np.sin(states[:, 2])])
    return np.asarray(states[:, :2] - back)
