"""Smooth reference lines and lane widths for OpenDRIVE, from a way's points.

A reference line goes through every point of the centreline, with a direction of its own at each,
so that neither it nor the lane beside it has a kink. Frame: the ego frame of t0. N pieces.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final
from xml.etree import ElementTree as ET

import numpy as np
import shapely

from augment.formats.writing import CannotExpress, Cell, LossReport, bounds_of, group_connectors
from augment.geometry.frames import difference
from augment.geometry.polyline import FloatArray, Polyline
from augment.scene.entities import Lane, LaneConnector, Scene, TrafficLight, TrafficSide
from augment.scene.lane_graph import AnyLane, LaneGraph

NARROWEST_M: Final = 0.1
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)
"""Lengths of cubics to far below a millimetre."""
_SAMPLES: Final = 9
"""So many points of a piece are held against a lane's edges."""
_SHARPEST: Final = 0.3
"""Pieces may turn by this cosine at most between one end and the other: about 70 degrees."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Piece:
    """A cubic in its own frame, its parameter from 0 to 1: (4,) coefficients of u and of v."""

    x_m: float
    y_m: float
    heading_rad: float
    length_m: float
    u: FloatArray
    v: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class End:
    """How a road begins or ends: its direction, and where the lane's edges are beside its line."""

    heading_rad: float
    left_m: float
    right_m: float

    def between(self, other: End) -> End:
        """Half way to another one."""
        return End(
            heading_rad=self.heading_rad + difference(other.heading_rad, self.heading_rad) / 2.0,
            left_m=(self.left_m + other.left_m) / 2.0,
            right_m=(self.right_m + other.right_m) / 2.0,
        )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReferenceLine:
    """The line of a road and the lane beside it.

    Attributes:
        stations_m: (N + 1,) arc length along the pieces at each point.
        start, end: How it begins and ends.
        left_m, right_m: (N + 1,) from the line to the lane's edges, left positive.
    """

    pieces: tuple[Piece, ...]
    start: End
    end: End
    stations_m: FloatArray
    left_m: FloatArray
    right_m: FloatArray

    @property
    def length_m(self) -> float:
        """Of the whole line."""
        return float(self.stations_m[-1])


def reference_line(
    way: AnyLane, *, start: End | None = None, end: End | None = None
) -> ReferenceLine:
    """The reference line of a way.

    Args:
        way: A lane or connector.
        start: How it is to begin, so that it fits what it is joined to; None for its own way.
        end: How it is to end, likewise.

    Raises:
        CannotExpress: It turns too sharply between two points, or has no width.
    """
    points = way.centerline.points_m
    tangents = directions(points)
    edges = _edges(way, points, tangents)
    for row, wanted in ((0, start), (-1, end)):
        if wanted is not None:
            tangents[row] = np.cos(wanted.heading_rad), np.sin(wanted.heading_rad)
            edges[row] = wanted.left_m, wanted.right_m
    headings = np.arctan2(tangents[:, 1], tangents[:, 0])
    ends = [
        End(heading_rad=float(headings[n]), left_m=float(edges[n, 0]), right_m=float(edges[n, 1]))
        for n in (0, -1)
    ]
    if ((tangents[:-1] * tangents[1:]).sum(axis=1) < _SHARPEST).any():
        raise CannotExpress(f"{way.id} turns too sharply between two points for a smooth road")
    pieces = tuple(
        _piece(points[row], points[row + 1], tangents[row], tangents[row + 1])
        for row in range(len(points) - 1)
    )
    lengths = np.array([piece.length_m for piece in pieces])
    return ReferenceLine(
        pieces=pieces,
        start=ends[0],
        end=ends[1],
        stations_m=np.concatenate([[0.0], np.cumsum(lengths)]),
        left_m=edges[:, 0],
        right_m=edges[:, 1],
    )


def directions(points_m: FloatArray) -> FloatArray:
    """Unit tangents (P, 2) at a line's points: between the steps around each, nearer ones more."""
    steps = np.diff(points_m, axis=0)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    ways = steps / lengths[:, None]
    mean = np.vstack(
        [ways[:1], ways[:-1] * lengths[1:, None] + ways[1:] * lengths[:-1, None], ways[-1:]]
    )
    return np.asarray(mean / np.maximum(np.hypot(mean[:, 0], mean[:, 1]), 1e-12)[:, None])


def deviation_m(line: ReferenceLine, way: AnyLane) -> float:
    """Return how far the edges of a road lie beside those of its way at most."""
    at = np.linspace(0.0, 1.0, _SAMPLES)[:, None] ** np.arange(4)
    slope = np.column_stack([np.zeros(_SAMPLES), at[:, :3] * (1.0, 2.0, 3.0)])
    written: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    for row, piece in enumerate(line.pieces):
        local, tangent = (
            np.column_stack([powers @ piece.u, powers @ piece.v]) for powers in (at, slope)
        )
        gone_m = np.hypot(*np.diff(local, axis=0).T).cumsum()
        share = np.concatenate([[0.0], gone_m / gone_m[-1]])
        normal = np.column_stack([-tangent[:, 1], tangent[:, 0]])
        normal /= np.hypot(*normal.T)[:, None]
        cos, sin = np.cos(piece.heading_rad), np.sin(piece.heading_rad)
        for edge, offsets_m in zip(written, (line.left_m, line.right_m), strict=True):
            beside_m = offsets_m[row] + share * (offsets_m[row + 1] - offsets_m[row])
            points = local + beside_m[:, None] * normal
            edge.append(points @ np.array([[cos, sin], [-sin, cos]]) + (piece.x_m, piece.y_m))
    return max(
        shapely.LineString(np.vstack(made)).hausdorff_distance(shapely.LineString(own.points_m))
        for made, own in zip(written, bounds_of(way), strict=True)
    )


# Private


def _piece(start: FloatArray, end: FloatArray, out: FloatArray, into: FloatArray) -> Piece:
    heading = float(np.arctan2(out[1], out[0]))
    turn = np.array([[out[0], out[1]], [-out[1], out[0]]])
    chord, last = turn @ (end - start), turn @ into
    size = float(np.hypot(*chord))
    # Hermite: from (0, 0) along (1, 0) to the chord's end along `last`.
    first_speed, last_speed = np.array([size, 0.0]), size * last
    c = 3.0 * chord - 2.0 * first_speed - last_speed
    d = -2.0 * chord + first_speed + last_speed
    u, v = (np.array([0.0, first_speed[n], c[n], d[n]]) for n in (0, 1))
    return Piece(
        x_m=float(start[0]),
        y_m=float(start[1]),
        heading_rad=heading,
        length_m=_length(u, v),
        u=u,
        v=v,
    )


def _length(u: FloatArray, v: FloatArray) -> float:
    at = (_NODES + 1.0) / 2.0
    slopes = [poly[1] + 2.0 * poly[2] * at + 3.0 * poly[3] * at**2 for poly in (u, v)]
    return float((np.hypot(*slopes) * _WEIGHTS).sum() / 2.0)


def _edges(way: AnyLane, points: FloatArray, tangents: FloatArray) -> FloatArray:
    """How far left the two edges are of the reference line at its points, (P, 2)."""
    if way.left_boundary is None and way.right_boundary is None:
        half = np.full(len(points), way.width_m / 2.0)
        return np.column_stack([half, -half])
    left, right = bounds_of(way)
    left_m, right_m = _offsets(left, points, tangents), _offsets(right, points, tangents)
    if (left_m - right_m < NARROWEST_M).any():
        raise CannotExpress(f"{way.id} has no width somewhere between its edges")
    return np.column_stack([left_m, right_m])


def _offsets(edge: Polyline, points: FloatArray, tangents: FloatArray) -> FloatArray:
    made = []
    for point, (cos, sin) in zip(points, tangents, strict=True):
        place = edge.project(float(point[0]), float(point[1]))
        x_m, y_m = edge.position(place.s_m)
        made.append((y_m - point[1]) * cos - (x_m - point[0]) * sin)
    return np.array(made, dtype=np.float64)


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
        groups = group_connectors(self.inside.values())
        self.junctions = dict(enumerate(groups, start=_FIRST_JUNCTION))
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
