"""Scenarios as CommonRoad XML 2020a: what stands in the file, in its order.

Frame: the ego frame of t0. Sources: the published schema of 2020a and its documentation.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
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
    group_connectors,
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
    TrafficLight,
    TrafficSide,
    TurnType,
)
from augment.scene.lane_graph import AnyLane, LaneGraph
from augment.scene.motion import Movement

VERSION: Final = "2020a"
GOAL_RADIUS_M: Final = 2.0
MOVES_M: Final = 1.0
SPEED_SIGN = "274"
_SAME_M = 0.01
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
_BECOMES = {
    AgentType.TRAFFIC_CONE: "a cone becomes a constructionZone, as barriers may be",
    AgentType.CONSTRUCTION_SIGN: "a sign becomes a constructionZone, as cones do",
    AgentType.BARRIER: "a barrier becomes a roadBoundary, which readers take for scenery",
    AgentType.GENERIC_OBJECT: "becomes an obstacle of unknown type",
}
_SIDES = {
    "successorsRight": (TurnType.RIGHT,),
    "successorsStraight": (TurnType.STRAIGHT,),
    "successorsLeft": (TurnType.LEFT, TurnType.U_TURN),
}
_COLOURS = {
    TrafficLight.GREEN: "green",
    TrafficLight.YELLOW: "yellow",
    TrafficLight.RED: "red",
    TrafficLight.UNKNOWN: "inactive",
}


def write(cells: Sequence[Cell]) -> Written:
    """One XML file for each cell."""
    return write_each(cells, _write_one)


# Private


class _Ids:
    """Whole numbers from 1 on, one for each name."""

    def __init__(self) -> None:
        self.by_name: dict[str, int] = {}
        self._last = 0

    def of(self, name: str) -> str:
        """The number of that name; a new one when it is first asked for."""
        if name not in self.by_name:
            self.by_name[name] = int(self.fresh())
        return str(self.by_name[name])

    def fresh(self) -> str:
        """A number for something that has no name of ours."""
        self._last += 1
        return str(self._last)


def _add(parent: ET.Element, path: str, text: object = None, **attributes: Any) -> ET.Element:
    """Add a new child, or one below others that are new too: "time/exact"."""
    for name in path.split("/"):
        parent = ET.SubElement(parent, name)
    parent.attrib.update(attributes)
    parent.text = _number(text) if isinstance(text, float) else None if text is None else str(text)
    return parent


def _number(value: float) -> str:
    """A decimal: the schema knows no exponents."""
    text = f"{value:.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _add_point(parent: ET.Element, path: str, point: Iterable[float]) -> None:
    place = _add(parent, path)
    for name, value in zip("xy", point, strict=False):
        _add(place, name, float(value))


def _write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
    scene = cell.after
    if not (scene.lanes or scene.connectors):
        raise CannotExpress("CommonRoad needs at least one lane, and this scene has none")
    # A map's name in a benchmark id has letters and digits alone.
    words = [part.capitalize() for part in cell.stem.split("-") if part.isascii()]
    root = ET.Element(
        "commonRoad",
        timeStepSize=_number(cell.motion.step_s),
        commonRoadVersion=VERSION,
        author="Scenario Arena",
        affiliation="",
        source=scene.provenance,
        benchmarkID=f"ZAM_{''.join(words) or 'Scene'}-1_1_T-1",
        date=cell.made_on.isoformat(),
    )
    _add_location(root, scene)
    _add(root, "scenarioTags")
    ids = _Ids()
    _write_map(root, cell, ids, report)
    for movement in sorted(cell.motion.others, key=lambda one: not _is_static(one)):
        _add_obstacle(root, movement, ids, report)
    _add_problem(root, cell, ids)
    _report(cell, report)
    ET.indent(root)
    names = ", ".join(f"{name} is {number}" for name, number in ids.by_name.items())
    comment = escape_controls(f"Our names and the ids here: {names}").replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    text = f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- {comment} -->\n{body}\n"
    return {f"{cell.stem}.xml": text.encode()}


def _add_location(root: ET.Element, scene: Scene) -> None:
    location, pose = _add(root, "location"), scene.origin.pose
    _add(location, "geoNameId", "-999")
    _add(location, "gpsLatitude", "999")
    _add(location, "gpsLongitude", "999")
    transformation = _add(location, "geoTransformation")
    _add(transformation, "geoReference", scene.origin.frame)
    more = _add(transformation, "additionalTransformation")
    _add(more, "xTranslation", pose.x_m)
    _add(more, "yTranslation", pose.y_m)
    _add(more, "zRotation", pose.heading_rad)
    _add(more, "scaling", 1.0)


# The map: lanelets, then traffic signs, lights and intersections, as the schema orders them


def _write_map(root: ET.Element, cell: Cell, ids: _Ids, report: LossReport) -> None:
    scene = cell.after
    graph = LaneGraph(scene)
    ways: list[AnyLane] = [*scene.lanes, *scene.connectors]
    for way in ways:
        ids.of(way.id)
    limits = sorted({way.speed_limit_mps for way in ways if way.speed_limit_mps is not None})
    signs = {limit: ids.fresh() for limit in limits}
    lit = [one for one in scene.connectors if one.traffic_light is not TrafficLight.NONE]
    lights = {connector.id: ids.fresh() for connector in lit}
    off_m, apart_m = {}, {}
    for way in ways:
        left, right = _paired_bounds(way)
        lanelet = _add_lanelet(root, ids.of(way.id), left, right)
        _add_joints(lanelet, way, graph, ids)
        _add(lanelet, "laneletType", "intersection" if isinstance(way, LaneConnector) else "urban")
        _add(lanelet, "userOneWay", "vehicle")
        if way.speed_limit_mps is not None:
            _add(lanelet, "trafficSignRef", ref=signs[way.speed_limit_mps])
        if way.id in lights:
            _add(lanelet, "trafficLightRef", ref=lights[way.id])
        off_m[way.id] = _off_middle_m(way.centerline, (left + right) / 2.0)
        apart_m[way.id] = abs(width_between(way.centerline, *bounds_of(way)) - way.width_m)
    for distances, text in (
        (off_m, "centrelines that are off the middle of the edges, which alone go out"),
        (apart_m, "widths that are not the distance of the edges, which alone go out"),
    ):
        far = [f"{name} by {away:.2f} m" for name, away in distances.items() if away > _SAME_M]
        if far:
            report.lose(f"{text}: {', '.join(far)}")
    quads = [one for one in scene.areas if one.kind is AreaKind.CROSSWALK]
    quads = [one for one in quads if len(one.boundary_m) == 4]
    for area in quads:
        lanelet = _add_lanelet(root, ids.of(area.id), *_crosswalk_bounds(area))
        _add(lanelet, "laneletType", "crosswalk")
        _add(lanelet, "userBidirectional", "pedestrian")
    for limit, sign in signs.items():
        made = _add(root, "trafficSign", id=sign)
        element = _add(made, "trafficSignElement")
        _add(element, "trafficSignID", SPEED_SIGN)
        _add(element, "additionalValue", float(limit))
        _add(made, "virtual", "true")
    for connector in lit:  # the state of t0 for as long as the scenario goes on
        made = _add(root, "trafficLight", id=lights[connector.id])
        element = _add(made, "cycle/cycleElement")
        _add(element, "duration", len(cell.motion.times_s))
        _add(element, "color", _COLOURS[connector.traffic_light])
        _add_point(made, "position/point", connector.centerline.points_m[0])
    _add_intersections(root, scene, ids)
    _report_map(scene, quads, report)


def _add_lanelet(root: ET.Element, number: str, left: FloatArray, right: FloatArray) -> ET.Element:
    lanelet = _add(root, "lanelet", id=number)
    for name, points in (("leftBound", left), ("rightBound", right)):
        bound = _add(lanelet, name)
        for point in points:
            _add_point(bound, "point", point)
    return lanelet


def _add_joints(lanelet: ET.Element, way: AnyLane, graph: LaneGraph, ids: _Ids) -> None:
    for name in graph.predecessors(way.id):
        _add(lanelet, "predecessor", ref=ids.of(name))
    for name in graph.successors(way.id):
        _add(lanelet, "successor", ref=ids.of(name))
    if isinstance(way, Lane):
        beside = {"adjacentLeft": way.left_neighbor, "adjacentRight": way.right_neighbor}
        for side, neighbor in beside.items():
            if neighbor is not None:
                _add(lanelet, side, ref=ids.of(neighbor), drivingDir="same")


def _paired_bounds(way: AnyLane) -> tuple[FloatArray, FloatArray]:
    """Both edges with equally many points, opposite to each other; no point of either is lost."""
    left, right = bounds_of(way)
    if len(left.points_m) == len(right.points_m):
        off_m = _off_middle_m(way.centerline, (left.points_m + right.points_m) / 2.0)
        if off_m <= _SAME_M or not (way.left_boundary or way.right_boundary):
            return left.points_m, right.points_m
    lines = (left, right, way.centerline)
    shares = np.concatenate([line.stations_m / line.length_m for line in lines]).round(9)
    left_m, right_m = (side.points_at(np.unique(shares) * side.length_m) for side in (left, right))
    return left_m, right_m


def _off_middle_m(centerline: Polyline, middle: FloatArray) -> float:
    return max(centerline.project(float(x), float(y)).distance_m for x, y in middle)


def _crosswalk_bounds(area: Area) -> tuple[FloatArray, FloatArray]:
    """The two longer edges, in one direction."""
    a, b, c, d = np.array(area.boundary_m)
    first, second = np.array([a, b]), np.array([d, c])
    if np.hypot(*(b - a)) + np.hypot(*(d - c)) < np.hypot(*(c - b)) + np.hypot(*(a - d)):
        first, second = np.array([b, c]), np.array([a, d])
    along, across = first[1] - first[0], second[0] - first[0]
    is_left = along[0] * across[1] - along[1] * across[0] < 0.0
    return (first, second) if is_left else (second, first)


def _add_intersections(root: ET.Element, scene: Scene, ids: _Ids) -> None:
    """Connectors that share a lane at either end belong to one intersection."""
    entered = [connector for connector in scene.connectors if connector.from_lane is not None]
    for group in group_connectors(entered):
        by_lane: dict[str, list[LaneConnector]] = defaultdict(list)
        for connector in group:
            by_lane[str(connector.from_lane)].append(connector)
        intersection = _add(root, "intersection", id=ids.fresh())
        for lane, connectors in by_lane.items():
            incoming = _add(intersection, "incoming", id=ids.fresh())
            _add(incoming, "incomingLanelet", ref=ids.of(lane))
            for side, turns in _SIDES.items():
                for connector in connectors:
                    if connector.turn_type in turns:
                        _add(incoming, side, ref=ids.of(connector.id))


def _report_map(scene: Scene, quads: Sequence[Area], report: LossReport) -> None:
    for kind in AreaKind:
        names = [one.id for one in scene.areas if one.kind is kind and one not in quads]
        report.lose_of(names, f"left out: a {kind} area of this shape can't be a lanelet")
    connectors = scene.connectors
    names = [one.id for one in connectors if one.turn_type is TurnType.U_TURN]
    report.lose_of(names, "a U-turn becomes a turn to the left")
    names = [one.id for one in connectors if one.from_lane is None]
    report.lose_of(names, "its turn type is not said: no lane leads into it")
    names = [one.id for one in connectors if one.traffic_light is TrafficLight.UNKNOWN]
    report.lose_of(names, "a light of unknown state becomes one that is off")
    if any(one.traffic_light is not TrafficLight.NONE for one in connectors):
        report.lose("lights stay as they are at t0; how they go on is not known")


# Obstacles and the planning problem


def _is_static(movement: Movement) -> bool:
    """What never moves; people, buses and bicycles that stand keep their types as dynamic ones."""
    kind = movement.agent.type
    return kind in _STATIC or (kind is AgentType.VEHICLE and movement.stands)


def _add_obstacle(root: ET.Element, movement: Movement, ids: _Ids, report: LossReport) -> None:
    agent, present, states = movement.agent, movement.is_present, movement.states
    is_static, first = _is_static(movement), int(movement.is_present.argmax())
    if is_static and first > 0:
        report.lose(f"{agent.id} is first seen {first} steps after t0; it stands there from t0 on")
    elif appears_later(movement):
        text = "is left out: it appears after t0, and all obstacles are there from t0 on"
        report.lose(f"{agent.id} {text}", changes_scene=True)
        return
    kind = _STATIC.get(agent.type, "parkedVehicle") if is_static else _DYNAMIC[agent.type]
    tag = "staticObstacle" if is_static else "dynamicObstacle"
    obstacle = _add(root, tag, id=ids.of(agent.id))
    _add(obstacle, "type", kind)
    box = _add(obstacle, "shape/rectangle")
    _add(box, "length", float(agent.length_m))
    _add(box, "width", float(agent.width_m))
    _add_state(obstacle, "initialState", states[first], 0, has_speed=not is_static)
    if is_static:
        return
    if has_gaps(movement):
        report.lose(f"{agent.id} goes and comes back; it ends where it goes first")
    last = len(present) if present.all() else int((~present).argmax())
    trajectory = _add(obstacle, "trajectory")
    for step in range(1, last):
        _add_state(trajectory, "state", states[step], step)
    if last == 1:
        report.lose(f"{agent.id} was seen at t0 alone; a trajectory needs a step more, standing")
        _add_state(trajectory, "state", states[0], 1)


def _add_state(
    parent: ET.Element, name: str, state: FloatArray, step: int, *, has_speed: bool = True
) -> ET.Element:
    made = _add(parent, name)
    _add_point(made, "position/point", state)
    _add(made, "orientation/exact", float(state[2]))
    _add(made, "time/exact", step)
    if has_speed:
        _add(made, "velocity/exact", float(state[3]))
    return made


def _add_problem(root: ET.Element, cell: Cell, ids: _Ids) -> None:
    """The ego: where it starts, and where its motion ends as the goal."""
    states = cell.motion.ego.states
    problem = _add(root, "planningProblem", id=ids.of(cell.after.ego.id))
    start = _add_state(problem, "initialState", states[0], 0)
    _add(start, "yawRate/exact", 0.0)
    _add(start, "slipAngle/exact", 0.0)
    goal = _add(problem, "goalState")
    circle = _add(goal, "position/circle")
    _add(circle, "radius", GOAL_RADIUS_M)
    _add_point(circle, "center", states[-1])
    time = _add(goal, "time")
    _add(time, "intervalStart", 0)
    _add(time, "intervalEnd", len(states) - 1)


def _report(cell: Cell, report: LossReport) -> None:
    scene, ego = cell.after, cell.after.ego
    report_motion(cell, report)
    report.lose(
        f"of the ego's motion only start and end are written; its box of {ego.length_m:g} x "
        f"{ego.width_m:g} m is not"
    )
    report.lose("names become numbers; a comment in the file has both")
    for kind, text in _BECOMES.items():
        names = [other.agent.id for other in cell.motion.others if other.agent.type is kind]
        report.lose_of(names, text)
    names = [agent.id for agent in scene.agents if agent.walk_to_m is not None]
    report.lose_of(names, "the walk is written as motion alone, not as its end point")
    moving = []
    for other in filter(_is_static, cell.motion.others):
        seen = other.states[other.is_present, :2]
        if np.hypot(*(seen - seen[0]).T).max() >= MOVES_M:
            moving.append(other.agent.id)
    text = "moves, but things of this type can only stand there"
    report.lose_of(moving, text, changes_scene=True)
    if scene.traffic_side is TrafficSide.LEFT:
        report.lose("that people drive on the left is not said")
