"""The map of a city as segments and areas, in its UTM zone.

A lane's id is its feature id; connectors have ids of their own, so their names begin with c. What
the columns of lane_connectors call the exit lane is the one that a connector comes from.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan_log import WHAT, open_tables
from augment.formats.nuplan_map import FloatArray, Layers
from augment.formats.road_map import USUAL_M, RoadMap, Segment, count_notes, limit_notes
from augment.formats.roads import RADIUS_M
from augment.geometry.polyline import Polyline
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide, TurnType
from augment.scene.lane_graph import turn_type_of
from augment.scene.recording import Note, SceneNoteKind

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
