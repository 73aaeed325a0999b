"""The map of a nuPlan city as segments and areas, in its UTM zone: a GeoPackage.

A lane's id is its feature id; connectors have ids of their own, so their names begin with c. What
the columns of lane_connectors call the exit lane is the one that a connector comes from. A
geometry is the letters GP, a version, flags, the id of its reference system, an envelope and
well-known binary; what is in longitude and latitude is projected to the zone that `meta` names.
"""

import math
import sqlite3
from collections import Counter
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import shapely

from augment.errors import InvalidDocument
from augment.formats.road_map import FloatArray, RoadMap, Segment, fill_widths, map_notes
from augment.formats.roads import RADIUS_M
from augment.geometry.polyline import Polyline
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType
from augment.scene.lane_graph import turn_type_of
from augment.scene.recording import SceneNoteKind

WHAT = "nuPlan log"
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
LEFT_HAND = "sg-"
BESIDE_M = 50.0
"""Edges of a lane and what names it lie no further from its centreline than this."""
GEOGRAPHIC = 4326
_ENVELOPE_BYTES = (0, 32, 48, 48, 64)


@contextmanager
def open_tables(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a database that somebody else made for reading alone.

    Raises:
        InvalidDocument: It is not there or no database, or has not what the block asks it for.
    """
    if not path.is_file():
        raise InvalidDocument(WHAT, [(str(path), "is not there")])
    address = f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(address, uri=True)) as base:
            base.execute("PRAGMA trusted_schema = OFF")
            yield base
    except (sqlite3.Error, UnicodeDecodeError) as fault:
        problem = f"can't be read as a database: {fault}"
        raise InvalidDocument(WHAT, [(path.name, problem)]) from None


def city_around(
    path: Path, *, location: str, center_m: tuple[float, float], lights: dict[int, TrafficLight]
) -> RoadMap:
    """Return what of the map lies within reach of a point.

    Args:
        path: The map.gpkg.
        location: The city, such as "sg-one-north".
        center_m: The point in UTM.
        lights: The state by the feature id of the connector.

    Raises:
        InvalidDocument: The map is not there or breaks its format.
    """
    center, counts = np.array(center_m), Counter[SceneNoteKind]()
    with open_tables(path) as base:
        layers = _Layers(base, center)
        lines = _centerlines(layers, center)
        edges = {_name(fid): points for (fid,), points in layers.read("boundaries", ("fid",))}
        segments, assumed = fill_widths(
            [
                *_lanes(layers, lines, edges, counts),
                *_connectors(layers, lines, edges, lights, counts),
            ]
        )
        areas = tuple(
            (kind, points)
            for layer, kind in AREA_OF.items()
            if layer in layers.geometry
            for _, points in layers.read(layer, ("fid",))
            if _is_near(points, center) and len(np.unique(points, axis=0)) >= 3
        )
    # Logs differ in what they call their city: the folder that the map lies in counts too.
    is_left = any(name.startswith(LEFT_HAND) for name in (location, path.parent.parent.name))
    return RoadMap(
        what=WHAT,
        place=path.name,
        segments=segments,
        areas=areas,
        side=TrafficSide.LEFT if is_left else TrafficSide.RIGHT,
        notes=map_notes(segments, assumed=assumed, there={}, counts=counts, left_out={}),
    )


# Layers


class _Layers:
    """The layers of a map, of which only what lies near a point is read.

    Attributes:
        geometry: By layer its column of geometries, and the id of their reference system.
    """

    def __init__(self, base: sqlite3.Connection, center: FloatArray) -> None:
        self._base = base
        reach_m = RADIUS_M + BESIDE_M
        self._low, self._high = center - reach_m, center + reach_m
        text = "SELECT value FROM meta WHERE key = 'projectedCoordSystem'"
        system = str((base.execute(text).fetchone() or ("",))[0])
        code = system.rsplit(":", 1)[-1].strip()
        self._system = int(code) if code.isdecimal() and len(code) == 5 else 0
        hemisphere, self._zone = divmod(self._system, 100)
        if hemisphere not in (326, 327) or not 1 <= self._zone <= 60:
            problem = f"{system[:40]!r} is no UTM zone as EPSG:326xx"
            raise InvalidDocument(WHAT, [("meta.projectedCoordSystem", problem)])
        text = "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns"
        self.geometry = {table: (column, system) for table, column, system in base.execute(text)}

    def read(self, layer: str, columns: tuple[str, ...]) -> Iterator[tuple[Any, FloatArray]]:
        """Each near feature's named columns as a tuple, and its points.

        Of several parts, the longest; of a polygon, its outline.
        """
        if layer not in self.geometry:
            raise InvalidDocument(WHAT, [("map", f"has no layer {layer!r}")])
        geometry, system = self.geometry[layer]
        if system not in (GEOGRAPHIC, self._system):
            raise InvalidDocument(WHAT, [(layer, f"is in EPSG:{system}, which is not read")])
        names = ", ".join(f"[{name}]" for name in (*columns, geometry))
        text = f"SELECT {names} FROM [{layer}] WHERE [{geometry}] IS NOT NULL"
        rows = self._base.execute(text).fetchall()
        lines = self._lines([row[-1] for row in rows], system, layer)
        for row, points in zip(rows, lines, strict=True):
            is_beyond = (points.min(axis=0) > self._high) | (points.max(axis=0) < self._low)
            if not is_beyond.any():
                yield row[:-1], points

    def _lines(self, blocks: list[Any], system: int, layer: str) -> list[FloatArray]:
        """The points (P, 2) of each geometry; all of a layer are projected in one go."""
        if not blocks:
            return []
        try:
            geometries = shapely.from_wkb([_well_known_binary(block) for block in blocks])
            lines = [_longest_line(geometry) for geometry in geometries]
            points, owners = shapely.get_coordinates(lines, return_index=True)
            if not np.isfinite(points).all():
                raise ValueError("a point is not finite")
            if system == GEOGRAPHIC:
                if (np.abs(points) > (180.0, 89.0)).any():
                    raise ValueError("degrees that are none")
                points = to_utm(points, zone=self._zone, is_south=self._system >= 32700)
        except (ValueError, shapely.errors.ShapelyError) as fault:
            raise InvalidDocument(WHAT, [(layer, f"has a broken geometry: {fault}")]) from None
        return np.split(points, np.flatnonzero(np.diff(owners)) + 1)


def _well_known_binary(block: Any) -> bytes:
    """The geometry without the header that a GeoPackage puts before it."""
    if not isinstance(block, bytes) or block[:2] != b"GP" or len(block) < 8:
        raise ValueError("does not begin with GP")
    envelope = block[3] >> 1 & 7
    if envelope >= len(_ENVELOPE_BYTES) or block[3] & 0x10:
        raise ValueError("is empty, or has an unknown envelope")
    return block[8 + _ENVELOPE_BYTES[envelope] :]


def _longest_line(geometry: Any) -> Any:
    """The longest part of a line, or the longest outline of a polygon."""
    parts = [
        part.exterior if part.geom_type == "Polygon" else part
        for part in shapely.get_parts(geometry).tolist()
    ]
    line = max(parts, key=shapely.get_num_coordinates, default=geometry)
    if line.is_empty or line.geom_type not in ("LineString", "LinearRing"):
        raise ValueError(f"a {line.geom_type} is not read")
    return line


# Transverse Mercator of the WGS 84 ellipsoid by Krüger's series to the fourth order in the third
# flattening: within a micrometre inside a zone (Karney, J. Geodesy 85, 2011).

_F = 1.0 / 298.257223563
_N = _F / (2.0 - _F)
_E = math.sqrt(_F * (2.0 - _F))
_SCALED_RADIUS_M = 0.9996 * 6_378_137.0 / (1.0 + _N) * (1.0 + _N**2 / 4.0 + _N**4 / 64.0)
_ALPHA = (
    _N / 2.0 - 2.0 * _N**2 / 3.0 + 5.0 * _N**3 / 16.0 + 41.0 * _N**4 / 180.0,
    13.0 * _N**2 / 48.0 - 3.0 * _N**3 / 5.0 + 557.0 * _N**4 / 1440.0,
    61.0 * _N**3 / 240.0 - 103.0 * _N**4 / 140.0,
    49561.0 * _N**4 / 161280.0,
)


def to_utm(degrees: FloatArray, *, zone: int, is_south: bool) -> FloatArray:
    """Return east and north (P, 2) in metres.

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
    origin = (500_000.0, 10_000_000.0 if is_south else 0.0)
    return np.column_stack([east, north]) * _SCALED_RADIUS_M + origin


# Features


def _is_near(points: FloatArray, center: FloatArray) -> bool:
    local = points - center
    gap = np.maximum(np.maximum(local.min(axis=0), -local.max(axis=0)), 0.0)
    return bool(np.hypot(*gap) <= RADIUS_M)


def _centerlines(layers: _Layers, center: FloatArray) -> dict[str, FloatArray]:
    """Those within reach, by the segment's name; a path of neither is referred to by nothing."""
    lines = {}
    columns = ("lane_fid", "lane_connector_fid")
    for (lane, connector), points in layers.read("baseline_paths", columns):
        if _is_near(points, center) and lane is not None:
            lines[_name(lane)] = points
        elif _is_near(points, center) and connector is not None:
            lines[f"c{_name(connector)}"] = points
    return lines


def _name(fid: Any) -> str:
    """Of a whole number, or of its digits as text; empty for none.

    Raises:
        InvalidDocument: It is something else.
    """
    if fid is None or fid == "":
        return ""
    text = str(int(fid) if isinstance(fid, float) and fid.is_integer() else fid)
    if not isinstance(fid, int | float | str) or not text.isdecimal() or len(text) > 18:
        raise InvalidDocument(WHAT, [("map", f"{text[:40]!r} is no feature id")])
    return f"{int(text):09d}"


def _lanes(
    layers: _Layers,
    lines: dict[str, FloatArray],
    edges: dict[str, FloatArray],
    counts: Counter[SceneNoteKind],
) -> list[Segment]:
    """Segments; those of one group lie side by side, their index rises to the right."""
    made: dict[tuple[Any, Any], Segment] = {}
    columns = ("fid", "lane_group_fid", "lane_index", "left_boundary_fid", "right_boundary_fid")
    more = ("speed_limit_mps", "lane_type_fid")
    for values, _ in layers.read("lanes_polygons", (*columns, *more)):
        fid, group, index, left, right, limit, kind = values
        if _name(fid) not in lines:
            continue
        if kind == BICYCLE_LANE:
            counts[SceneNoteKind.BICYCLE_LANES_LEFT_OUT] += 1
            continue
        is_placed = group is not None and isinstance(index, int)
        place = (group, index) if is_placed else (None, _name(fid))
        sides = edges.get(_name(left)), edges.get(_name(right))
        made[place] = _segment(_name(fid), lines[_name(fid)], sides, limit, counts)
    return [
        replace(
            one,
            left_neighbors=() if group is None else _names_at(made, group, index - 1),
            right_neighbors=() if group is None else _names_at(made, group, index + 1),
        )
        for (group, index), one in made.items()
    ]


def _names_at(made: dict[tuple[Any, Any], Segment], group: Any, index: int) -> tuple[Any, ...]:
    return (made[group, index].name,) if (group, index) in made else ()


def _connectors(
    layers: _Layers,
    lines: dict[str, FloatArray],
    edges: dict[str, FloatArray],
    lights: dict[int, TrafficLight],
    counts: Counter[SceneNoteKind],
) -> Iterator[Segment]:
    sides: dict[str, list[Any]] = {}
    areas = "gen_lane_connectors_scaled_width_polygons"
    if areas in layers.geometry:
        named = ("lane_connector_fid", "left_boundary_fid", "right_boundary_fid")
        sides = {_name(fid): pair for (fid, *pair), _ in layers.read(areas, named)}
    columns = ("fid", "exit_lane_fid", "entry_lane_fid", "turn_type_fid", "speed_limit_mps")
    for values, _ in layers.read("lane_connectors", (*columns, "traffic_light_stop_line_fids")):
        fid, before, after, turn, limit, stop_lines = values
        name = f"c{_name(fid)}"
        if name not in lines:
            continue
        left, right = (edges.get(_name(side)) for side in sides.get(_name(fid), (None, None)))
        dark = TrafficLight.UNKNOWN if str(stop_lines or "").strip() else TrafficLight.NONE
        shape = _shape(lines[name])
        counts[SceneNoteKind.TURN_TYPES_CORRECTED] += TURN_OF.get(turn, shape) is not shape
        yield replace(
            _segment(name, lines[name], (left, right), limit, counts),
            crosses=True,
            predecessors=tuple(filter(None, [_name(before)])),
            successors=tuple(filter(None, [_name(after)])),
            light=lights.get(int(_name(fid)), dark),
            turn=shape,
        )


def _shape(line: FloatArray) -> TurnType:
    try:
        return turn_type_of(Polyline(line))
    except ValueError:
        return TurnType.STRAIGHT  # it is refused where the road is built


def _segment(
    name: str,
    line: FloatArray,
    edges: tuple[FloatArray | None, FloatArray | None],
    limit: Any,
    counts: Counter[SceneNoteKind],
) -> Segment:
    """With its boundaries in the direction of travel; some run against it in the source."""
    sides = []
    for edge in edges:
        if edge is None:
            continue
        along = np.hypot(*(edge[0] - line[0])) + np.hypot(*(edge[-1] - line[-1]))
        against = np.hypot(*(edge[0] - line[-1])) + np.hypot(*(edge[-1] - line[0]))
        counts[SceneNoteKind.BOUNDARIES_TURNED] += bool(against < along)
        sides.append(edge[::-1] if against < along else edge)
    left, right = sides if len(sides) == 2 else (None, None)
    # NULL and NaN are both no limit.
    has_limit = isinstance(limit, int | float) and 0.0 < limit <= 100.0
    limit_mps = float(limit) if has_limit else None
    return Segment(name=name, centerline=line, left=left, right=right, speed_limit_mps=limit_mps)
