"""The map of a nuPlan city as segments and areas, in its UTM zone: a GeoPackage.

A lane's id is its feature id; connectors have ids of their own, so their names begin with c. What
the columns of lane_connectors call the exit lane is the one that a connector comes from. A
geometry is the letters GP, a version, flags, the id of its reference system, an envelope and
well-known binary; what is in longitude and latitude is projected to the zone that `meta` names.
"""

import math
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np
import shapely

from augment.foreign import Doubts, FloatArray, fault_at, read_speed, read_whole
from augment.formats.road_map import RoadMap, Segment
from augment.formats.roads import is_far
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide

BICYCLE_LANE = 1
AREA_OF = {
    "intersections": AreaKind.INTERSECTION,
    "crosswalks": AreaKind.CROSSWALK,
    "walkways": AreaKind.WALKWAY,
    "carpark_areas": AreaKind.CARPARK,
    "generic_drivable_areas": AreaKind.DRIVABLE,
    "road_segments": AreaKind.DRIVABLE,
}
LEFT_HAND = "sg-"
REACH_M = 500.0
"""What is read, whatever of it a scene keeps: 30 s at the 16.7 m/s that cities allow."""
BESIDE_M = 50.0
"""Edges of a lane and what names it lie no further from its centreline than this."""
GEOGRAPHIC = 4326
_ENVELOPE_BYTES = (0, 32, 48, 48, 64)
_EDGES = ("left_boundary_fid", "right_boundary_fid")


@contextmanager
def open_tables(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a database that somebody else made for reading alone.

    Raises:
        InvalidDocument: It is not there or no database, or has not what the block asks it for.
    """
    if not path.is_file():
        raise fault_at(str(path), "is not there")
    address = f"file:{quote(str(path.resolve()))}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(address, uri=True)) as base:
            base.execute("PRAGMA trusted_schema = OFF")
            yield base
    except (sqlite3.Error, UnicodeDecodeError) as fault:
        raise fault_at(path.name, f"can't be read as a database: {fault}") from None


def city_around(
    path: Path, *, location: str, center_m: FloatArray, lights: Mapping[int, TrafficLight]
) -> RoadMap:
    """Return the part of the map within reach of a point.

    Args:
        path: The map.gpkg.
        location: The city, such as "sg-one-north".
        center_m: The point in UTM.
        lights: The state by the feature id of the connector.

    Raises:
        InvalidDocument: The map is not there or breaks its format.
    """
    with open_tables(path) as base:
        layers = _Layers(base, center_m)
        lanes, bicycle_lanes = _lanes(layers)
        segments = (*lanes, *_connectors(layers, lights))
        areas = tuple(
            (kind, points)
            for layer, kind in AREA_OF.items()
            if layer in layers.geometry
            for _, points in layers.read(layer, ("fid",))
            if layers.is_near(points)
        )
    # Logs differ in what they call their city: the folder that the map lies in counts too.
    is_left = any(name.startswith(LEFT_HAND) for name in (location, path.parent.parent.name))
    return RoadMap(
        place=path.name,
        segments=segments,
        areas=areas,
        side=TrafficSide.LEFT if is_left else TrafficSide.RIGHT,
        left_out={"bicycle lanes": bicycle_lanes},
        doubts=layers.doubts,
    )


# Layers


class _Layers:
    """The layers of a map, of which only what lies near a point is read.

    Attributes:
        geometry: By layer its column of geometries, and the id of their reference system.
        lines: The centrelines within reach by their segment's name.
        edges: The boundaries by name.
        doubts: About features.
    """

    def __init__(self, base: sqlite3.Connection, center: FloatArray) -> None:
        self._base, self._center, self.doubts = base, center, Doubts()
        text = "SELECT value FROM meta WHERE key = 'projectedCoordSystem'"
        system = str((base.execute(text).fetchone() or ("",))[0])
        code = system.rsplit(":", 1)[-1].strip()
        self._system = int(code) if code.isdecimal() and len(code) == 5 else 0
        hemisphere, self._zone = divmod(self._system, 100)
        if hemisphere not in (326, 327) or not 1 <= self._zone <= 60:
            problem = f"{system[:40]!r} is no UTM zone as EPSG:326xx"
            raise fault_at("meta.projectedCoordSystem", problem)
        text = "SELECT table_name, column_name, srs_id FROM gpkg_geometry_columns"
        self.geometry = {table: (column, system) for table, column, system in base.execute(text)}
        self.edges, self.lines = dict[str, FloatArray](), dict[str, FloatArray]()
        for (fid,), points in self.read("boundaries", ("fid",)):
            with self.doubts.about("boundaries"):
                self.edges[_name(fid)] = points
        columns = ("lane_fid", "lane_connector_fid")
        for (lane, connector), points in self.read("baseline_paths", columns):
            with self.doubts.about("baseline paths"):
                if self.is_near(points):
                    self.lines[_name(lane) or f"c{_name(connector)}"] = points

    def read(self, layer: str, columns: tuple[str, ...]) -> Iterator[tuple[Any, FloatArray]]:
        """Yield each near feature's named columns as a tuple, and its points.

        Of several parts, the longest; of a polygon, its outline.
        """
        if layer not in self.geometry:
            raise fault_at("map", f"has no layer {layer!r}")
        geometry, system = self.geometry[layer]
        if system not in (GEOGRAPHIC, self._system):
            raise fault_at(layer, f"is in EPSG:{system}, which is not read")
        names = ", ".join(f"[{name}]" for name in (*columns, geometry))
        text = f"SELECT {names} FROM [{layer}] WHERE [{geometry}] IS NOT NULL"
        named, lines = [], []
        for *row, block in self._base.execute(text).fetchall():
            with self.doubts.about(layer):
                lines.append(_outline(block, system == GEOGRAPHIC, f"{layer} {row[0]}"))
                named.append(tuple(row))
        points, owners = shapely.get_coordinates(lines, return_index=True)
        if system == GEOGRAPHIC and len(points):
            points = to_utm(points, zone=self._zone, is_south=self._system >= 32700)
        parts = np.split(points, np.flatnonzero(np.diff(owners)) + 1) if len(points) else []
        for row, part in zip(named, parts, strict=True):
            if self.is_near(part, REACH_M + BESIDE_M):
                yield row, part

    def is_near(self, points: FloatArray, reach_m: float = REACH_M) -> bool:
        """Return whether the box around points lies within reach."""
        return not is_far(points - self._center, reach_m)


def _outline(block: Any, is_geographic: bool, place: str) -> Any:
    """The line of a feature.

    Raises:
        InvalidDocument: The geometry is broken.
    """
    try:
        envelope = block[3] >> 1 & 7 if isinstance(block, bytes) and len(block) >= 8 else 7
        if envelope >= len(_ENVELOPE_BYTES) or block[:2] != b"GP" or block[3] & 0x10:
            raise ValueError("does not begin with GP, is empty, or has an unknown envelope")
        line = _longest_line(shapely.from_wkb(block[8 + _ENVELOPE_BYTES[envelope] :]))
        points = shapely.get_coordinates(line)
        if not np.isfinite(points).all():
            raise ValueError("a point is not finite")
        if is_geographic and (np.abs(points) > (180.0, 89.0)).any():
            raise ValueError("degrees that are none")
    except (ValueError, shapely.errors.ShapelyError) as fault:
        raise fault_at(place, f"has a broken geometry: {fault}") from None
    return line


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


def _name(fid: Any) -> str:
    """Return the name from a whole number or its digits as text; empty for none."""
    return "" if fid in (None, "") else f"{read_whole(fid, 'map', 0):09d}"


def _lanes(layers: _Layers) -> tuple[list[Segment], int]:
    """Segments, and how many bicycle lanes are left out.

    Lanes of one group lie side by side, their index rises to the right.
    """
    lanes: dict[Any, Segment] = {}
    bicycle_lanes, doubts = 0, layers.doubts
    columns = ("fid", *_EDGES, "speed_limit_mps", "lane_group_fid", "lane_index", "lane_type_fid")
    for (fid, left, right, limit, group, index, kind), _ in layers.read("lanes_polygons", columns):
        with doubts.about("lanes"):
            name, place = _name(fid), f"lane {fid}"
            if name not in layers.lines:
                continue
            if doubts.read("types of lanes", read_whole, kind, place) == BICYCLE_LANE:
                bicycle_lanes += 1
            else:
                row = doubts.read("lane indices", read_whole, index, place)
                key = (name, None) if group is None or row is None else (group, row)
                lanes[key] = _segment(layers, name, (left, right), limit)

    def names_at(group: Any, index: int | None, step: int) -> tuple[Any, ...]:
        beside = None if index is None else lanes.get((group, index + step))
        return () if beside is None else (beside.name,)

    return [
        replace(
            lane,
            left_neighbors=names_at(group, index, -1),
            right_neighbors=names_at(group, index, 1),
        )
        for (group, index), lane in lanes.items()
    ], bicycle_lanes


def _connectors(layers: _Layers, lights: Mapping[int, TrafficLight]) -> Iterator[Segment]:
    areas = "gen_lane_connectors_scaled_width_polygons"
    sides, doubts = dict[str, tuple[Any, Any]](), layers.doubts
    if areas in layers.geometry:
        for (fid, left, right), _ in layers.read(areas, ("lane_connector_fid", *_EDGES)):
            with doubts.about("outlines of connectors"):
                sides[_name(fid)] = left, right
    columns = ("fid", "exit_lane_fid", "entry_lane_fid", "speed_limit_mps")
    for values, _ in layers.read("lane_connectors", (*columns, "traffic_light_stop_line_fids")):
        fid, before, after, limit, stop_lines = values
        with doubts.about("lane connectors"):
            name = f"c{_name(fid)}"
            ends = [doubts.read("ends of connectors", _name, end) for end in (before, after)]
            stops = [(stop,) for stop in str(stop_lines or "").replace(",", " ").split()]
            dark = TrafficLight.UNKNOWN if stops else TrafficLight.NONE
            doubts.read_all("stop lines", _name, stops)
            if name in layers.lines:
                edges = sides.get(_name(fid), (None, None))
                yield replace(
                    _segment(layers, name, edges, limit),
                    crosses=True,
                    predecessors=tuple(filter(None, ends[:1])),
                    successors=tuple(filter(None, ends[1:])),
                    light=lights.get(int(_name(fid)), dark),
                )


def _segment(layers: _Layers, name: str, edges: tuple[Any, Any], limit: Any) -> Segment:
    """With its boundaries in the direction of travel; some run against it in the source."""
    line, sides = layers.lines[name], []
    for fid in edges:
        edge = layers.edges.get(layers.doubts.read("boundaries", _name, fid) or "")
        if edge is not None:
            along = np.hypot(*(edge[0] - line[0])) + np.hypot(*(edge[-1] - line[-1]))
            against = np.hypot(*(edge[0] - line[-1])) + np.hypot(*(edge[-1] - line[0]))
            sides.append(edge[::-1] if against < along else edge)
    left, right = sides if len(sides) == 2 else (None, None)
    limit = None if isinstance(limit, float) and math.isnan(limit) else limit
    speed_mps = layers.doubts.read("speed limits", read_speed, limit, f"lane {name}")
    return Segment(name=name, centerline=line, left=left, right=right, speed_limit_mps=speed_mps)
