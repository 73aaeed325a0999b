"""Geometries of a GeoPackage layer, in the metres of the map's projected coordinate system.

A geometry is the letters GP, a version, flags, the id of its reference system, an envelope and
well-known binary; what is in longitude and latitude is projected to the zone that `meta` names.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan_log import WHAT, Tables
from augment.formats.nuplan_map import FloatArray, to_utm

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
        import shapely

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
    import shapely

    parts = [
        part.exterior if part.geom_type == "Polygon" else part
        for part in shapely.get_parts(geometry).tolist()
    ]
    line = max(parts, key=shapely.get_num_coordinates, default=geometry)
    if line.is_empty or line.geom_type not in ("LineString", "LinearRing"):
        raise ValueError(f"a {line.geom_type} is not read")
    return line
