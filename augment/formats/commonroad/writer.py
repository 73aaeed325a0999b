"""Scenarios as CommonRoad XML 2020a: what stands in the file, in its order.

Frame: the ego frame of t0. Sources: the published schema of 2020a and its documentation.
"""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import count
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.escaping import escape_controls
from augment.formats import writing
from augment.formats.writing import Cell, LossReport
from augment.geometry.polyline import FloatArray
from augment.scene import entities
from augment.scene.entities import AgentType, AnyLane, Lane, LaneConnector, Scene, TrafficLight
from augment.scene.lane_graph import LaneGraph
from augment.scene.motion import STEP_S, MotionSource, Movement

VERSION: Final = "2020a"
GOAL_RADIUS_M: Final = 2.0
SPEED_SIGN = "274"
_SAME_M = 0.01
_MOVED_M = 0.5
"""What is recorded to stand is not seen at the same place in every step."""
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
_SIDE_OF = {
    entities.TurnType.RIGHT: "successorsRight",
    entities.TurnType.STRAIGHT: "successorsStraight",
    entities.TurnType.LEFT: "successorsLeft",
    entities.TurnType.U_TURN: "successorsLeft",
}
_NAMES = "Our names and the ids here:"
Ids = Mapping[str, int]
"""Whole numbers from 1 on, a new one for each name that is asked for."""


def write(cells: Sequence[Cell]) -> writing.Output:
    """One XML file for each cell."""
    return writing.write_each(cells, _write_one)


def names_in(text: str) -> dict[str, str]:
    """Return our names by the ids of a file that `write` made; none without its comment."""
    _, _, after = text.partition(f"<!-- {_NAMES} ")
    pairs = (pair.rpartition(" is ") for pair in after.partition(" -->")[0].split(", "))
    return {number: name for name, _, number in pairs if name}


# Private


def _tag(name: str, *parts: Any, **attributes: Any) -> ET.Element:
    """An element of its children, or around a text or number."""
    element = ET.Element(name, {key: str(value) for key, value in attributes.items()})
    for part in parts:
        if isinstance(part, ET.Element):
            element.append(part)
        else:
            element.text = _number(part) if isinstance(part, float) else str(part)
    return element


def _number(value: float) -> str:
    """A decimal: the schema knows no exponents."""
    text = f"{value:.9f}".rstrip("0")
    return f"{text}0" if text.endswith(".") else text


def _point(name: str, point: FloatArray) -> ET.Element:
    return _tag(name, _tag("x", float(point[0])), _tag("y", float(point[1])))


def _exact(name: str, value: float) -> ET.Element:
    return _tag(name, _tag("exact", value))


def _write_one(cell: Cell, report: LossReport) -> dict[str, bytes]:
    scene = cell.after
    if not scene.ways:
        raise writing.CannotExpress("CommonRoad needs at least one lane, and this scene has none")
    ids: Ids = defaultdict(count(1).__next__)
    # A map's name in a benchmark id has letters and digits alone.
    words = [part.capitalize() for part in cell.stem.split("-") if part.isascii()]
    root = _tag(
        "commonRoad",
        _tag(
            "location",
            _tag("geoNameId", -999),
            _tag("gpsLatitude", 999),
            _tag("gpsLongitude", 999),
        ),
        _tag("scenarioTags"),
        *_map(cell, ids, report),
        *_obstacles(cell, ids, report),
        _problem(cell, ids),
        timeStepSize=_number(STEP_S),
        commonRoadVersion=VERSION,
        author="Scenario Arena",
        affiliation="",
        source=scene.provenance,
        benchmarkID=f"ZAM_{''.join(words) or 'Scene'}-1_1_T-1",
        date=cell.made_on.isoformat(),
    )
    _report(cell, report)
    ET.indent(root)
    names = ", ".join(f"{name} is {number}" for name, number in ids.items())
    comment = escape_controls(f"{_NAMES} {names}").replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    text = f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- {comment} -->\n{body}\n"
    return {f"{cell.stem}.xml": text.encode()}


# The map: lanelets, then traffic signs, lights and intersections, as the schema orders them


def _map(cell: Cell, ids: Ids, report: LossReport) -> Iterator[ET.Element]:
    scene = cell.after
    graph, ways = LaneGraph(scene), scene.ways
    for way in ways:
        ids[way.id]  # lanelets have the first numbers
    for way in ways:
        bounds = zip(("leftBound", "rightBound"), _pair_bounds(way), strict=True)
        edges = [_tag(name, *(_point("point", point) for point in line)) for name, line in bounds]
        yield _tag("lanelet", *edges, *_of_way(way, graph, ids), id=ids[way.id])
    for limit in sorted({way.speed_limit_mps for way in ways if way.speed_limit_mps is not None}):
        sign = _tag("trafficSignID", SPEED_SIGN), _tag("additionalValue", float(limit))
        yield _tag(
            "trafficSign",
            _tag("trafficSignElement", *sign),
            _tag("virtual", "true"),
            id=ids[f"limit {limit}"],
        )
    for connector in scene.connectors:  # the state of t0 for as long as the scenario goes on
        if connector.traffic_light is not TrafficLight.NONE:
            duration = _tag("duration", len(cell.motion.times_s))
            is_dark = connector.traffic_light is TrafficLight.UNKNOWN
            colour = _tag("color", "inactive" if is_dark else connector.traffic_light.value)
            place = _point("point", connector.centerline.points_m[0])
            yield _tag(
                "trafficLight",
                _tag("cycle", _tag("cycleElement", duration, colour)),
                _tag("position", place),
                id=ids[f"light of {connector.id}"],
            )
    yield from _intersections(scene, ids)
    report.lose(
        "of lanes the edges alone go out: the middle and the width are what they make them"
    )
    report.lose_areas(scene.areas, "left out: a {} area is no lanelet")


def _of_way(way: AnyLane, graph: LaneGraph, ids: Ids) -> Iterator[ET.Element]:
    """Yield the children of a lanelet after its bounds."""
    for name in graph.predecessors(way.id):
        yield _tag("predecessor", ref=ids[name])
    for name in graph.successors(way.id):
        yield _tag("successor", ref=ids[name])
    if isinstance(way, Lane):
        beside = {"adjacentLeft": way.left_neighbor, "adjacentRight": way.right_neighbor}
        for side, neighbor in beside.items():
            if neighbor is not None:
                yield _tag(side, ref=ids[neighbor], drivingDir="same")
    yield _tag("laneletType", "intersection" if isinstance(way, LaneConnector) else "urban")
    yield _tag("userOneWay", "vehicle")
    if way.speed_limit_mps is not None:
        yield _tag("trafficSignRef", ref=ids[f"limit {way.speed_limit_mps}"])
    if isinstance(way, LaneConnector) and way.traffic_light is not TrafficLight.NONE:
        yield _tag("trafficLightRef", ref=ids[f"light of {way.id}"])


def _pair_bounds(way: AnyLane) -> list[FloatArray]:
    """Both edges with equally many points, opposite to each other; no point of either is lost."""
    sides = writing.way_edges(way)
    edges = [side.points_m for side in sides]
    if len(edges[0]) == len(edges[1]):
        middle = ((edges[0] + edges[1]) / 2.0).tolist()
        off_m = max(way.centerline.project(x, y).distance_m for x, y in middle)
        if off_m <= _SAME_M or not (way.left_boundary or way.right_boundary):
            return edges
    lines = (*sides, way.centerline)
    shares = np.unique(np.concatenate([x.stations_m / x.length_m for x in lines]).round(9))
    return [side.points_at(shares * side.length_m) for side in sides]


def _intersections(scene: Scene, ids: Ids) -> Iterator[ET.Element]:
    """Connectors that share a lane at either end belong to one intersection."""
    entered = [connector for connector in scene.connectors if connector.from_lane is not None]
    for group in writing.group_connectors(entered):
        by_lane: dict[str, list[LaneConnector]] = defaultdict(list)
        for connector in group:
            by_lane[str(connector.from_lane)].append(connector)
        incomings = []
        for lane, connectors in by_lane.items():
            successors = [
                _tag(side, ref=ids[connector.id])
                for side in dict.fromkeys(_SIDE_OF.values())
                for connector in connectors
                if _SIDE_OF[connector.turn_type] == side
            ]
            entry = _tag("incomingLanelet", ref=ids[lane])
            incomings.append(_tag("incoming", entry, *successors, id=ids[f"way in by {lane}"]))
        yield _tag("intersection", *incomings, id=ids[f"junction of {group[0].id}"])


# Obstacles and the planning problem


def _is_static(movement: Movement) -> bool:
    """Return whether it never moves; people, buses and bicycles are dynamic even if they stand."""
    kind = movement.agent.type
    if kind in _STATIC:
        way_m = np.ptp(movement.states[movement.is_present, :2], axis=0).max()
        return movement.source is not MotionSource.PLANNED and bool(way_m <= _MOVED_M)
    return kind is AgentType.VEHICLE and movement.stands


def _obstacles(cell: Cell, ids: Ids, report: LossReport) -> Iterator[ET.Element]:
    others = sorted(cell.motion.others, key=lambda other: not _is_static(other))
    later = [other.agent.id for other in others if writing.appears_later(other)]
    text = "is left out: it appears after t0, and all obstacles are there from t0 on"
    report.lose_of(later, text, changes_scene=True)
    for movement in others:
        if writing.appears_later(movement):
            continue
        agent, states = movement.agent, movement.states
        is_static = _is_static(movement)
        sizes = _tag("length", float(agent.length_m)), _tag("width", float(agent.width_m))
        kinds, usual = (_STATIC, "parkedVehicle") if is_static else (_DYNAMIC, "unknown")
        parts = [
            _tag("type", kinds.get(agent.type, usual)),
            _tag("shape", _tag("rectangle", *sizes)),
            _state("initialState", states[0], 0, has_speed=not is_static),
        ]
        if not is_static:
            present = movement.is_present
            last = len(present) if present.all() else int((~present).argmax())
            steps = [(step, states[step]) for step in range(1, last)]
            # A trajectory needs a step more than t0.
            rows = [_state("state", row, step) for step, row in steps or [(1, states[0])]]
            parts.append(_tag("trajectory", *rows))
        name = "staticObstacle" if is_static else "dynamicObstacle"
        yield _tag(name, *parts, id=ids[agent.id])


def _state(name: str, state: FloatArray, step: int, *, has_speed: bool = True) -> ET.Element:
    speed = [_exact("velocity", float(state[3]))] if has_speed else []
    return _tag(
        name,
        _tag("position", _point("point", state)),
        _exact("orientation", float(state[2])),
        _exact("time", step),
        *speed,
    )


def _problem(cell: Cell, ids: Ids) -> ET.Element:
    """The ego: where it starts, and where its motion ends as the goal."""
    states = cell.motion.ego.states
    start = _state("initialState", states[0], 0)
    start.extend([_exact("yawRate", 0.0), _exact("slipAngle", 0.0)])
    circle = _tag("circle", _tag("radius", GOAL_RADIUS_M), _point("center", states[-1]))
    time = _tag("time", _tag("intervalStart", 0), _tag("intervalEnd", len(states) - 1))
    goal = _tag("goalState", _tag("position", circle), time)
    return _tag("planningProblem", start, goal, id=ids[cell.after.ego.id])


def _report(cell: Cell, report: LossReport) -> None:
    scene, ego, others = cell.after, cell.after.ego, cell.motion.others
    writing.report_motion(cell, report)
    report.lose(
        f"of the ego's motion only start and end are written; its box of {ego.length_m:g} x "
        f"{ego.width_m:g} m is not"
    )
    report.lose("names become numbers; a comment in the file has both")
    report.lose_types(_BECOMES)
    moving = [other for other in others if not _is_static(other)]
    things = [other.agent for other in moving if other.agent.type in _STATIC]
    report.lose_of([agent.id for agent in things], "moves, so it becomes one of unknown type")
    names = [agent.id for agent in things if writing.keeps_heading(agent)]
    report.lose_of(names, "moves without turning; its speed is written as if along its heading")
    names = [other.agent.id for other in moving if writing.has_gaps(other)]
    report.lose_of(names, "goes and comes back; it ends where it goes first")
    ways, unknown = scene.connectors, TrafficLight.UNKNOWN
    turned = [way.id for way in ways if way.turn_type is entities.TurnType.U_TURN]
    report.lose_of(turned, "a U-turn becomes a turn to the left")
    entered = [connector.id for connector in ways if connector.from_lane is None]
    report.lose_of(entered, "its turn type is not said: no lane leads into it")
    dark = [connector.id for connector in ways if connector.traffic_light is unknown]
    report.lose_of(dark, "a light of unknown state becomes one that is off")
    if any(connector.traffic_light is not TrafficLight.NONE for connector in ways):
        report.lose("lights stay as they are at t0; how they go on is not known")
    report.lose("on which side people drive and where the ego is in the world is not said")
