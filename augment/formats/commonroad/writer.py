"""Scenarios as CommonRoad XML 2020a: what stands in the file, in its order.

Frame: the ego frame of t0. Sources: the published schema of 2020a and its documentation.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats.commonroad.writer import Ids, add, number, text_of, write_lanes
from augment.formats.writing import (
    CannotExpress,
    Cell,
    LossReport,
    Written,
    appears_later,
    has_gaps,
    report_motion,
    write_each,
)
from augment.scene.entities import AgentType, TrafficAgent, TrafficSide
from augment.scene.motion import FloatArray, Movement

VERSION: Final = "2020a"
GOAL_RADIUS_M: Final = 2.0
MOVES_M: Final = 1.0

_STATIC = {
    AgentType.TRAFFIC_CONE: "constructionZone",
    AgentType.CONSTRUCTION_SIGN: "constructionZone",
    AgentType.BARRIER: "roadBoundary",
    AgentType.GENERIC_OBJECT: "unknown",
}
_DYNAMIC = {
    AgentType.VEHICLE: "car",
    AgentType.BUS: "bus",
    AgentType.BICYCLE: "bicycle",
    AgentType.PEDESTRIAN: "pedestrian",
}


def write(cells: Sequence[Cell]) -> Written:
    """One XML file for each cell."""
    return write_each(cells, _write_one)


# Private


def _write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
    scene = cell.after
    if not (scene.lanes or scene.connectors):
        raise CannotExpress("CommonRoad needs at least one lane, and this scene has none")
    root = ET.Element(
        "commonRoad",
        timeStepSize=number(cell.motion.step_s),
        commonRoadVersion=VERSION,
        author="Scenario Arena",
        affiliation="",
        source=scene.provenance,
        benchmarkID=f"ZAM_{_word(cell.stem)}-1_1_T-1",
        date=cell.made_on.isoformat(),
    )
    _add_location(root, cell)
    add(root, "scenarioTags")
    ids = Ids()
    write_lanes(root, cell, ids, report)
    statics = [other for other in cell.motion.others if _is_static(other)]
    for static in statics:
        _add_static(root, static, ids, report)
    for other in cell.motion.others:
        if other not in statics:
            _add_dynamic(root, other, ids, report)
    _add_problem(root, cell, ids)
    _report(cell, report)
    ET.indent(root)
    names = ", ".join(f"{name} is {number}" for name, number in ids.by_name.items())
    return {f"{cell.stem}.xml": text_of(root, comment=f"Our names and the ids here: {names}")}


def _word(stem: str) -> str:
    """A map's name in a benchmark id has letters and digits alone."""
    return "".join(part.capitalize() for part in stem.split("-") if part.isascii()) or "Scene"


def _add_location(root: ET.Element, cell: Cell) -> None:
    pose = cell.after.origin.pose
    location = add(root, "location")
    add(location, "geoNameId", "-999")
    add(location, "gpsLatitude", "999")
    add(location, "gpsLongitude", "999")
    transformation = add(location, "geoTransformation")
    add(transformation, "geoReference", cell.after.origin.frame)
    more = add(transformation, "additionalTransformation")
    add(more, "xTranslation", number(pose.x_m))
    add(more, "yTranslation", number(pose.y_m))
    add(more, "zRotation", number(pose.heading_rad))
    add(more, "scaling", "1.0")


def _is_static(movement: Movement) -> bool:
    """What never moves; people, buses and bicycles that stand keep their types as dynamic ones."""
    if movement.agent.type in _STATIC:
        return True
    return movement.agent.type is AgentType.VEHICLE and movement.stands


def _moves(movement: Movement) -> bool:
    """Whether it goes a metre or more from where it is first seen."""
    seen = movement.states[movement.is_present, :2]
    return bool(np.hypot(*(seen - seen[0]).T).max() >= MOVES_M)


def _add_static(root: ET.Element, movement: Movement, ids: Ids, report: LossReport) -> None:
    agent, first = movement.agent, int(movement.is_present.argmax())
    if first > 0:
        report.lose(f"{agent.id} is first seen {first} steps after t0; it stands there from t0 on")
    obstacle = add(root, "staticObstacle", id=str(ids.of(agent.id)))
    add(obstacle, "type", _STATIC.get(agent.type, "parkedVehicle"))
    _add_box(obstacle, agent)
    _add_state(obstacle, "initialState", movement.states[first], 0, has_speed=False)


def _add_dynamic(root: ET.Element, movement: Movement, ids: Ids, report: LossReport) -> None:
    agent = movement.agent
    if appears_later(movement):
        report.lose(
            f"{agent.id} is left out: it appears after t0, and all obstacles are there from t0 on",
            changes_scene=True,
        )
        return
    if has_gaps(movement):
        report.lose(f"{agent.id} goes and comes back; it ends where it goes first")
    obstacle = add(root, "dynamicObstacle", id=str(ids.of(agent.id)))
    add(obstacle, "type", _DYNAMIC[agent.type])
    _add_box(obstacle, agent)
    _add_state(obstacle, "initialState", movement.states[0], 0)
    present = movement.is_present
    last = len(present) if present.all() else int((~present).argmax())
    trajectory = add(obstacle, "trajectory")
    for step in range(1, last):
        _add_state(trajectory, "state", movement.states[step], step)
    if last == 1:
        report.lose(f"{agent.id} was seen at t0 alone; a trajectory needs a step more, standing")
        _add_state(trajectory, "state", movement.states[0], 1)


def _add_box(obstacle: ET.Element, agent: TrafficAgent) -> None:
    rectangle = add(add(obstacle, "shape"), "rectangle")
    add(rectangle, "length", number(agent.length_m))
    add(rectangle, "width", number(agent.width_m))


def _add_state(
    parent: ET.Element, name: str, state: FloatArray, step: int, *, has_speed: bool = True
) -> ET.Element:
    made = add(parent, name)
    point = add(add(made, "position"), "point")
    add(point, "x", number(float(state[0])))
    add(point, "y", number(float(state[1])))
    add(add(made, "orientation"), "exact", number(float(state[2])))
    add(add(made, "time"), "exact", str(step))
    if has_speed:
        add(add(made, "velocity"), "exact", number(float(state[3])))
    return made


def _add_problem(root: ET.Element, cell: Cell, ids: Ids) -> None:
    """The ego: where it starts, and where its motion ends as the goal."""
    states = cell.motion.ego.states
    problem = add(root, "planningProblem", id=str(ids.of(cell.after.ego.id)))
    start = _add_state(problem, "initialState", states[0], 0)
    add(add(start, "yawRate"), "exact", "0.0")
    add(add(start, "slipAngle"), "exact", "0.0")
    goal = add(problem, "goalState")
    circle = add(add(goal, "position"), "circle")
    add(circle, "radius", number(GOAL_RADIUS_M))
    centre = add(circle, "center")
    add(centre, "x", number(float(states[-1, 0])))
    add(centre, "y", number(float(states[-1, 1])))
    time = add(goal, "time")
    add(time, "intervalStart", "0")
    add(time, "intervalEnd", str(len(states) - 1))


def _report(cell: Cell, report: LossReport) -> None:
    scene, ego = cell.after, cell.after.ego
    report_motion(cell, report)
    report.lose(
        f"of the ego's motion only start and end are written; its box of {ego.length_m:g} x "
        f"{ego.width_m:g} m is not"
    )
    report.lose("names become numbers; a comment in the file has both")
    for kind, said in (
        (AgentType.TRAFFIC_CONE, "a cone becomes a constructionZone, as barriers may be"),
        (AgentType.CONSTRUCTION_SIGN, "a sign becomes a constructionZone, as cones do"),
        (AgentType.BARRIER, "a barrier becomes a roadBoundary, which readers take for scenery"),
        (AgentType.GENERIC_OBJECT, "becomes an obstacle of unknown type"),
    ):
        names = [other.agent.id for other in cell.motion.others if other.agent.type is kind]
        report.lose_of(names, said)
    names = [agent.id for agent in scene.agents if agent.walk_to_m is not None]
    report.lose_of(names, "the walk is written as motion alone, not as its end point")
    fast = [other.agent.id for other in cell.motion.others if _is_static(other) and _moves(other)]
    report.lose_of(fast, "moves, but things of this type can only stand there", changes_scene=True)
    if scene.traffic_side is TrafficSide.LEFT:
        report.lose("that people drive on the left is not said")
