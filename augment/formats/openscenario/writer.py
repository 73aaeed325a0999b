"""Scenarios as OpenSCENARIO XML 1.2, each with its map as OpenDRIVE.

Everybody that moves follows a trajectory with times; people with a walk set out when the ego comes
near. Frame: the ego frame of t0. The files are made by scenariogeneration. Source: ASAM
OpenSCENARIO XML 1.2.
"""

import math
from collections.abc import Sequence
from datetime import UTC, datetime, time
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats.openscenario.roads import map_of
from augment.formats.writing import (
    Cell,
    LossReport,
    Written,
    appears_later,
    has_gaps,
    report_motion,
    write_each,
)
from augment.scene.entities import AgentType, TrafficAgent
from augment.scene.motion import SETS_OUT_WITHIN_M, FloatArray, Movement, walking_pace_mps

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
_USUAL_HEIGHT_M, _MASS_KG, _FASTEST_MPS = 1.8, 1000.0, 70.0


def write(cells: Sequence[Cell]) -> Written:
    """For each cell a scenario and its map; a map that no road can follow is refused."""
    return write_each(cells, _write_one)


# Private


def _write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
    road_file = f"{cell.stem}.xodr"
    road = map_of(cell, report)
    scenario = _scenario(cell, road_file)
    _report(cell, report)
    return {road_file: road, f"{cell.stem}.xosc": scenario}


def _scenario(cell: Cell, road_file: str) -> bytes:
    from scenariogeneration import xosc

    motion = cell.motion
    everyone = (motion.ego, *motion.others)
    entities = xosc.Entities()
    for agent in everyone:
        entities.add_scenario_object(agent.agent.id, _entity(xosc, agent.agent))
    board = xosc.StoryBoard(_init(xosc, everyone), _at(xosc, "end", float(motion.times_s[-1])))
    maneuvers = [
        (agent.agent.id, maneuver)
        for agent in everyone
        if (maneuver := _maneuver(xosc, cell, agent)) is not None
    ]
    for name, maneuver in maneuvers:
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
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, 'unicode')}\n".encode()


def _entity(xosc: Any, agent: TrafficAgent) -> Any:
    height_m = _HEIGHT_M.get(agent.type, _USUAL_HEIGHT_M)
    box = xosc.BoundingBox(
        agent.width_m, agent.length_m, height_m, _ahead_m(agent), 0.0, height_m / 2.0
    )
    if agent.type in _VEHICLES:
        base_m = 2.0 * _ahead_m(agent)
        return xosc.Vehicle(
            agent.id,
            getattr(xosc.VehicleCategory, _VEHICLES[agent.type]),
            box,
            xosc.Axle(0.5, 0.6, agent.width_m, base_m, 0.3),
            xosc.Axle(0.0, 0.6, agent.width_m, 0.0, 0.3),
            _FASTEST_MPS,
            10.0,
            10.0,
            mass=_MASS_KG,
        )
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
    """Where and how fast everybody is at t0; who comes later is not there yet."""
    init = xosc.Init()
    now = xosc.TransitionDynamics(xosc.DynamicsShapes.step, xosc.DynamicsDimension.time, 0.0)
    for agent in everyone:
        if appears_later(agent):
            continue
        name, state = agent.agent.id, agent.states[0]
        init.add_init_action(name, xosc.TeleportAction(_position(xosc, agent.agent, state)))
        if agent.agent.type not in _THINGS:
            init.add_init_action(name, xosc.AbsoluteSpeedAction(float(state[3]), now))
    return init


def _maneuver(xosc: Any, cell: Cell, movement: Movement) -> Any | None:
    """What somebody does: come, follow a trajectory, go. None for who stands throughout."""
    agent, present = movement.agent, movement.is_present
    waits = agent.walk_to_m is not None
    walk = _walk(agent) if waits else None
    if movement.stands and walk is None:
        return None
    maneuver = xosc.Maneuver(f"{agent.id} maneuver")
    seen = np.flatnonzero(present)
    times_s = cell.motion.times_s
    if appears_later(movement):
        first = movement.states[seen[0]]
        action = xosc.AddEntityAction(agent.id, _position(xosc, agent, first))
        maneuver.add_event(_event(xosc, f"{agent.id} comes", action, float(times_s[seen[0]])))
    if walk is not None:
        maneuver.add_event(_walk_event(xosc, cell, agent, *walk))
        return maneuver
    rows = seen[np.isfinite(times_s[seen])]
    if len(rows) > 1:
        action = _follow(xosc, agent, times_s[rows], movement.states[rows], is_relative=False)
        maneuver.add_event(_event(xosc, f"{agent.id} goes on", action, float(times_s[rows[0]])))
    if rows[-1] < len(times_s) - 1:
        gone_s = float(times_s[rows[-1] + 1])
        action = xosc.DeleteEntityAction(agent.id)
        maneuver.add_event(_event(xosc, f"{agent.id} is gone", action, gone_s))
    return maneuver


def _walk(agent: TrafficAgent) -> tuple[FloatArray, FloatArray] | None:
    """Times from setting out on and states at the two ends; None for a walk of no length."""
    assert agent.walk_to_m is not None
    way = np.array(agent.walk_to_m) - (agent.x_m, agent.y_m)
    length_m = float(np.hypot(*way))
    pace_mps = walking_pace_mps(agent)
    if length_m < 1e-6 or pace_mps <= 0.0:
        return None
    heading_rad = math.atan2(way[1], way[0])
    ends = [(agent.x_m, agent.y_m), agent.walk_to_m]
    states = np.array([(x, y, heading_rad, pace_mps) for x, y in ends], dtype=np.float64)
    return np.array([0.0, length_m / pace_mps]), states


def _walk_event(
    xosc: Any, cell: Cell, agent: TrafficAgent, times_s: FloatArray, states: FloatArray
) -> Any:
    near = xosc.EntityTrigger(
        f"{agent.id} sees the ego",
        0.0,
        xosc.ConditionEdge.none,
        xosc.RelativeDistanceCondition(
            SETS_OUT_WITHIN_M,
            xosc.Rule.lessThan,
            xosc.RelativeDistanceType.euclidianDistance,
            cell.after.ego.id,
            freespace=False,
        ),
        agent.id,
    )
    event = xosc.Event(f"{agent.id} walks", xosc.Priority.parallel)
    event.add_trigger(near)
    action = _follow(xosc, agent, times_s, states, is_relative=True)
    event.add_action(f"{agent.id} walks action", action)
    return event


def _follow(
    xosc: Any, agent: TrafficAgent, times_s: FloatArray, states: FloatArray, *, is_relative: bool
) -> Any:
    trajectory = xosc.Trajectory(f"{agent.id} trajectory", False)
    positions = [_position(xosc, agent, state) for state in states]
    trajectory.add_shape(xosc.Polyline([round(float(t), 6) for t in times_s], positions))
    domain = xosc.ReferenceContext.relative if is_relative else xosc.ReferenceContext.absolute
    return xosc.FollowTrajectoryAction(trajectory, xosc.FollowingMode.position, domain, 1, 0)


def _event(xosc: Any, name: str, action: Any, at_s: float) -> Any:
    event = xosc.Event(name, xosc.Priority.parallel)
    event.add_trigger(_at(xosc, name, at_s))
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


def _report(cell: Cell, report: LossReport) -> None:
    report_motion(cell, report, can_trigger=True)
    names = [other.agent.id for other in cell.motion.others if has_gaps(other)]
    report.lose_of(names, "goes and comes back; goes straight on in between")
    for kind in (AgentType.TRAFFIC_CONE, AgentType.CONSTRUCTION_SIGN, AgentType.GENERIC_OBJECT):
        names = [other.agent.id for other in cell.motion.others if other.agent.type is kind]
        report.lose_of(names, f"a {kind} becomes an obstacle")
    report.lose("heights, masses and axles are not known; usual ones are written")
