"""The road part of the CommonRoad writer: lanelets, signs, lights, intersections.

Frame: the ego frame of t0.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats.commonroad.writer import Ids, add, number
from augment.formats.roads import width_between
from augment.formats.writing import Cell, LossReport, bounds_of
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.entities import (
    Area,
    AreaKind,
    Lane,
    LaneConnector,
    Scene,
    TrafficLight,
    TurnType,
)
from augment.scene.lane_graph import AnyLane, LaneGraph

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
