"""The map of a scenario as OpenDRIVE: a road for each lane and connector.

The reference line of a road is a chain of cubics through every point of the centreline, with a
direction of its own at each, so that neither it nor the lane beside it has a kink. Roads that are
joined share direction and edges where they meet. Frame: the ego frame of t0. P points.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np

from augment.formats import writing
from augment.formats.writing import Cell, LossReport
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.entities import AnyLane, LaneConnector, Scene, TrafficLight, TrafficSide
from augment.scene.lane_graph import LaneGraph

NARROWEST_M: Final = 0.1
_SHARPEST: Final = 0.3
"""Pieces may turn by this cosine at most between one end and the other: about 70 degrees."""
_REVISION = ("1", "7")
_JOINED_M = 0.01
"""Ends that are further apart are not joined: a gap in a road is no road."""
_JOINED_COS = 0.996
"""Nor are ends whose directions differ by more than about 5 degrees."""
_FIRST_JUNCTION = 100_000


def write_map(cell: Cell, report: LossReport) -> bytes:
    """Return the file.

    Raises:
        writing.CannotExpress: The scene has no lane, or one that no road can follow.
    """
    from scenariogeneration import xodr

    scene = cell.after
    if not scene.ways:
        raise writing.CannotExpress("OpenDRIVE needs at least one road, and there is no lane")
    roads = {way.id: _Road.of(way, n) for n, way in enumerate(scene.ways, start=1)}
    connecting = [connector for connector in scene.connectors if _is_connecting(connector, roads)]
    groups = dict(enumerate(writing.group_connectors(connecting), start=_FIRST_JUNCTION))
    links = _Links(roads)
    report.lose_of(
        links.join_lanes(scene, {connector.id for connector in connecting}),
        "not joined: a gap, a bend, or a fork without connectors, which OpenDRIVE has no link for",
    )
    for number, group in groups.items():
        links.join_junction(number, group)
    drive = xodr.OpenDrive(scene.name, revMajor=_REVISION[0], revMinor=_REVISION[1])
    side = 1 if scene.traffic_side is TrafficSide.LEFT else -1
    for road in roads.values():
        drive.add_road(_road(xodr, road, side, links))
    for number, group in groups.items():
        drive.add_junction(_junction(xodr, number, group, roads, side))
    _report(scene, report)
    return _text(drive.get_element(), cell)


# Private


@dataclass(slots=True, kw_only=True, eq=False)
class _Road:
    """A way while it is written; its ends change when it is joined to others.

    Attributes:
        points: (P, 2) of the reference line.
        tangents: (P, 2) unit directions there.
        edges: (P, 2) how far left of the line the left and the right edge are.
        junction: Of a connecting road, -1 for others.
    """

    way: AnyLane
    number: int
    points: FloatArray
    tangents: FloatArray
    edges: FloatArray
    junction: int = -1

    @classmethod
    def of(cls, way: AnyLane, number: int) -> "_Road":
        """Lay out a way by itself."""
        points = way.centerline.points_m
        tangents = directions(points)
        edges = np.column_stack(
            [_offsets(edge, points, tangents) for edge in writing.way_edges(way)]
        )
        if (edges[:, 0] - edges[:, 1] < NARROWEST_M).any():
            raise writing.CannotExpress(f"{way.id} has no width somewhere between its edges")
        return cls(way=way, number=number, points=points, tangents=tangents, edges=edges)

    def leads_to(self, other: "_Road") -> bool:
        """Return whether another road begins where this one ends, in its direction."""
        gap_m = np.hypot(*(self.points[-1] - other.points[0]))
        return bool(gap_m <= _JOINED_M and self.tangents[-1] @ other.tangents[0] >= _JOINED_COS)


def directions(points_m: FloatArray) -> FloatArray:
    """Return unit tangents (P, 2) at a line's points: between the steps around each."""
    steps = np.diff(points_m, axis=0)
    lengths = np.hypot(*steps.T)[:, None]
    ways = steps / lengths
    mean = np.vstack([ways[:1], ways[:-1] * lengths[1:] + ways[1:] * lengths[:-1], ways[-1:]])
    return np.asarray(mean / np.maximum(np.hypot(*mean.T), 1e-12)[:, None])


def _offsets(edge: Polyline, points: FloatArray, tangents: FloatArray) -> FloatArray:
    """Return the signed distance, left positive, of an edge from each point of a line."""
    offsets = []
    for point, (cos, sin) in zip(points, tangents, strict=True):
        x_m, y_m = edge.position(edge.project(float(point[0]), float(point[1])).s_m)
        offsets.append((y_m - point[1]) * cos - (x_m - point[0]) * sin)
    return np.array(offsets, dtype=np.float64)


def _is_connecting(connector: LaneConnector, roads: Mapping[str, _Road]) -> bool:
    """Return whether both its ends are lanes that it really reaches."""
    before, after = (roads.get(name or "") for name in (connector.from_lane, connector.to_lane))
    if before is None or after is None:
        return False
    return before.leads_to(roads[connector.id]) and roads[connector.id].leads_to(after)


class _Links:
    """Predecessor and successor of each road: kind and number."""

    def __init__(self, roads: Mapping[str, _Road]) -> None:
        self._roads = roads
        self.before: dict[str, tuple[str, int]] = {}
        self.after: dict[str, tuple[str, int]] = {}

    def join_lanes(self, scene: Scene, inside: set[str]) -> list[str]:
        """Join roads that follow each other outside of junctions; return what can't be."""
        graph, left_out = LaneGraph(scene), []
        entered = {connector.to_lane for connector in scene.connectors if connector.id in inside}
        exited = {connector.from_lane for connector in scene.connectors if connector.id in inside}
        for name, road in self._roads.items():
            for following in graph.successors(name):
                if name in inside or following in inside:
                    continue
                other = self._roads[following]
                is_fork = len(graph.successors(name)) > 1 or len(graph.predecessors(following)) > 1
                if is_fork or name in exited or following in entered or not road.leads_to(other):
                    left_out.append(f"{name} to {following}")
                    continue
                self.after[name] = "road", other.number
                self.before[following] = "road", road.number
                tangent = road.tangents[-1] + other.tangents[0]
                road.tangents[-1] = other.tangents[0] = tangent / np.hypot(*tangent)
                road.edges[-1] = other.edges[0] = (road.edges[-1] + other.edges[0]) / 2.0
        return left_out

    def join_junction(self, number: int, members: Sequence[LaneConnector]) -> None:
        """Join the connectors of a junction to their lanes, whose ends they take over."""
        for connector in members:
            road = self._roads[connector.id]
            before = self._roads[str(connector.from_lane)]
            after = self._roads[str(connector.to_lane)]
            road.junction = number
            self.after[before.way.id] = self.before[after.way.id] = ("junction", number)
            self.before[connector.id] = "road", before.number
            self.after[connector.id] = "road", after.number
            road.tangents[0], road.edges[0] = before.tangents[-1], before.edges[-1]
            road.tangents[-1], road.edges[-1] = after.tangents[0], after.edges[0]


def _road(xodr: Any, road: _Road, side: int, links: _Links) -> Any:
    """One lane beside the reference line, on its right or, in left-hand traffic, its left."""
    if ((road.tangents[:-1] * road.tangents[1:]).sum(axis=1) < _SHARPEST).any():
        raise writing.CannotExpress(
            f"{road.way.id} turns too sharply between two points for a smooth road"
        )
    view, way = xodr.PlanView(), road.way
    pieces = [_cubic(xodr, road, row) for row in range(len(road.points) - 1)]
    stations_m = np.cumsum([0.0, *(piece.length for piece in pieces)])
    headings = np.arctan2(road.tangents[:, 1], road.tangents[:, 0]).tolist()
    for row, piece in enumerate(pieces):
        place = road.points[row].tolist()
        view.add_fixed_geometry(piece, *place, headings[row], s=float(stations_m[row]))
    view.present_s = float(stations_m[-1])
    left_m, right_m = road.edges.T
    lane, lanes = xodr.Lane(lane_type=xodr.LaneType.driving), xodr.Lanes()
    lane.widths.clear()
    for start_m, value, slope in _linear(stations_m, left_m - right_m):
        lane.add_lane_width(a=value, b=slope, soffset=start_m)
    for start_m, value, slope in _linear(stations_m, right_m if side > 0 else left_m):
        lanes.add_laneoffset(xodr.LaneOffset(start_m, value, slope))
    section = xodr.LaneSection(0.0, xodr.Lane(lane_type=xodr.LaneType.none))
    (section.add_left_lane if side > 0 else section.add_right_lane)(lane)
    lanes.add_lanesection(section)
    made = xodr.Road(
        road.number,
        view,
        lanes,
        road_type=road.junction,
        name=way.id,
        rule=xodr.TrafficRule.LHT if side > 0 else xodr.TrafficRule.RHT,
    )
    if way.speed_limit_mps is not None:
        made.add_type(xodr.RoadType.town, 0, speed=way.speed_limit_mps, speed_unit="m/s")
    for joins, name, add, point in (
        (links.before, "predecessor", made.add_predecessor, xodr.ContactPoint.end),
        (links.after, "successor", made.add_successor, xodr.ContactPoint.start),
    ):
        kind, number = joins.get(way.id, ("", 0))
        if kind == "road":
            add(xodr.ElementType.road, number, point)
            lane.add_link(name, side)
        elif kind == "junction":
            add(xodr.ElementType.junction, number)
    return made


def _linear(stations_m: FloatArray, values: FloatArray) -> list[list[float]]:
    """Start, value and slope of each straight part."""
    slopes = np.round(np.diff(values) / np.diff(stations_m), 5)
    begins = np.flatnonzero(np.diff(slopes, prepend=np.nan))
    return np.column_stack([stations_m[begins], values[begins], slopes[begins]]).tolist()  # type: ignore[no-any-return]


def _cubic(xodr: Any, road: _Road, row: int) -> Any:
    """The Hermite cubic from a point to the next, in the frame of the first and its tangent."""
    cos, sin = road.tangents[row]
    turn = np.array([[cos, sin], [-sin, cos]])
    chord = turn @ (road.points[row + 1] - road.points[row])
    size_m = np.hypot(*chord)
    first, last = np.array([size_m, 0.0]), size_m * (turn @ road.tangents[row + 1])
    u, v = np.column_stack(
        [np.zeros(2), first, 3.0 * chord - 2.0 * first - last, first + last - 2.0 * chord]
    ).tolist()
    return xodr.ParamPoly3(*u, *v)


def _junction(
    xodr: Any, number: int, members: Sequence[LaneConnector], roads: Mapping[str, _Road], side: int
) -> Any:
    junction = xodr.Junction(f"Junction{number - _FIRST_JUNCTION + 1}", number)
    for member in members:
        entering, connecting = roads[str(member.from_lane)], roads[member.id]
        connection = xodr.Connection(entering.number, connecting.number, xodr.ContactPoint.start)
        connection.add_lanelink(side, side)
        junction.add_connection(connection)
    return junction


def _report(scene: Scene, report: LossReport) -> None:
    report.lose("roads are smooth through our points and meet at common ends: edges may lie off")
    lanes = [lane.id for lane in scene.lanes if lane.left_neighbor or lane.right_neighbor]
    report.lose_of(lanes, "that lanes lie side by side is not said: each is a road of its own")
    ways = scene.connectors
    lit = [way.id for way in ways if way.traffic_light is not TrafficLight.NONE]
    report.lose_of(lit, "the map has no lights")
    report.lose_of([area.id for area in scene.areas], "areas are left out of the map")
    report.lose_of([way.id for way in ways], "turn types are not said, only the lines")


def _text(root: ET.Element, cell: Cell) -> bytes:
    """The file; its header has no time of day, but extent and origin."""
    header = root.find("header")
    assert header is not None
    points = np.vstack([way.centerline.points_m for way in cell.after.ways])
    pose = cell.after.origin.pose
    header.set("date", f"{cell.made_on.isoformat()}T00:00:00")
    extent = (*points.max(axis=0), *points.min(axis=0))
    for name, value in zip(("east", "north", "west", "south"), extent, strict=True):
        header.set(name, f"{value:.3f}")
    origin = f"{cell.after.origin.frame}: {pose.x_m!r} {pose.y_m!r} {pose.heading_rad!r}"
    ET.SubElement(header, "userData", code="scenario-arena/origin", value=origin)
    ET.indent(root)
    return f"<?xml version='1.0' encoding='UTF-8'?>\n{ET.tostring(root, 'unicode')}\n".encode()
