"""Geometries of a GeoPackage layer, in the metres of the map's projected coordinate system.

A geometry is the letters GP, a version, flags, the id of its reference system, an envelope and
well-known binary; what is in longitude and latitude is projected to the zone that `meta` names.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan.mercator import FloatArray, from_utm, to_utm
from augment.formats.nuplan.sqlite import WHAT, Tables

_ENVELOPE_BYTES = (0, 32, 48, 48, 64)
GEOGRAPHIC = 4326
SHORTEST_DEGREE_M = 110_000.0
"""A degree of latitude is nowhere shorter; one of longitude by the cosine of the latitude."""


@dataclass(frozen=True, slots=True, eq=False)
class Rectangle:
    """A rectangle between two corners (2,)."""

    low: FloatArray
    high: FloatArray

    def meets(self, low: FloatArray, high: FloatArray) -> bool:
        """Whether another lies in it or across its edge; one with NaN counts as near."""
        return not bool((low > self.high).any() or (high < self.low).any())


class Layers:
    """The layers of a map."""

    def __init__(self, tables: Tables, center_m: FloatArray, reach_m: float) -> None:
        """The layers, of which only what may lie near a point is read.

        Args:
            tables: Of the map.
            center_m: The point (2,) in the map's projected coordinate system.
            reach_m: What is further in a direction of the compass is passed over.
        """
        self._tables = tables
        self._zone, self._is_south = _zone(tables)
        self._box_m = Rectangle(center_m - reach_m, center_m + reach_m)
        self._box_deg = self._in_degrees(center_m, reach_m)
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
        names = ", ".join(f'"{name}"' for name in (*columns, geometry))
        table, column = _quoted(layer), _quoted(geometry)
        box = self._box_deg if srs == GEOGRAPHIC else self._box_m
        for *values, block in self._tables.each(
            f"SELECT {names} FROM {table} WHERE {column} IS NOT NULL"
        ):
            points = _points(block, layer, box)
            if points is not None and box.meets(points.min(axis=0), points.max(axis=0)):
                yield tuple(values), self._projected(points, srs, layer)

    def _in_degrees(self, center_m: FloatArray, reach_m: float) -> Rectangle:
        zone, is_south = self._zone, self._is_south
        east_m, north_m = center_m.tolist()
        longitude, latitude = from_utm(east_m, north_m, zone=zone, is_south=is_south)
        center = np.array([longitude, latitude])
        reach = reach_m / SHORTEST_DEGREE_M * np.array([1.0, 1.0])
        reach[0] /= max(np.cos(np.radians(latitude)), 0.05)
        return Rectangle(center - reach, center + reach)

    def _projected(self, points: FloatArray, srs: int, layer: str) -> FloatArray:
        if srs != GEOGRAPHIC:
            return points
        if (np.abs(points) > (180.0, 89.0)).any():
            raise InvalidDocument(WHAT, [(layer, "has degrees that are none")])
        return to_utm(points, zone=self._zone, is_south=self._is_south)


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


def _points(block: Any, layer: str, box: Rectangle) -> FloatArray | None:
    """The points of the longest part; None where the envelope says that all lie far away."""
    try:
        if not isinstance(block, bytes) or block[:2] != b"GP":
            raise ValueError("has a geometry that does not begin with GP")
        envelope = block[3] >> 1 & 7
        if envelope >= len(_ENVELOPE_BYTES) or block[3] & 0x10:
            raise ValueError("has an empty geometry, or one with an unknown envelope")
        if envelope:
            order = "<" if block[3] & 1 else ">"
            edges = np.frombuffer(block, dtype=f"{order}f8", count=4, offset=8)
            if not box.meets(edges[0::2], edges[1::2]):
                return None
        parts, _ = _read(block, 8 + _ENVELOPE_BYTES[envelope], 0)
        points = max(parts, key=len)
    except (ValueError, IndexError, struct.error) as fault:
        raise InvalidDocument(WHAT, [(layer, f"has a broken geometry: {fault}")]) from None
    if not np.isfinite(points).all():
        raise InvalidDocument(WHAT, [(layer, "has a point that is not finite")])
    return points


def _read(block: bytes, place: int, depth: int) -> tuple[list[FloatArray], int]:
    """The lines of a geometry, and where it ends."""
    order = "<" if block[place] == 1 else ">"
    (code,) = struct.unpack_from(f"{order}I", block, place + 1)
    place += 5
    if code >= 4000:
        raise ValueError(f"geometry kind {code} is not read")
    kind, size = code % 1000, (2, 3, 3, 4)[code // 1000]
    (count,) = struct.unpack_from(f"{order}I", block, place)
    if kind == 2:
        return _line(block, place, order, size)
    if kind == 3:
        place += 4
        rings = []
        for _ in range(count):
            lines, place = _line(block, place, order, size)
            rings += lines
        return rings[:1] if rings else [], place
    if kind in (5, 6) and depth == 0:
        place += 4
        parts = []
        for _ in range(count):
            lines, place = _read(block, place, depth + 1)
            parts += lines
        return parts, place
    raise ValueError(f"geometry kind {kind} is not read")


def _line(block: bytes, place: int, order: str, size: int) -> tuple[list[FloatArray], int]:
    (count,) = struct.unpack_from(f"{order}I", block, place)
    place += 4
    end = place + 8 * size * count
    if end > len(block) or count < 2:
        raise ValueError("a line is cut off, or has too few points")
    numbers = np.frombuffer(block, dtype=f"{order}f8", count=size * count, offset=place)
    return [numbers.reshape(count, size)[:, :2].astype(np.float64)], end
