"""Longitude and latitude as the metres of a UTM zone.

The transverse Mercator of the WGS 84 ellipsoid by Krüger's series to the fourth order in the third
flattening: within a micrometre inside a zone (Karney, Transverse Mercator with an accuracy of a
few nanometers, J. Geodesy 85, 2011).
"""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import shapely
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.road_map import USUAL_M, RoadMap, Segment, count_notes, limit_notes
from augment.formats.roads import RADIUS_M
from augment.geometry.polyline import Polyline
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType
from augment.scene.lane_graph import turn_type_of
from augment.scene.recording import Note, SceneNoteKind

WHAT = "nuPlan log"
LONGEST_VALUE = 16 * 1024 * 1024
"""Bytes of one value or row."""


class Tables:
    """A database's tables."""

    def __init__(self, connection: sqlite3.Connection, name: str) -> None:
        self._connection = connection
        self._name = name

    def has(self, table: str) -> bool:
        """Whether there is a table of that name; a view or a virtual table is a program."""
        text = (
            "SELECT 1 FROM sqlite_master WHERE type = 'table' AND name = ? "
            "AND sql NOT LIKE 'CREATE VIRTUAL%'"
        )
        return bool(self._connection.execute(text, (table,)).fetchone())

    def columns(self, table: str) -> set[str]:
        """Its columns, without computed ones; none of a table that is not there."""
        if not self.has(table):
            return set()
        text = "SELECT name FROM pragma_table_info(?)"
        return {str(row[0]) for row in self._connection.execute(text, (table,))}

    def need(self, table: str, columns: Sequence[str]) -> None:
        """Whether the table has these columns.

        Raises:
            InvalidDocument: It has not.
        """
        there = self.columns(table)
        if not there:
            raise InvalidDocument(WHAT, [(self._name, f"has no table {table!r}")])
        missing = [name for name in columns if name not in there]
        if missing:
            faults = [(f"{self._name}: {table}", f"has no column {one!r}") for one in missing]
            raise InvalidDocument(WHAT, faults)

    def rows(self, query: str, values: Sequence[Any] = ()) -> list[tuple[Any, ...]]:
        """What a query gives."""
        return list(self.each(query, values))

    def each(self, query: str, values: Sequence[Any] = ()) -> Iterator[tuple[Any, ...]]:
        """The same, one by one."""
        yield from self._connection.execute(query, tuple(values))


@contextmanager
def open_tables(path: Path) -> Iterator[Tables]:
    """The file's tables, as long as the block lasts.

    Raises:
        InvalidDocument: It is not there, or no database.
    """
    if not path.is_file():
        raise InvalidDocument(WHAT, [(str(path), "is not there")])
    address = f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(address, uri=True)) as connection:
            connection.execute("PRAGMA trusted_schema = OFF")
            connection.execute("PRAGMA cell_size_check = ON")
            connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LONGEST_VALUE)
            yield Tables(connection, path.name)
    except (sqlite3.Error, UnicodeDecodeError) as fault:
        raise InvalidDocument(
            WHAT, [(path.name, f"can't be read as a database: {fault}")]
        ) from None


FloatArray = NDArray[np.float64]

WGS84_A_M = 6_378_137.0
WGS84_F = 1.0 / 298.257223563
SCALE = 0.9996
FALSE_EAST_M = 500_000.0
FALSE_NORTH_M = 10_000_000.0

_N = WGS84_F / (2.0 - WGS84_F)
_E = math.sqrt(WGS84_F * (2.0 - WGS84_F))
_RADIUS_M = WGS84_A_M / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 5.0 * _N**3 / 16.0 + 41.0 * _N**4 / 180.0,
    13.0 * _N**2 / 48.0 - 3.0 * _N**3 / 5.0 + 557.0 * _N**4 / 1440.0,
    61.0 * _N**3 / 240.0 - 103.0 * _N**4 / 140.0,
    49561.0 * _N**4 / 161280.0,
)


def to_utm(degrees: FloatArray, *, zone: int, is_south: bool) -> FloatArray:
    """East and north (P, 2) in metres.

    Args:
        degrees: Longitude and latitude (P, 2).
        zone: 1 to 60.
        is_south: Whether it is a zone of the southern hemisphere.
    """
    longitude = np.radians(degrees[:, 0] - (6.0 * zone - 183.0))
    sine = np.sin(np.radians(degrees[:, 1]))
    conformal = np.sinh(np.arctanh(sine) - _E * np.arctanh(_E * sine))
    xi = np.arctan2(conformal, np.cos(longitude))
    eta = np.arcsinh(np.sin(longitude) / np.hypot(conformal, np.cos(longitude)))
    north, east = xi.copy(), eta.copy()
    for order, alpha in enumerate(_ALPHA, start=1):
        north += alpha * np.sin(2.0 * order * xi) * np.cosh(2.0 * order * eta)
        east += alpha * np.cos(2.0 * order * xi) * np.sinh(2.0 * order * eta)
    return np.column_stack(
        [
            FALSE_EAST_M + SCALE * _RADIUS_M * east,
            (FALSE_NORTH_M if is_south else 0.0) + SCALE * _RADIUS_M * north,
        ]
    )


_ENVELOPE_BYTES = (0, 32, 48, 48, 64)
GEOGRAPHIC = 4326


class Layers:
    """The layers of a map."""

    def __init__(self, tables: Tables, center_m: FloatArray, reach_m: float) -> None:
        """The layers, of which only what lies near a point is read.

        Args:
            tables: Of the map.
            center_m: The point (2,) in the map's projected coordinate system.
            reach_m: What is further in a direction of the compass is passed over.
        """
        self._tables = tables
        self._zone, self._is_south = _zone(tables)
        self._low, self._high = center_m - reach_m, center_m + reach_m
        tables.need("gpkg_geometry_columns", ("table_name", "column_name", "srs_id"))
        self._geometry = {
            str(table): (str(column), int(srs))
            for table, column, srs in tables.rows(
                "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns"
            )
            if isinstance(srs, int)
        }

    def has(self, layer: str) -> bool:
        """Whether there is such a layer."""
        return layer in self._geometry and self._tables.has(layer)

    def read(self, layer: str, columns: tuple[str, ...]) -> Iterator[tuple[Any, FloatArray]]:
        """Each near feature's named columns as a tuple, and its points.

        Of several parts, the longest; of a polygon, its outline.

        Raises:
            InvalidDocument: The layer or a column is not there, or a geometry is broken.
        """
        if layer not in self._geometry:
            raise InvalidDocument(WHAT, [("map", f"has no layer {layer!r}")])
        geometry, srs = self._geometry[layer]
        if srs not in (GEOGRAPHIC, (32700 if self._is_south else 32600) + self._zone):
            raise InvalidDocument(WHAT, [(layer, f"is in EPSG:{srs}, which is not read")])
        self._tables.need(layer, (*columns, geometry))
        names = ", ".join(_quoted(name) for name in (*columns, geometry))
        rows = self._tables.rows(
            f"SELECT {names} FROM {_quoted(layer)} WHERE {_quoted(geometry)} IS NOT NULL"
        )
        lines = self._lines([row[-1] for row in rows], srs, layer)
        for row, points in zip(rows, lines, strict=True):
            if (points.min(axis=0) <= self._high).all() and (
                points.max(axis=0) >= self._low
            ).all():
                yield row[:-1], points

    def _lines(self, blocks: list[Any], srs: int, layer: str) -> list[FloatArray]:
        """The points (P, 2) of each geometry; all of a layer are projected in one go."""
        if not blocks:
            return []
        try:
            geometries = shapely.from_wkb([_well_known_binary(block) for block in blocks])
            lines = [_longest_line(geometry) for geometry in geometries]
        except (ValueError, shapely.errors.ShapelyError) as fault:
            raise InvalidDocument(WHAT, [(layer, f"has a broken geometry: {fault}")]) from None
        points, owners = shapely.get_coordinates(lines, return_index=True)
        if not np.isfinite(points).all():
            raise InvalidDocument(WHAT, [(layer, "has a point that is not finite")])
        if srs == GEOGRAPHIC:
            if (np.abs(points) > (180.0, 89.0)).any():
                raise InvalidDocument(WHAT, [(layer, "has degrees that are none")])
            points = to_utm(points, zone=self._zone, is_south=self._is_south)
        return np.split(points, np.flatnonzero(np.diff(owners)) + 1)


# Private


def _quoted(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _zone(tables: Tables) -> tuple[int, bool]:
    tables.need("meta", ("key", "value"))
    rows = tables.rows("SELECT value FROM meta WHERE key = 'projectedCoordSystem'")
    text = str(rows[0][0]) if rows else ""
    code = text.rsplit(":", 1)[-1].strip()
    if code.isdecimal() and len(code) == 5:
        hemisphere, zone = divmod(int(code), 100)
        if hemisphere in (326, 327) and 1 <= zone <= 60:
            return zone, hemisphere == 327
    raise InvalidDocument(
        WHAT, [("meta.projectedCoordSystem", f"{text[:40]!r} is no UTM zone as EPSG:326xx")]
    )


def _well_known_binary(block: Any) -> bytes:
    """The geometry without the header that a GeoPackage puts before it."""
    if not isinstance(block, bytes) or block[:2] != b"GP" or len(block) < 8:
        raise ValueError("does not begin with GP")
    envelope = block[3] >> 1 & 7
    if envelope >= len(_ENVELOPE_BYTES) or block[3] & 0x10:
        raise ValueError("is empty, or has an unknown envelope")
    return block[8 + _ENVELOPE_BYTES[envelope] :]


def _longest_line(geometry: Any) -> Any:
    """The longest part of a line, or the longest outline of a polygon.

    Raises:
        ValueError: It is neither, or has no points.
    """
    parts = [
        part.exterior if part.geom_type == "Polygon" else part
        for part in shapely.get_parts(geometry).tolist()
    ]
    line = max(parts, key=shapely.get_num_coordinates, default=geometry)
    if line.is_empty or line.geom_type not in ("LineString", "LinearRing"):
        raise ValueError(f"a {line.geom_type} is not read")
    return line


BICYCLE_LANE = 1
TURN_OF = {0: TurnType.STRAIGHT, 1: TurnType.LEFT, 2: TurnType.RIGHT, 3: TurnType.U_TURN}
AREA_OF = {
    "intersections": AreaKind.INTERSECTION,
    "crosswalks": AreaKind.CROSSWALK,
    "walkways": AreaKind.WALKWAY,
    "carpark_areas": AreaKind.CARPARK,
    "generic_drivable_areas": AreaKind.DRIVABLE,
    "road_segments": AreaKind.DRIVABLE,
}
ROADBLOCKS = ("lane_groups_polygons", "lane_group_connectors")
MOST_NAMED = 100
LEFT_HAND = "sg-"
BESIDE_M = 50.0
"""Edges of a lane and what names it lie no further from its centreline than this."""


@dataclass(slots=True)
class _Count:
    turned: int = 0
    corrected: int = 0
    assumed: int = 0
    bicycle_lanes: int = 0


def city_around(
    path: Path,
    *,
    location: str,
    center_m: tuple[float, float],
    lights: dict[int, TrafficLight],
    route: tuple[str, ...] = (),
) -> RoadMap:
    """What of the map lies within reach of a point.

    Args:
        path: The map.gpkg.
        location: The city, such as "sg-one-north".
        center_m: The point in UTM.
        lights: The state by the feature id of the connector.
        route: Ids of the roadblocks that the mission leads over.

    Raises:
        InvalidDocument: The map is not there or breaks its format.
    """
    center, count = np.array(center_m), _Count()
    with open_tables(path) as tables:
        layers = Layers(tables, center, RADIUS_M + BESIDE_M)
        lines = _centerlines(layers, center)
        edges: dict[str | None, FloatArray] = {
            _name(fid): points for (fid,), points in layers.read("boundaries", ("fid",))
        }
        segments = [
            *_lanes(layers, lines, edges, count),
            *_connectors(layers, lines, edges, lights, count),
        ]
        blocks = {
            str(fid)
            for layer in ROADBLOCKS
            if route and tables.has(layer)
            for (fid,) in tables.rows(f"SELECT fid FROM {layer}")
        }
        areas = tuple(
            (kind, points)
            for layer, kind in AREA_OF.items()
            if layers.has(layer)
            for _, points in layers.read(layer, ("fid",))
            if _is_near(points, center) and len(np.unique(points, axis=0)) >= 3
        )
    return RoadMap(
        what=WHAT,
        place=path.name,
        segments=tuple(_with_neighbors(segments)),
        areas=areas,
        side=TrafficSide.LEFT if _is_left_hand(path, location) else TrafficSide.RIGHT,
        notes=(*_notes([one for one, *_ in segments], count), *_route_notes(route, blocks)),
    )


# Private


def _is_left_hand(path: Path, location: str) -> bool:
    """By the city that the map lies under, too: logs differ in what they call theirs."""
    return location.startswith(LEFT_HAND) or path.parent.parent.name.startswith(LEFT_HAND)


def _is_near(points: FloatArray, center: FloatArray) -> bool:
    local = points - center
    gap = np.maximum(np.maximum(local.min(axis=0), -local.max(axis=0)), 0.0)
    return bool(np.hypot(*gap) <= RADIUS_M)


def _centerlines(layers: Layers, center: FloatArray) -> dict[str, FloatArray]:
    """Those within reach, by the segment's name."""
    lines = {}
    columns = ("lane_fid", "lane_connector_fid")
    for (lane, connector), points in layers.read("baseline_paths", columns):
        if _is_near(points, center):
            if lane is None and connector is None:
                continue  # a path of neither, which nothing refers to
            lines[_name(lane) if lane is not None else _connector_name(connector)] = points
    return lines


def _name(fid: Any) -> str:
    """Of a whole number, or of its digits as text.

    Raises:
        InvalidDocument: It is none.
    """
    text = str(int(fid) if isinstance(fid, float) and fid.is_integer() else fid)
    if not isinstance(fid, int | float | str) or not text.isdecimal() or len(text) > 18:
        raise InvalidDocument(WHAT, [("map", f"{text[:40]!r} is no feature id")])
    return f"{int(text):09d}"


def _name_or_none(fid: Any) -> str | None:
    return None if fid is None or fid == "" else _name(fid)


def _named(fid: Any) -> tuple[str, ...]:
    name = _name_or_none(fid)
    return () if name is None else (name,)


def _connector_name(fid: Any) -> str:
    return f"c{_name(fid)}"


def _lanes(
    layers: Layers,
    lines: dict[str, FloatArray],
    edges: dict[str | None, FloatArray],
    count: _Count,
) -> list[tuple[Segment, Any, Any]]:
    """Segments with the group and the place in it, by which neighbours are found."""
    made = []
    columns = ("fid", "lane_group_fid", "lane_index", "left_boundary_fid", "right_boundary_fid")
    more = ("speed_limit_mps", "lane_type_fid")
    for values, _ in layers.read("lanes_polygons", (*columns, *more)):
        fid, group, index, left, right, limit, kind = values
        line = lines.get(_name(fid))
        if line is None:
            continue
        if kind == BICYCLE_LANE:
            count.bicycle_lanes += 1
            continue
        both = edges.get(_name_or_none(left)), edges.get(_name_or_none(right))
        segment = _segment(_name(fid), line, both, count)
        made.append((replace(segment, speed_limit_mps=_limit(limit)), group, index))
    return made


def _connectors(
    layers: Layers,
    lines: dict[str, FloatArray],
    edges: dict[str | None, FloatArray],
    lights: dict[int, TrafficLight],
    count: _Count,
) -> list[tuple[Segment, Any, Any]]:
    sides: dict[str | None, list[Any]] = {}
    areas = "gen_lane_connectors_scaled_width_polygons"
    if layers.has(areas):
        named = ("lane_connector_fid", "left_boundary_fid", "right_boundary_fid")
        sides = {_name_or_none(fid): pair for (fid, *pair), _ in layers.read(areas, named)}
    made = []
    columns = ("fid", "exit_lane_fid", "entry_lane_fid", "turn_type_fid", "speed_limit_mps")
    for values, own in layers.read("lane_connectors", (*columns, "traffic_light_stop_line_fids")):
        fid, before, after, turn, limit, stop_lines = values
        if _connector_name(fid) not in lines:
            continue
        line = lines.get(_connector_name(fid), own)
        left, right = sides.get(_name(fid), (None, None))
        both = edges.get(_name_or_none(left)), edges.get(_name_or_none(right))
        segment = _segment(_connector_name(fid), line, both, count)
        dark = TrafficLight.UNKNOWN if str(stop_lines or "").strip() else TrafficLight.NONE
        segment = replace(
            segment,
            crosses=True,
            predecessors=_named(before),
            successors=_named(after),
            speed_limit_mps=_limit(limit),
            light=lights.get(int(_name(fid)), dark),
            turn=_turn(line, turn, count),
        )
        made.append((segment, None, None))
    return made


def _segment(
    name: str, line: FloatArray, edges: tuple[FloatArray | None, FloatArray | None], count: _Count
) -> Segment:
    """With its boundaries in the direction of travel; some run against it in the source."""
    both = []
    for edge in edges:
        if edge is not None and _runs_against(edge, line):
            edge = edge[::-1]
            count.turned += 1
        both.append(edge)
    if both[0] is None or both[1] is None:
        count.assumed += 1
        return Segment(name=name, centerline=line, width_m=USUAL_M)
    return Segment(name=name, centerline=line, left=both[0], right=both[1])


def _runs_against(edge: FloatArray, line: FloatArray) -> bool:
    along = np.hypot(*(edge[0] - line[0])) + np.hypot(*(edge[-1] - line[-1]))
    against = np.hypot(*(edge[0] - line[-1])) + np.hypot(*(edge[-1] - line[0]))
    return bool(against < along)


def _limit(value: Any) -> float | None:
    """NULL and NaN are both no limit."""
    if not isinstance(value, int | float) or not math.isfinite(value) or not 0.0 < value <= 100.0:
        return None
    return float(value)


def _turn(line: FloatArray, code: Any, count: _Count) -> TurnType:
    try:
        shape = turn_type_of(Polyline(line))
    except ValueError:
        return TurnType.STRAIGHT  # it is refused where the road is built
    if code in TURN_OF and TURN_OF[code] is not shape:
        count.corrected += 1
    return shape


def _with_neighbors(found: list[tuple[Segment, Any, Any]]) -> list[Segment]:
    """Lanes of one group lie side by side; their index rises to the right."""
    places = {(group, index): one.name for one, group, index in found if group is not None}
    made = []
    for one, group, index in found:
        if group is not None and isinstance(index, int):
            left, right = places.get((group, index - 1)), places.get((group, index + 1))
            one = replace(
                one,
                left_neighbors=() if left is None else (left,),
                right_neighbors=() if right is None else (right,),
            )
        made.append(one)
    return made


def _route_notes(route: tuple[str, ...], blocks: set[str]) -> Iterator[Note]:
    """The route; some of the data set name roadblocks that their map does not have."""
    if route:
        yield Note(kind=SceneNoteKind.ROUTE, number=len(route), names=route[:MOST_NAMED])
    missing = tuple(one for one in route if one not in blocks)
    if blocks and missing:
        yield Note(
            kind=SceneNoteKind.ROUTE_NOT_IN_MAP,
            number=len(missing),
            of=len(route),
            names=missing[:MOST_NAMED],
        )


def _notes(segments: Sequence[Segment], count: _Count) -> Iterator[Note]:
    yield from limit_notes(segments)
    yield from count_notes(
        {
            SceneNoteKind.BOUNDARIES_TURNED: count.turned,
            SceneNoteKind.TURN_TYPES_CORRECTED: count.corrected,
            SceneNoteKind.BICYCLE_LANES_LEFT_OUT: count.bicycle_lanes,
        }
    )
    if count.assumed:
        kind = SceneNoteKind.LANE_WIDTHS_ASSUMED
        yield Note(kind=kind, number=count.assumed, of=len(segments), value=USUAL_M)
