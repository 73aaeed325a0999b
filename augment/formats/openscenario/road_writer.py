"""The map of a scene as OpenDRIVE 1.7: a road for each lane and connector, junctions between them.

Each way is a road with one driving lane; neighbouring lanes are roads side by side. Lanes
that meet with connectors between them meet in a junction. Frame: the ego frame of t0. The file is
made by scenariogeneration. Source: ASAM OpenDRIVE 1.7.0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats.openscenario.roads import (
    End,
    ReferenceLine,
    deviation_m,
    directions,
    reference_line,
)
from augment.formats.writing import CannotExpress, Cell, LossReport
from augment.scene.entities import Lane, LaneConnector, Scene, TrafficLight, TrafficSide
from augment.scene.lane_graph import AnyLane, LaneGraph

REVISION = ("1", "7")
_JOINED_M = 0.01
"""Ends that are further apart are not joined: a gap in a road is no road."""
_JOINED_COS = 0.996
"""Nor are ends whose directions differ by more than about 5 degrees."""
_OFF_M = 0.01
_TRUE_M = 0.001
_FIRST_JUNCTION = 100_000


def map_of(cell: Cell, report: LossReport) -> bytes:
    """The file.

    Raises:
        CannotExpress: The scene has no lane, or one that no road can follow.
    """
    from scenariogeneration import xodr

    scene = cell.after
    ways: list[AnyLane] = [*scene.lanes, *scene.connectors]
    if not ways:
        raise CannotExpress("OpenDRIVE needs at least one road, and this scene has no lane")
    network = _Network(scene)
    drive = xodr.OpenDrive(scene.name, revMajor=REVISION[0], revMinor=REVISION[1])
    lines = _fitted(ways, network)
    for way in ways:
        drive.add_road(_road(xodr, scene, way, lines[way.id], network))
    for junction, members in network.junctions.items():
        drive.add_junction(_junction(xodr, junction, members, network, scene.traffic_side))
    network.report(report)
    deviations = {way.id: deviation_m(lines[way.id], way) for way in ways}
    _report(scene, deviations, report)
    return _text(drive.get_element(), cell, max(deviations.values()))


# Private


def _fitted(ways: Sequence[AnyLane], network: _Network) -> dict[str, ReferenceLine]:
    """The lines of all roads, without a step or a kink where one is joined to another."""
    by_id = {way.id: way for way in ways}
    alone = {way.id: reference_line(way) for way in ways}
    starts: dict[str, End] = {}
    ends: dict[str, End] = {}
    for first, second in network.pairs:
        ends[first] = starts[second] = alone[first].end.between(alone[second].start)
    for one in network.inside.values():
        before, after = alone[str(one.from_lane)], alone[str(one.to_lane)]
        starts[one.id] = ends.get(str(one.from_lane), before.end)
        ends[one.id] = starts.get(str(one.to_lane), after.start)
    return {
        name: reference_line(way, start=starts.get(name), end=ends.get(name))
        for name, way in by_id.items()
    }


class _Network:
    """Which road is which, what it is joined to and in which junction it lies."""

    def __init__(self, scene: Scene) -> None:
        self._graph = LaneGraph(scene)
        ways: list[AnyLane] = [*scene.lanes, *scene.connectors]
        self.ids = {way.id: number for number, way in enumerate(ways, start=1)}
        self.left_out: list[str] = []
        self.pairs: list[tuple[str, str]] = []
        self.inside = {
            connector.id: connector
            for connector in scene.connectors
            if self._is_connecting(connector)
        }
        self.junctions = self._grouped()
        self.of_road = {
            one.id: junction for junction, group in self.junctions.items() for one in group
        }
        self.before, self.after = self._joins(ways)

    def _is_connecting(self, one: LaneConnector) -> bool:
        """Whether both its ends are roads outside that it really reaches."""
        ends = [one.from_lane, one.to_lane]
        if any(not isinstance(self._graph.lanes.get(name or ""), Lane) for name in ends):
            return False
        assert one.from_lane is not None
        assert one.to_lane is not None
        return self.meet(one.from_lane, one.id) and self.meet(one.id, one.to_lane)

    def meet(self, first: str, second: str) -> bool:
        """Whether one road begins where the other ends, in its direction."""
        end, start = self._graph.lanes[first].centerline, self._graph.lanes[second].centerline
        gap = np.hypot(*(end.points_m[-1] - start.points_m[0]))
        turn = float(directions(end.points_m)[-1] @ directions(start.points_m)[0])
        return bool(gap <= _JOINED_M) and turn >= _JOINED_COS

    def _grouped(self) -> dict[int, list[LaneConnector]]:
        groups: list[tuple[set[str], list[LaneConnector]]] = []
        for one in self.inside.values():
            ends, members, others = {f"<{one.from_lane}", f">{one.to_lane}"}, [one], []
            for names, group in groups:
                if names & ends:
                    ends, members = ends | names, [*group, *members]
                else:
                    others.append((names, group))
            groups = [*others, (ends, members)]
        return {_FIRST_JUNCTION + n: group for n, (_, group) in enumerate(groups)}

    def _joins(
        self, ways: Sequence[AnyLane]
    ) -> tuple[dict[str, tuple[str, int]], dict[str, tuple[str, int]]]:
        """What comes before and after each road: ("road" or "junction", its number)."""
        before: dict[str, tuple[str, int]] = {}
        after: dict[str, tuple[str, int]] = {}
        for junction, group in self.junctions.items():
            for one in group:
                after[str(one.from_lane)] = ("junction", junction)
                before[str(one.to_lane)] = ("junction", junction)
                before[one.id] = ("road", self.ids[str(one.from_lane)])
                after[one.id] = ("road", self.ids[str(one.to_lane)])
        for way in ways:
            for following in self._graph.successors(way.id):
                if way.id in self.inside or following in self.inside:
                    continue
                alone = len(self._graph.successors(way.id)) == 1
                alone = alone and len(self._graph.predecessors(following)) == 1
                if not alone or way.id in after or following in before:
                    self.left_out.append(f"{way.id} to {following}")
                elif self.meet(way.id, following):
                    self.pairs.append((way.id, following))
                    after[way.id] = ("road", self.ids[following])
                    before[following] = ("road", self.ids[way.id])
                else:
                    self.left_out.append(f"{way.id} to {following}")
        return before, after

    def report(self, report: LossReport) -> None:
        """Say which joins are left out."""
        report.lose_of(
            self.left_out,
            "not joined: a gap, a bend, or a fork without connectors, which OpenDRIVE has no "
            "link for",
        )


def _road(xodr: Any, scene: Scene, way: AnyLane, line: ReferenceLine, network: _Network) -> Any:
    view = xodr.PlanView()
    for piece, start_m in zip(line.pieces, line.stations_m, strict=False):
        cubic = xodr.ParamPoly3(*piece.u, *piece.v, length=piece.length_m)
        view.add_fixed_geometry(cubic, piece.x_m, piece.y_m, piece.heading_rad, s=float(start_m))
    view.present_s = line.length_m
    side = _lane_number(scene.traffic_side)
    lane = _lane(xodr, line)
    if way.id in network.after:
        lane.add_link("successor", side) if network.after[way.id][0] == "road" else None
    if way.id in network.before:
        lane.add_link("predecessor", side) if network.before[way.id][0] == "road" else None
    section = xodr.LaneSection(0.0, xodr.Lane(lane_type=xodr.LaneType.none))
    (section.add_left_lane if side > 0 else section.add_right_lane)(lane)
    lanes = xodr.Lanes()
    inner_m = line.right_m if side > 0 else line.left_m
    for start_m, a, b in _linear(line.stations_m, inner_m):
        lanes.add_laneoffset(xodr.LaneOffset(start_m, a, b))
    lanes.add_lanesection(section)
    rule = xodr.TrafficRule.LHT if side > 0 else xodr.TrafficRule.RHT
    road = xodr.Road(
        network.ids[way.id],
        view,
        lanes,
        road_type=network.of_road.get(way.id, -1),
        name=way.id,
        rule=rule,
    )
    if way.speed_limit_mps is not None:
        road.add_type(xodr.RoadType.town, 0, speed=way.speed_limit_mps, speed_unit="m/s")
    _link(xodr, road, way.id, network)
    return road


def _lane_number(side: TrafficSide) -> int:
    """Who drives along the reference line: the first lane to its right, or left of it."""
    return 1 if side is TrafficSide.LEFT else -1


def _lane(xodr: Any, line: ReferenceLine) -> Any:
    widths = _linear(line.stations_m, line.left_m - line.right_m)
    lane = xodr.Lane(lane_type=xodr.LaneType.driving, a=widths[0][1], b=widths[0][2])
    for start_m, a, b in widths[1:]:
        lane.add_lane_width(a=a, b=b, soffset=start_m)
    return lane


def _linear(stations_m: Any, values: Any) -> list[tuple[float, float, float]]:
    """Start, value and slope of the fewest straight parts that are true to a millimetre."""
    made: list[tuple[float, float, float]] = []
    here, last = 0, len(stations_m) - 1
    while here < last:
        there = here + 1
        while there < last and _is_straight(stations_m, values, here, there + 1):
            there += 1
        slope = (values[there] - values[here]) / (stations_m[there] - stations_m[here])
        made.append((float(stations_m[here]), float(values[here]), float(slope)))
        here = there
    return made


def _is_straight(stations_m: Any, values: Any, first: int, last: int) -> bool:
    ends = [first, last]
    inner = slice(first, last + 1)
    line = np.interp(stations_m[inner], stations_m[ends], values[ends])
    return bool(np.abs(line - values[inner]).max() < _TRUE_M)


def _link(xodr: Any, road: Any, name: str, network: _Network) -> None:
    for joins, add, point in (
        (network.before, road.add_predecessor, xodr.ContactPoint.end),
        (network.after, road.add_successor, xodr.ContactPoint.start),
    ):
        if name in joins:
            kind, number = joins[name]
            if kind == "junction":
                add(xodr.ElementType.junction, number)
            else:
                add(xodr.ElementType.road, number, point)


def _junction(
    xodr: Any, number: int, members: Sequence[LaneConnector], network: _Network, side: TrafficSide
) -> Any:
    junction = xodr.Junction(f"Junction{number - _FIRST_JUNCTION + 1}", number)
    lane = _lane_number(side)
    for member in members:
        connection = xodr.Connection(
            network.ids[str(member.from_lane)], network.ids[member.id], xodr.ContactPoint.start
        )
        connection.add_lanelink(lane, lane)
        junction.add_connection(connection)
    return junction


def _report(scene: Scene, deviations: dict[str, float], report: LossReport) -> None:
    worst = max(deviations, key=lambda name: deviations[name])
    off = sum(deviation > _OFF_M for deviation in deviations.values())
    report.lose(
        f"the edges of roads are up to {deviations[worst]:.2f} m beside ours ({worst}), of "
        f"{off} roads more than {_OFF_M:g} m: roads are smooth and meet at common ends"
    )
    names = [lane.id for lane in scene.lanes if lane.left_neighbor or lane.right_neighbor]
    report.lose_of(names, "that lanes lie side by side is not said: each is a road of its own")
    names = [
        connector.id
        for connector in scene.connectors
        if connector.traffic_light is not TrafficLight.NONE
    ]
    report.lose_of(names, "the map has no lights")
    names = [area.id for area in scene.areas]
    report.lose_of(names, "areas are left out of the map")
    names = [connector.id for connector in scene.connectors]
    report.lose_of(names, "turn types are not said, only the lines")


def _text(root: ET.Element, cell: Cell, most_off_m: float) -> bytes:
    """The file; its header has no time of day, but extent, origin and greatest deviation."""
    header = root.find("header")
    assert header is not None
    ways: list[AnyLane] = [*cell.after.lanes, *cell.after.connectors]
    points = np.vstack([way.centerline.points_m for way in ways])
    pose = cell.after.origin.pose
    header.set("date", f"{cell.made_on.isoformat()}T00:00:00")
    for name, value in zip(
        ("east", "north", "west", "south"), (*points.max(axis=0), *points.min(axis=0)), strict=True
    ):
        header.set(name, f"{value:.3f}")
    ET.SubElement(
        header,
        "userData",
        code="scenario-arena/origin",
        value=f"{cell.after.origin.frame}: {pose.x_m!r} {pose.y_m!r} {pose.heading_rad!r}",
    )
    ET.SubElement(header, "userData", code="scenario-arena/deviation-m", value=f"{most_off_m:.3f}")
    ET.indent(root)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, 'unicode')}\n".encode()
