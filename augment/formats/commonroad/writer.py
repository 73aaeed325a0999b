"""Scenarios as CommonRoad XML 2020a: what stands in the file, in its order.

Frame: the ego frame of t0. Sources: the published schema of 2020a and its documentation.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.escaping import escape_controls
from augment.formats.roads import width_between
from augment.formats.writing import (
    CannotExpress,
    Cell,
    LossReport,
    Written,
    appears_later,
    bounds_of,
    has_gaps,
    report_motion,
    write_each,
)
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.entities import (
    AgentType,
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    Scene,
    TrafficAgent,
    TrafficLight,
    TrafficSide,
    TurnType,
)
from augment.scene.lane_graph import AnyLane, LaneGraph
from augment.scene.motion import Movement

DECIMALS = 9


class Ids:
    """Whole numbers from 1 on, one for each name."""

    def __init__(self) -> None:
        self.by_name: dict[str, int] = {}
        self._last = 0

    def of(self, name: str) -> int:
        """The number of that name; a new one when it is first asked for."""
        if name not in self.by_name:
            self.by_name[name] = self.fresh()
        return self.by_name[name]

    def fresh(self) -> int:
        """A number for something that has no name of ours."""
        self._last += 1
        return self._last


def add(parent: ET.Element, name: str, text: str | None = None, **attributes: Any) -> ET.Element:
    """A new child at the end."""
    made = ET.SubElement(parent, name, attributes)
    made.text = text
    return made


def number(value: float) -> str:
    """A decimal: the schema knows no exponents."""
    text = f"{value:.{DECIMALS}f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def text_of(root: ET.Element, *, comment: str) -> bytes:
    """The whole file."""
    safe = escape_controls(comment).replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    return f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- {safe} -->\n{body}\n".encode()


SPEED_SIGN = "274"
_SAME_M = 0.01
_SIDES = {
    TurnType.RIGHT: "successorsRight",
    TurnType.STRAIGHT: "successorsStraight",
    TurnType.LEFT: "successorsLeft",
    TurnType.U_TURN: "successorsLeft",
}
_SIDE_ORDER = ("successorsRight", "successorsStraight", "successorsLeft")
_COLOURS = {
    TrafficLight.GREEN: "green",
    TrafficLight.YELLOW: "yellow",
    TrafficLight.RED: "red",
    TrafficLight.UNKNOWN: "inactive",
}


def write_lanes(root: ET.Element, cell: Cell, ids: Ids, report: LossReport) -> None:
    """Lanelets, then traffic signs, lights and intersections, as the schema orders them."""
    scene = cell.after
    graph = LaneGraph(scene)
    ways: list[AnyLane] = [*scene.lanes, *scene.connectors]
    for way in ways:
        ids.of(way.id)
    signs = {
        limit: ids.fresh()
        for limit in sorted({w.speed_limit_mps for w in ways if w.speed_limit_mps is not None})
    }
    lights = {
        connector.id: ids.fresh()
        for connector in scene.connectors
        if connector.traffic_light is not TrafficLight.NONE
    }
    off = {}
    for way in ways:
        off[way.id] = _add_lanelet(root, way, graph, ids)
        _add_marks(root[-1], way, signs, lights)
    _report_off(off, report)
    _report_widths(ways, report)
    crossings = [area for area in scene.areas if _is_quad(area)]
    for area in crossings:
        _add_crosswalk(root, area, ids)
    for limit, sign in signs.items():
        _add_sign(root, limit, sign)
    for connector in scene.connectors:
        if connector.id in lights:
            _add_light(root, connector, lights[connector.id], steps=len(cell.motion.times_s))
    _add_intersections(root, scene, ids)
    _report(scene, crossings, report)


# Private


def _add_lanelet(root: ET.Element, way: AnyLane, graph: LaneGraph, ids: Ids) -> float:
    """Returns how far the centreline is from the middle of the edges, in metres."""
    left, right = _paired_bounds(way)
    lanelet = add(root, "lanelet", id=str(ids.of(way.id)))
    for name, points in (("leftBound", left), ("rightBound", right)):
        bound = add(lanelet, name)
        for x_m, y_m in points:
            _add_point(bound, "point", float(x_m), float(y_m))
    for name in graph.predecessors(way.id):
        add(lanelet, "predecessor", ref=str(ids.of(name)))
    for name in graph.successors(way.id):
        add(lanelet, "successor", ref=str(ids.of(name)))
    if isinstance(way, Lane):
        if way.left_neighbor is not None:
            add(lanelet, "adjacentLeft", ref=str(ids.of(way.left_neighbor)), drivingDir="same")
        if way.right_neighbor is not None:
            add(lanelet, "adjacentRight", ref=str(ids.of(way.right_neighbor)), drivingDir="same")
    return _off_middle_m(way.centerline, (left + right) / 2.0)


def _report_off(off_m: dict[str, float], report: LossReport) -> None:
    far = {name: distance for name, distance in off_m.items() if distance > _SAME_M}
    if far:
        names = ", ".join(f"{name} by {distance:.2f} m" for name, distance in far.items())
        report.lose(
            f"centrelines that are off the middle of the edges, which alone go out: {names}"
        )


def _report_widths(ways: Sequence[AnyLane], report: LossReport) -> None:
    apart_m = {
        way.id: abs(width_between(way.centerline, *bounds_of(way)) - way.width_m) for way in ways
    }
    far = [f"{name} by {apart:.2f} m" for name, apart in apart_m.items() if apart > _SAME_M]
    if far:
        names = ", ".join(far)
        report.lose(f"widths that are not the distance of the edges, which alone go out: {names}")


def _add_marks(
    lanelet: ET.Element, way: AnyLane, signs: dict[float, int], lights: dict[str, int]
) -> None:
    add(lanelet, "laneletType", "intersection" if isinstance(way, LaneConnector) else "urban")
    add(lanelet, "userOneWay", "vehicle")
    if way.speed_limit_mps is not None:
        add(lanelet, "trafficSignRef", ref=str(signs[way.speed_limit_mps]))
    if way.id in lights:
        add(lanelet, "trafficLightRef", ref=str(lights[way.id]))


def _paired_bounds(way: AnyLane) -> tuple[FloatArray, FloatArray]:
    """Both edges with equally many points, opposite to each other; no point of either is lost."""
    left, right = bounds_of(way)
    if len(left.points_m) == len(right.points_m):
        middle = (left.points_m + right.points_m) / 2.0
        are_opposite = _off_middle_m(way.centerline, middle) <= _SAME_M
        if are_opposite or not (way.left_boundary or way.right_boundary):
            return left.points_m, right.points_m
    shares = np.unique(
        np.concatenate([_shares(left), _shares(right), _shares(way.centerline)]).round(9)
    )
    return _points_at(left, shares), _points_at(right, shares)


def _shares(line: Polyline) -> FloatArray:
    return line.stations_m / line.length_m


def _points_at(line: Polyline, shares: FloatArray) -> FloatArray:
    return line.points_at(shares * line.length_m)


def _off_middle_m(centerline: Polyline, middle: FloatArray) -> float:
    return max(centerline.project(float(x), float(y)).distance_m for x, y in middle)


def _add_point(parent: ET.Element, name: str, x_m: float, y_m: float) -> None:
    point = add(parent, name)
    add(point, "x", number(x_m))
    add(point, "y", number(y_m))


def _is_quad(area: Area) -> bool:
    """Whether an area is a crosswalk between two straight edges, which a lanelet can be."""
    return area.kind is AreaKind.CROSSWALK and len(area.boundary_m) == 4


def _add_crosswalk(root: ET.Element, area: Area, ids: Ids) -> None:
    """The two longer edges are the bounds, in one direction."""
    a, b, c, d = (np.array(point) for point in area.boundary_m)
    if np.hypot(*(b - a)) + np.hypot(*(d - c)) >= np.hypot(*(c - b)) + np.hypot(*(a - d)):
        first, second = (a, b), (d, c)
    else:
        first, second = (b, c), (a, d)
    along, across = first[1] - first[0], second[0] - first[0]
    is_left = along[0] * across[1] - along[1] * across[0] < 0.0
    left, right = (first, second) if is_left else (second, first)
    lanelet = add(root, "lanelet", id=str(ids.of(area.id)))
    for name, points in (("leftBound", left), ("rightBound", right)):
        bound = add(lanelet, name)
        for point in points:
            _add_point(bound, "point", float(point[0]), float(point[1]))
    add(lanelet, "laneletType", "crosswalk")
    add(lanelet, "userBidirectional", "pedestrian")


def _add_sign(root: ET.Element, limit_mps: float, sign: int) -> None:
    made = add(root, "trafficSign", id=str(sign))
    element = add(made, "trafficSignElement")
    add(element, "trafficSignID", SPEED_SIGN)
    add(element, "additionalValue", number(limit_mps))
    add(made, "virtual", "true")


def _add_light(root: ET.Element, connector: LaneConnector, light: int, *, steps: int) -> None:
    """The state of t0 for as long as the scenario goes on."""
    made = add(root, "trafficLight", id=str(light))
    element = add(add(made, "cycle"), "cycleElement")
    add(element, "duration", str(steps))
    add(element, "color", _COLOURS[connector.traffic_light])
    x_m, y_m = connector.centerline.points_m[0]
    _add_point(add(made, "position"), "point", float(x_m), float(y_m))


def _add_intersections(root: ET.Element, scene: Scene, ids: Ids) -> None:
    """Connectors that share a lane at either end belong to one intersection."""
    for group in _grouped(
        [connector for connector in scene.connectors if connector.from_lane is not None]
    ):
        by_lane: dict[str, list[LaneConnector]] = defaultdict(list)
        for one in group:
            by_lane[str(one.from_lane)].append(one)
        made = add(root, "intersection", id=str(ids.fresh()))
        for lane, connectors in by_lane.items():
            incoming = add(made, "incoming", id=str(ids.fresh()))
            add(incoming, "incomingLanelet", ref=str(ids.of(lane)))
            for side in _SIDE_ORDER:
                for connector in connectors:
                    if _SIDES[connector.turn_type] == side:
                        add(incoming, side, ref=str(ids.of(connector.id)))


def _grouped(connectors: Sequence[LaneConnector]) -> list[list[LaneConnector]]:
    groups: list[tuple[set[str], list[LaneConnector]]] = []
    for connector in connectors:
        ends = {f"from {connector.from_lane}", f"to {connector.to_lane or connector.id}"}
        joined, others = [connector], []
        for names, members in groups:
            if names & ends:
                ends |= names
                joined = [*members, *joined]
            else:
                others.append((names, members))
        groups = [*others, (ends, joined)]
    return [members for _, members in groups]


def _report(scene: Scene, crossings: Sequence[Area], report: LossReport) -> None:
    written = {area.id for area in crossings}
    for kind in AreaKind:
        names = [a.id for a in scene.areas if a.kind is kind and a.id not in written]
        report.lose_of(names, f"left out: a {kind} area of this shape can't be a lanelet")
    names = [
        connector.id for connector in scene.connectors if connector.turn_type is TurnType.U_TURN
    ]
    report.lose_of(names, "a U-turn becomes a turn to the left")
    names = [connector.id for connector in scene.connectors if connector.from_lane is None]
    report.lose_of(names, "its turn type is not said: no lane leads into it")
    names = [
        connector.id
        for connector in scene.connectors
        if connector.traffic_light is TrafficLight.UNKNOWN
    ]
    report.lose_of(names, "a light of unknown state becomes one that is off")
    if any(connector.traffic_light is not TrafficLight.NONE for connector in scene.connectors):
        report.lose("lights stay as they are at t0; how they go on is not known")


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
    _report_writer(cell, report)
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


def _report_writer(cell: Cell, report: LossReport) -> None:
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
