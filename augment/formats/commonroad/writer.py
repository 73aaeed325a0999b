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
    ways_of,
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
_SIDE_OF = {
    TurnType.RIGHT: "successorsRight",
    TurnType.STRAIGHT: "successorsStraight",
    TurnType.LEFT: "successorsLeft",
    TurnType.U_TURN: "successorsLeft",
}
_COLOURS = {
    TrafficLight.GREEN: "green",
    TrafficLight.YELLOW: "yellow",
    TrafficLight.RED: "red",
    TrafficLight.UNKNOWN: "inactive",
}
Ids = Mapping[str, int]
"""Whole numbers from 1 on, a new one for each name that is asked for."""


def write(cells: Sequence[Cell]) -> Written:
    """One XML file for each cell."""
    return write_each(cells, _write_one)


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
    if not ways_of(scene):
        raise CannotExpress("CommonRoad needs at least one lane, and this scene has none")
    ids: Ids = defaultdict(count(1).__next__)
    # A map's name in a benchmark id has letters and digits alone.
    words = [part.capitalize() for part in cell.stem.split("-") if part.isascii()]
    root = _tag(
        "commonRoad",
        _location(scene),
        _tag("scenarioTags"),
        *_map(cell, ids, report),
        *_obstacles(cell, ids, report),
        _problem(cell, ids),
        timeStepSize=_number(cell.motion.step_s),
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
    comment = escape_controls(f"Our names and the ids here: {names}").replace("--", "- -")
    body = ET.tostring(root, encoding="unicode")
    text = f"<?xml version='1.0' encoding='UTF-8'?>\n<!-- {comment} -->\n{body}\n"
    return {f"{cell.stem}.xml": text.encode()}


def _location(scene: Scene) -> ET.Element:
    pose = scene.origin.pose
    return _tag(
        "location",
        _tag("geoNameId", -999),
        _tag("gpsLatitude", 999),
        _tag("gpsLongitude", 999),
        _tag(
            "geoTransformation",
            _tag("geoReference", scene.origin.frame),
            _tag(
                "additionalTransformation",
                _tag("xTranslation", pose.x_m),
                _tag("yTranslation", pose.y_m),
                _tag("zRotation", pose.heading_rad),
                _tag("scaling", 1.0),
            ),
        ),
    )


# The map: lanelets, then traffic signs, lights and intersections, as the schema orders them


def _map(cell: Cell, ids: Ids, report: LossReport) -> Iterator[ET.Element]:
    scene = cell.after
    graph, ways = LaneGraph(scene), ways_of(scene)
    for way in ways:
        ids[way.id]  # lanelets have the first numbers
    off_m, apart_m = {}, {}
    for way in ways:
        left, right = _paired_bounds(way)
        off_m[way.id] = _off_middle_m(way.centerline, (left + right) / 2.0)
        apart_m[way.id] = abs(width_between(way.centerline, *bounds_of(way)) - way.width_m)
        yield _lanelet(ids[way.id], left, right, *_of_way(way, graph, ids))
    crosswalks = [one for one in scene.areas if one.kind is AreaKind.CROSSWALK]
    quads = [one for one in crosswalks if len(one.boundary_m) == 4]
    for area in quads:
        kind = _tag("laneletType", "crosswalk"), _tag("userBidirectional", "pedestrian")
        yield _lanelet(ids[area.id], *_crosswalk_bounds(area), *kind)
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
            colour = _tag("color", _COLOURS[connector.traffic_light])
            place = _point("point", connector.centerline.points_m[0])
            yield _tag(
                "trafficLight",
                _tag("cycle", _tag("cycleElement", duration, colour)),
                _tag("position", place),
                id=ids[f"light of {connector.id}"],
            )
    yield from _intersections(scene, ids)
    for distances, text in (
        (off_m, "centrelines that are off the middle of the edges, which alone go out"),
        (apart_m, "widths that are not the distance of the edges, which alone go out"),
    ):
        far = [f"{name} by {away:.2f} m" for name, away in distances.items() if away > _SAME_M]
        if far:
            report.lose(f"{text}: {', '.join(far)}")
    text = "left out: a {} area of this shape can't be a lanelet"
    report.lose_areas([one for one in scene.areas if one not in quads], text)


def _lanelet(number: int, left: FloatArray, right: FloatArray, *parts: ET.Element) -> ET.Element:
    bounds = [
        _tag(name, *(_point("point", point) for point in points))
        for name, points in (("leftBound", left), ("rightBound", right))
    ]
    return _tag("lanelet", *bounds, *parts, id=number)


def _of_way(way: AnyLane, graph: LaneGraph, ids: Ids) -> Iterator[ET.Element]:
    """What stands in a lanelet after its bounds."""
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
    ring = np.array(area.boundary_m)
    sides_m = np.hypot(*(np.roll(ring, -1, axis=0) - ring).T)
    if sides_m[0] + sides_m[2] < sides_m[1] + sides_m[3]:
        ring = np.roll(ring, -1, axis=0)
    first, second = ring[:2], ring[:1:-1]
    along, across = first[1] - first[0], second[0] - first[0]
    is_left = along[0] * across[1] - along[1] * across[0] < 0.0
    return (first, second) if is_left else (second, first)


def _intersections(scene: Scene, ids: Ids) -> Iterator[ET.Element]:
    """Connectors that share a lane at either end belong to one intersection."""
    entered = [connector for connector in scene.connectors if connector.from_lane is not None]
    for group in group_connectors(entered):
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
    """What never moves; people, buses and bicycles that stand keep their types as dynamic ones."""
    kind = movement.agent.type
    return kind in _STATIC or (kind is AgentType.VEHICLE and movement.stands)


def _obstacles(cell: Cell, ids: Ids, report: LossReport) -> Iterator[ET.Element]:
    others = sorted(cell.motion.others, key=lambda one: not _is_static(one))
    later = [one.agent.id for one in others if appears_later(one)]
    text = "is left out: it appears after t0, and all obstacles are there from t0 on"
    report.lose_of(later, text, changes_scene=True)
    for movement in others:
        if appears_later(movement):
            continue
        agent, states = movement.agent, movement.states
        is_static = _is_static(movement)
        sizes = _tag("length", float(agent.length_m)), _tag("width", float(agent.width_m))
        parts = [
            _tag(
                "type",
                _STATIC.get(agent.type, "parkedVehicle") if is_static else _DYNAMIC[agent.type],
            ),
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
    report_motion(cell, report)
    report.lose(
        f"of the ego's motion only start and end are written; its box of {ego.length_m:g} x "
        f"{ego.width_m:g} m is not"
    )
    report.lose("names become numbers; a comment in the file has both")
    report.lose_types(_BECOMES)
    names = [one.agent.id for one in others if has_gaps(one) and not _is_static(one)]
    report.lose_of(names, "goes and comes back; it ends where it goes first")
    names = [agent.id for agent in scene.agents if agent.walk_to_m is not None]
    report.lose_of(names, "the walk is written as motion alone, not as its end point")
    static = [one for one in others if _is_static(one)]
    moved = [
        one for one in static if np.ptp(one.states[one.is_present, :2], axis=0).max() >= MOVES_M
    ]
    text = "moves, but things of this type can only stand there"
    report.lose_of([one.agent.id for one in moved], text, changes_scene=True)
    connectors = scene.connectors
    names = [one.id for one in connectors if one.turn_type is TurnType.U_TURN]
    report.lose_of(names, "a U-turn becomes a turn to the left")
    names = [one.id for one in connectors if one.from_lane is None]
    report.lose_of(names, "its turn type is not said: no lane leads into it")
    names = [one.id for one in connectors if one.traffic_light is TrafficLight.UNKNOWN]
    report.lose_of(names, "a light of unknown state becomes one that is off")
    if any(one.traffic_light is not TrafficLight.NONE for one in connectors):
        report.lose("lights stay as they are at t0; how they go on is not known")
    if scene.traffic_side is TrafficSide.LEFT:
        report.lose("that people drive on the left is not said")
