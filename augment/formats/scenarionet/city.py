"""The map of a scenario description as segments and areas. World frame of the file."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.road_map import (
    FURTHEST_M,
    NARROWEST_M,
    USUAL_M,
    WIDEST_M,
    FloatArray,
    RoadMap,
    Segment,
    count_notes,
    crossing_segments,
    edge_of,
    left_out_notes,
    limit_notes,
    take_end_widths,
    width_of,
)
from augment.formats.scenarionet.unpickling import WHAT
from augment.scene.entities import AreaKind, TrafficLight, TrafficSide
from augment.scene.recording import Note, SceneNoteKind

CONNECTOR = "LANE_SURFACE_UNSTRUCTURE"
LANES = frozenset(
    {"LANE_SURFACE_STREET", "LANE_FREEWAY", "LANE_UNKNOWN", "LANE_BUS_LANE", CONNECTOR}
)
BICYCLE_LANE = "LANE_BIKE_LANE"
AREA_OF = {
    "CROSSWALK": AreaKind.CROSSWALK,
    "ROAD_EDGE_SIDEWALK": AreaKind.WALKWAY,
    "BOUNDARY_SIDEWALK": AreaKind.WALKWAY,
    "SIDEWALK": AreaKind.WALKWAY,
    "DRIVEWAY": AreaKind.DRIVABLE,
}
PASSED_OVER = ("ROAD_LINE_", "ROAD_EDGE_", "BOUNDARY_")
"""Lines on the road and along it, which are no part of a scene."""
MEANINGLESS_KMH = 100.0
"""What converters from nuScenes write for every connector."""
LEFT_HAND = ("singapore", "sg-", "sg_")
_LIGHTS = {
    "GO": TrafficLight.GREEN,
    "GREEN": TrafficLight.GREEN,
    "CAUTION": TrafficLight.YELLOW,
    "YELLOW": TrafficLight.YELLOW,
    "STOP": TrafficLight.RED,
    "RED": TrafficLight.RED,
    "UNKNOWN": TrafficLight.UNKNOWN,
}


def points_of(value: object, place: str) -> FloatArray:
    """The points (P, 2) of a line or polygon; what lies in z is left.

    Raises:
        InvalidDocument: They are none.
    """
    if isinstance(value, list):
        try:
            value = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            value = None
    if not isinstance(value, np.ndarray) or value.ndim != 2 or value.shape[1] not in (2, 3):
        raise InvalidDocument(WHAT, [(place, "needs points of two or three numbers")])
    if value.dtype.kind not in "iuf":
        raise InvalidDocument(WHAT, [(place, "needs numbers")])
    if not (np.abs(value) <= FURTHEST_M).all():
        raise InvalidDocument(WHAT, [(place, f"needs finite numbers up to {FURTHEST_M:.0e}")])
    return np.asarray(value[:, :2], dtype=np.float64)


def city_of(description: dict[str, Any], frame: int, *, place_name: str) -> RoadMap:
    """The map with the lights of one step.

    Raises:
        InvalidDocument: A feature breaks the format.
    """
    features = description["map_features"]
    lights = _lights(description.get("dynamic_map_states") or {}, frame)
    lanes, areas = {}, []
    left_out: Counter[str] = Counter()
    for key, feature in features.items():
        kind = feature.get("type") if isinstance(feature, dict) else None
        if not isinstance(kind, str):
            raise InvalidDocument(WHAT, [(f"map_features.{key}", "needs a type")])
        if kind in LANES:
            lanes[str(key)] = feature
        elif kind in AREA_OF and feature.get("polygon") is not None:
            ring = points_of(feature["polygon"], f"map_features.{key}")
            if len(np.unique(ring, axis=0)) >= 3:
                areas.append((AREA_OF[kind], ring))
        elif not kind.startswith(PASSED_OVER):
            left_out[kind] += 1
    meaningless = {key for key, lane in lanes.items() if _is_meaningless(lane, lanes)}
    built = [_segment(key, lane, key in meaningless, lights) for key, lane in lanes.items()]
    if not any(lane.get("type") == CONNECTOR for lane in lanes.values()):
        crossing = crossing_segments({one.name: one for one, _ in built})
        built = [
            (replace(one, crosses=one.crosses or one.name in crossing), was_assumed)
            for one, was_assumed in built
        ]
    segments, assumed = take_end_widths(
        [one for one, _ in built], {one.name for one, was_assumed in built if was_assumed}
    )
    side, is_told = _side(description["metadata"], place_name)
    return RoadMap(
        what=WHAT,
        place="map_features",
        segments=segments,
        areas=tuple(areas),
        side=side,
        is_side_told=is_told,
        notes=tuple(_notes(segments, areas, assumed, len(meaningless), bool(lights), left_out)),
    )


# Private


def _side(metadata: dict[str, Any], place_name: str) -> tuple[TrafficSide, bool]:
    """Where people drive, and whether the metadata tell it, as our own writer's alone do."""
    told = metadata.get("traffic_side")
    if told in ("left", "right"):
        return TrafficSide(told), True
    is_left = place_name.lower().startswith(LEFT_HAND)
    return TrafficSide.LEFT if is_left else TrafficSide.RIGHT, False


def _is_meaningless(lane: dict[str, Any], lanes: dict[str, dict[str, Any]]) -> bool:
    """Whether a connector has the constant of the converters, as every other one has."""
    if lane.get("type") != CONNECTOR or lane.get("speed_limit_kmh") != MEANINGLESS_KMH:
        return False
    return not any(
        one.get("speed_limit_kmh") for one in lanes.values() if one.get("type") != CONNECTOR
    )


def _segment(
    key: str, lane: dict[str, Any], is_meaningless: bool, lights: dict[str, TrafficLight]
) -> tuple[Segment, bool]:
    place = f"map_features.{key}"
    line = points_of(lane.get("polyline"), place)
    width_m = _width(lane, line, place)
    limit = None if is_meaningless else _limit_mps(lane)
    crosses = lane.get("type") == CONNECTOR or lane.get("interpolating") is True or key in lights
    segment = Segment(
        name=key,
        crosses=crosses,
        centerline=line,
        width_m=width_m or USUAL_M,
        successors=_names(lane.get("exit_lanes")),
        predecessors=_names(lane.get("entry_lanes")),
        left_neighbors=_names(lane.get("left_neighbor")),
        right_neighbors=_names(lane.get("right_neighbor")),
        speed_limit_mps=limit,
        light=lights.get(key, TrafficLight.UNKNOWN),
    )
    return segment, width_m is None


def _names(value: object) -> tuple[str, ...]:
    """Ids of lanes, given as such or as dictionaries with one."""
    if not isinstance(value, list):
        return ()
    names = [one.get("feature_id") if isinstance(one, dict) else one for one in value]
    return tuple(str(name) for name in names if isinstance(name, str | int))


def _width(lane: dict[str, Any], line: FloatArray, place: str) -> float | None:
    """The widths that the file gives, else of the lane's polygon: where it is cut across."""
    given = lane.get("width")
    if isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == 2:
        widths = given.sum(axis=1)
        known = widths[(widths >= NARROWEST_M) & (widths <= WIDEST_M)]
        if len(known):
            return float(np.median(known))
    if lane.get("polygon") is None:
        return None
    ring = points_of(lane["polygon"], place)
    left, right = _sides(ring, line)
    if len(left) < 2 or len(right) < 2:
        return None
    whole = [(0, len(line), side) for side in (left, right)]
    inner = line[len(line) // 4 : max(3 * len(line) // 4, len(line) // 4 + 1)]
    return width_of(inner, edge_of(inner, whole[:1]), edge_of(inner, whole[1:]))


def _sides(ring: FloatArray, line: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The points of a lane's outline to the left and to the right of its middle."""
    if len(line) < 2:
        return ring[:0], ring[:0]
    steps = np.diff(line, axis=0)
    nearest = np.hypot(*np.moveaxis(ring[:, None] - line[:-1], 2, 0)).argmin(axis=1)
    offset = ring - line[nearest]
    step = steps[nearest]
    side = step[:, 0] * offset[:, 1] - step[:, 1] * offset[:, 0]
    along = np.argsort(nearest, kind="stable")
    return ring[along][side[along] > 0.0], ring[along][side[along] < 0.0]


def _limit_mps(lane: dict[str, Any]) -> float | None:
    for name, factor in (("speed_limit_kmh", 1.0 / 3.6), ("speed_limit_mph", 0.44704)):
        value = lane.get(name)
        if isinstance(value, list) and len(value) == 1:
            value = value[0]
        if isinstance(value, int | float) and 0.0 < float(value) <= 300.0:
            return round(float(value) * factor, 3)
    return None


def _lights(states: object, frame: int) -> dict[str, TrafficLight]:
    """The state by lane at a step."""
    if not isinstance(states, dict):
        raise InvalidDocument(WHAT, [("dynamic_map_states", "is no dictionary")])
    lights = {}
    for key, light in states.items():
        if not isinstance(light, dict):
            continue
        state = light.get("state")
        steps = state.get("object_state") if isinstance(state, dict) else None
        if isinstance(steps, np.ndarray):
            steps = steps.tolist()
        shown = steps[frame] if isinstance(steps, list) and frame < len(steps) else None
        word = str(shown or "UNKNOWN").rsplit("_", 1)[-1].upper()
        if word not in _LIGHTS:
            known = ", ".join(_LIGHTS)
            text = f"unknown state {str(shown)[:40]!r}; known endings: {known}"
            raise InvalidDocument(WHAT, [(f"dynamic_map_states.{key}", text)])
        lights[str(light.get("lane", key))] = _LIGHTS[word]
    return lights


def _notes(
    segments: Sequence[Segment],
    areas: Sequence[tuple[AreaKind, FloatArray]],
    assumed: int,
    meaningless: int,
    has_lights: bool,
    left_out: Counter[str],
) -> Iterator[Note]:
    if meaningless:
        kind = SceneNoteKind.SPEED_LIMITS_IGNORED
        yield Note(kind=kind, number=meaningless, value=round(MEANINGLESS_KMH / 3.6, 1))
    yield from limit_notes(segments)
    if assumed:
        kind = SceneNoteKind.LANE_WIDTHS_ASSUMED
        yield Note(kind=kind, number=assumed, of=len(segments), value=USUAL_M)
    kinds = {kind for kind, _ in areas}
    known = {
        SceneNoteKind.NO_CONNECTIVITY: any(one.successors or one.predecessors for one in segments),
        SceneNoteKind.NO_INTERSECTIONS: any(one.crosses for one in segments),
        SceneNoteKind.NO_LIGHTS: has_lights,
        SceneNoteKind.NO_WALKWAYS: AreaKind.WALKWAY in kinds,
        SceneNoteKind.NO_DRIVABLE_AREAS: AreaKind.DRIVABLE in kinds,
    }
    yield from (Note(kind=kind) for kind, is_known in known.items() if not is_known)
    bicycle_lanes = left_out.pop(BICYCLE_LANE, 0)
    yield from count_notes({SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes})
    yield from left_out_notes(SceneNoteKind.MAP_PARTS_LEFT_OUT, left_out)
