"""Scenarios as OpenSCENARIO XML 1.2, each with its map as OpenDRIVE.

Everybody that moves follows a trajectory with times; who has a motion or a walk of its own sets
out once its trigger fires. Positions are rear axles' while our distances run between centres, and
our triggers fire at steps: what is written is what holds between the axles at the step at which a
trigger fires. With our ego the moment is exact, and with another one it is as far off as the axles
are from the centres. Frame: the ego frame of t0. T steps. The files are made by
scenariogeneration. Source: ASAM OpenSCENARIO XML 1.2.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, time
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats import writing
from augment.formats.openscenario.roads import write_map
from augment.formats.openscenario.trajectories import place_beside
from augment.scene.entities import AgentType, Point, TrafficAgent
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import STEP_S, FloatArray, MotionSource, Movement, find_motion
from augment.scene.planned_motion import EGO_ID, AtPlace, AtTime, NearEgo, PlannedMotion
from augment.scene.planned_mover import carry_out, walk_as_motion

MINOR_VERSION: Final = 2
REAR_AXLE_SHARE: Final = 1.461 / 5.176
"""A vehicle's position is its rear axle's; from there to its centre, as a share of its length."""

_VEHICLES = {
    AgentType.EGO_VEHICLE: "car",
    AgentType.VEHICLE: "car",
    AgentType.BUS: "bus",
    AgentType.BICYCLE: "bicycle",
}
_THINGS = {
    AgentType.TRAFFIC_CONE: "obstacle",
    AgentType.BARRIER: "barrier",
    AgentType.CONSTRUCTION_SIGN: "obstacle",
    AgentType.GENERIC_OBJECT: "obstacle",
}
_HEIGHT_M = {AgentType.BUS: 3.0, AgentType.TRAFFIC_CONE: 0.5, AgentType.BARRIER: 1.0}
_MARGIN_M = 1e-4
"""So that a comparison at the very step does not hang on the last digit."""
_USUAL_HEIGHT_M, _MASS_KG, _FASTEST_MPS = 1.8, 1000.0, 70.0


def write(cells: Sequence[writing.Cell]) -> writing.Output:
    """For each cell a scenario and its map; a map that no road can follow is refused."""
    return writing.write_each(cells, _write_one)


# Private


def _write_one(cell: writing.Cell, report: writing.LossReport) -> dict[str, bytes]:
    from scenariogeneration import xosc

    road_file, motion = f"{cell.stem}.xodr", cell.motion
    files = {road_file: write_map(cell, report)}
    everyone = (motion.ego, *motion.others)
    entities = xosc.Entities()
    for participant in everyone:
        entities.add_scenario_object(participant.agent.id, _entity(xosc, participant.agent))
    board = xosc.StoryBoard(_init(xosc, everyone), _at(xosc, "end", float(motion.times_s[-1])))
    for participant in everyone:
        name = participant.agent.id
        maneuver = xosc.Maneuver(f"{name} maneuver")
        for event in _events(xosc, cell, participant):
            maneuver.add_event(event)
        if maneuver.events:
            group = xosc.ManeuverGroup(f"{name} group")
            group.add_actor(name)
            group.add_maneuver(maneuver)
            board.add_maneuver_group(group, _at(xosc, f"{name} start", 0.0))
    scenario = xosc.Scenario(
        cell.name,
        "Scenario Arena",
        xosc.ParameterDeclarations(),
        entities,
        board,
        xosc.RoadNetwork(roadfile=road_file),
        xosc.Catalog(),
        osc_minor_version=MINOR_VERSION,
        license=xosc.License(cell.after.provenance),
        creation_date=datetime.combine(cell.made_on, time(), UTC).replace(tzinfo=None),
    )
    root = scenario.get_element()
    ET.indent(root)
    text = f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, 'unicode')}\n"
    _report(cell, report)
    return files | {f"{cell.stem}.xosc": text.encode()}


def _entity(xosc: Any, agent: TrafficAgent) -> Any:
    height_m, ahead_m = _HEIGHT_M.get(agent.type, _USUAL_HEIGHT_M), _ahead_m(agent)
    box = xosc.BoundingBox(agent.width_m, agent.length_m, height_m, ahead_m, 0.0, height_m / 2.0)
    if agent.type in _VEHICLES:
        category = getattr(xosc.VehicleCategory, _VEHICLES[agent.type])
        front, rear = (
            xosc.Axle(steering, 0.6, agent.width_m, at_m, 0.3)
            for steering, at_m in ((0.5, 2.0 * ahead_m), (0.0, 0.0))
        )
        limits = (_FASTEST_MPS, 10.0, 10.0)
        return xosc.Vehicle(agent.id, category, box, front, rear, *limits, mass=_MASS_KG)
    if agent.type is AgentType.PEDESTRIAN:
        return xosc.Pedestrian(agent.id, 80.0, xosc.PedestrianCategory.pedestrian, box)
    category = getattr(xosc.MiscObjectCategory, _THINGS[agent.type])
    return xosc.MiscObject(agent.id, 10.0, category, box)


def _ahead_m(agent: TrafficAgent) -> float:
    """From the point whose position is written to the centre of the box."""
    return agent.length_m * REAR_AXLE_SHARE if agent.type in _VEHICLES else 0.0


def _position(xosc: Any, agent: TrafficAgent, state: FloatArray) -> Any:
    x_m, y_m, heading_rad, _ = (float(value) for value in state)
    back_m = _ahead_m(agent)
    return xosc.WorldPosition(
        x_m - back_m * math.cos(heading_rad), y_m - back_m * math.sin(heading_rad), h=heading_rad
    )


def _init(xosc: Any, everyone: Sequence[Movement]) -> Any:
    """Yield everybody's place and speed at t0; agents that come later are not there yet."""
    init = xosc.Init()
    now = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0.0)
    for participant in everyone:
        if writing.appears_later(participant):
            continue
        name, state = participant.agent.id, participant.states[0]
        init.add_init_action(name, xosc.TeleportAction(_position(xosc, participant.agent, state)))
        if participant.agent.type not in _THINGS:
            init.add_init_action(name, xosc.AbsoluteSpeedAction(float(state[3]), now))
    return init


def _events(xosc: Any, cell: writing.Cell, movement: Movement) -> Iterator[Any]:
    """Yield an agent's events: come, follow a trajectory, go. Nothing if it stands throughout."""
    agent, times_s = movement.agent, cell.motion.times_s
    if (mover := _with_motion(movement)) is not None:
        yield from _own_events(xosc, cell, movement, mover)
        return
    if movement.stands:
        return
    seen = np.flatnonzero(movement.is_present)
    first, last = int(seen[0]), int(seen[-1])
    if first > 0:
        action = xosc.AddEntityAction(agent.id, _position(xosc, agent, movement.states[first]))
        yield _event(xosc, f"{agent.id} comes", action, float(times_s[first]))
    if len(seen) > 1:
        action = _follow(xosc, agent, times_s[seen], movement.states[seen], is_relative=False)
        yield _event(xosc, f"{agent.id} goes on", action, float(times_s[first]))
    if last < len(times_s) - 1:
        action = xosc.DeleteEntityAction(agent.id)
        yield _event(xosc, f"{agent.id} is gone", action, float(times_s[last + 1]))


def _own_events(
    xosc: Any, cell: writing.Cell, movement: Movement, agent: TrafficAgent
) -> Iterator[Any]:
    """Yield the events before and after its motion starts; past the map it is gone."""
    started_s, times_s = movement.started_s, cell.motion.times_s
    if agent.speed_mps > 0.0 and started_s != 0.0:
        states = _list_unstarted_states(cell, agent)
        follow = _follow(xosc, agent, times_s, states, is_relative=False)
        yield from _until_gone(
            xosc, agent, states, _event(xosc, f"{agent.id} goes on", follow, 0.0)
        )
    by_clock = isinstance(_motion_in(agent).start, AtTime)
    if started_s is None and (by_clock or agent.speed_mps > 0.0):
        return  # after the end; or where its path begins would depend on the ego
    start_s = started_s or 0.0
    setting_out = replace(agent, motion=replace(_motion_in(agent), start=AtTime(after_s=start_s)))
    states = carry_out(setting_out, LaneGraph(cell.after), (start_s + times_s).tolist())
    if np.isnan(states).all():
        return  # it has left the map by then
    since_s = times_s + start_s if by_clock else times_s
    follow = _follow(xosc, agent, since_s, states, is_relative=not by_clock)
    begins = _trigger(xosc, cell, agent, started_s)
    event = _event(xosc, f"{agent.id} sets out", follow, begins, xosc.Priority.override)
    yield from _until_gone(xosc, agent, states, event)


def _until_gone(xosc: Any, agent: TrafficAgent, states: FloatArray, event: Any) -> Iterator[Any]:
    """An event of following states; whom they lead past the map is taken away at their end."""
    yield event
    if np.isnan(states).any():
        ended = xosc.StoryboardElementStateCondition(
            xosc.StoryboardElementType.event, event.name, xosc.StoryboardElementState.endTransition
        )
        name = f"{event.name} and is gone"
        trigger = xosc.ValueTrigger(f"{name} end", 0.0, xosc.ConditionEdge.none, ended)
        yield _event(xosc, name, xosc.DeleteEntityAction(agent.id), trigger)


def _trigger(xosc: Any, cell: writing.Cell, agent: TrafficAgent, started_s: float | None) -> Any:
    """The moment at which a motion starts."""
    start, name = _motion_in(agent).start, f"{agent.id} sets out"
    if isinstance(start, AtTime):
        return _at(xosc, name, start.after_s)
    apart = _measure_distance(cell, agent, start, started_s)
    arguments = apart.within_m, xosc.Rule.lessOrEqual
    kind = xosc.RelativeDistanceType.euclidianDistance
    condition = xosc.RelativeDistanceCondition(*arguments, kind, EGO_ID, freespace=False)
    if apart.place_m is not None:
        place = xosc.WorldPosition(*apart.place_m)
        condition = xosc.DistanceCondition(*arguments, place, freespace=False, distance_type=kind)
    edge = xosc.ConditionEdge.none
    return xosc.EntityTrigger(f"{name} trigger", 0.0, edge, condition, apart.who)


def _follow(
    xosc: Any, agent: TrafficAgent, times_s: FloatArray, states: FloatArray, *, is_relative: bool
) -> Any:
    trajectory = xosc.Trajectory(f"{agent.id} trajectory", False)
    seen = np.flatnonzero(~np.isnan(states).any(axis=1))
    places = np.append(seen, seen[-1:]) if len(seen) == 1 else seen  # a line has two points
    positions = [_position(xosc, agent, state) for state in states[places]]
    moments = [round(float(time_s), 6) for time_s in times_s[seen[0] : seen[0] + len(places)]]
    trajectory.add_shape(xosc.Polyline(moments, positions))
    domain = xosc.ReferenceContext.relative if is_relative else xosc.ReferenceContext.absolute
    return xosc.FollowTrajectoryAction(trajectory, xosc.FollowingMode.position, domain, 1, 0)


def _event(xosc: Any, name: str, action: Any, begins: Any, priority: Any = None) -> Any:
    """An event that begins at a time or by a trigger."""
    event = xosc.Event(name, priority or xosc.Priority.parallel)
    event.add_trigger(_at(xosc, name, begins) if isinstance(begins, float) else begins)
    event.add_action(f"{name} action", action)
    return event


def _at(xosc: Any, name: str, at_s: float) -> Any:
    return xosc.ValueTrigger(
        f"{name} time",
        0.0,
        xosc.ConditionEdge.none,
        xosc.SimulationTimeCondition(round(at_s, 6), xosc.Rule.greaterOrEqual),
        "stop" if name == "end" else "start",
    )


def _report_start(
    cell: writing.Cell, report: writing.LossReport, movement: Movement, agent: TrafficAgent
) -> None:
    """Say what of a motion's start holds with our ego alone."""
    start, started_s = _motion_in(agent).start, movement.started_s
    if agent.type in _THINGS:
        report.lose(f"{agent.id}: moves, and players may leave obstacles standing")
    if isinstance(start, AtTime):
        return
    if agent.speed_mps > 0.0 and started_s is None:
        text = "the motion is left out: where it begins hangs on when it starts, and it never does"
        report.lose(f"{agent.id}: {text}", changes_scene=True)
        return
    apart = _measure_distance(cell, agent, start, started_s)
    text = "its distance is told between rear axles: the same moment with our ego, else up to"
    report.lose(f"{agent.id}: {text} {apart.off_m:.1f} m off")
    if apart.early_s > 0.0:
        report.lose(f"{agent.id}: sets out {apart.early_s:.1f} s too early", changes_scene=True)
    if agent.speed_mps > 0.0:
        report.lose(f"{agent.id}: sets out from where it is with our ego; with others it jumps")


def _report(cell: writing.Cell, report: writing.LossReport) -> None:
    writing.report_motion(cell, report, can_trigger=True)
    for participant in cell.motion.others:
        if (agent := _with_motion(participant)) is not None:
            _report_start(cell, report, participant, agent)
    names = [other.agent.id for other in cell.motion.others if writing.has_gaps(other)]
    report.lose_of(names, "goes and comes back; goes straight on in between")
    obstacles = [kind for kind, name in _THINGS.items() if name == "obstacle"]
    report.lose_types({kind: f"a {kind} becomes an obstacle" for kind in obstacles})
    report.lose("heights, masses and axles are not known; usual ones are written")


# When a motion starts, and where it leads from then on


@dataclass(frozen=True, slots=True, kw_only=True)
class _WrittenDistance:
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


def _with_motion(movement: Movement) -> TrafficAgent | None:
    """Return the agent with its motion, None without; a walk starts once the ego is near."""
    agent = movement.agent
    if movement.source is MotionSource.RECORDED:
        return None
    goes_nowhere = agent.walk_to_m and math.dist((agent.x_m, agent.y_m), agent.walk_to_m) < 1e-6
    moving = walk_as_motion(agent)
    return None if goes_nowhere or moving.motion is None else moving


def _motion_in(agent: TrafficAgent) -> PlannedMotion:
    """Return the motion of an agent that has one."""
    assert agent.motion is not None
    return agent.motion


def _list_unstarted_states(cell: writing.Cell, agent: TrafficAgent) -> FloatArray:
    """Return states (T, 4) of an agent whose motion never starts; NaN past the map."""
    alone = replace(cell.after, agents=(replace(agent, motion=None),))
    recording = cell.recording and cell.recording.without({agent.id})
    return find_motion(alone, recording=recording).others[0].states


def _measure_distance(
    cell: writing.Cell, agent: TrafficAgent, start: NearEgo | AtPlace, started_s: float | None
) -> _WrittenDistance:
    """Return the distance by which a motion starts, which in the cell it does then or never."""
    moves = {move.agent.id: move for move in (cell.motion.ego, *cell.motion.others)}
    waits_for_ego = isinstance(start, NearEgo)
    watched = moves[EGO_ID if isinstance(start, NearEgo) else start.agent_id]
    back_m = _ahead_m(watched.agent)
    centres, axles = watched.states[:, :2], place_beside(watched.states, -back_m, 0.0)
    if isinstance(start, NearEgo):
        # Once it starts it looks along its path, so what counts is how it stood before.
        own = _list_unstarted_states(cell, agent)
        goals, marks = own[:, :2], place_beside(own, -_ahead_m(agent), 0.0)
        off_m = back_m + _ahead_m(agent)
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
    return _WrittenDistance(
        who=agent.id if waits_for_ego else watched.agent.id,
        within_m=within_m + _MARGIN_M,
        place_m=None if waits_for_ego else (float(marks[0, 0]), float(marks[0, 1])),
        off_m=off_m,
        early_s=early * STEP_S,
    )
