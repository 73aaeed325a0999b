"""The map of a Waymo scenario as segments and areas.

A lane lies in an intersection if it interpolates between others, if a light controls it, if no
line bounds it on either side while others begin where it begins or end where it ends, or if it is
of a fork or merge and crosses another lane. World frame.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace
from typing import Any

import numpy as np

from augment.formats.road_map import (
    USUAL_M,
    FloatArray,
    Name,
    RoadMap,
    Segment,
    count_notes,
    crossing_segments,
    edge_of,
    left_out_notes,
    limit_notes,
    take_end_widths,
    whole_edge,
    width_of,
)
from augment.formats.waymo.scenario import WHAT, MapFeatures, features_of
from augment.scene.entities import AreaKind, TrafficLight
from augment.scene.recording import Note, SceneNoteKind

BICYCLE_LANE = 3
MPS_OF_MPH = 0.44704

LIGHT_OF = {
    0: TrafficLight.UNKNOWN,
    1: TrafficLight.RED,
    2: TrafficLight.YELLOW,
    3: TrafficLight.GREEN,
    4: TrafficLight.RED,
    5: TrafficLight.YELLOW,
    6: TrafficLight.GREEN,
    7: TrafficLight.RED,
    8: TrafficLight.YELLOW,
}
"""LANE_STATE_*: arrows and round lights alike; flashing ones as what they ask for."""


def city_of(scenario: Any, frame: int) -> RoadMap:
    """The map with the lights of one step."""
    features = features_of(scenario)
    lanes = {
        key: lane
        for key, lane in features.lanes.items()
        if lane.type != BICYCLE_LANE and len(features.lines[key]) >= 2
    }
    states = [step.lane_states for step in scenario.dynamic_map_states]
    lights = {one.lane: one.state for one in states[frame]} if frame < len(states) else {}
    controlled = {one.lane for step in states for one in step}
    crossing: set[Name] = {
        key for key, lane in lanes.items() if lane.interpolating or key in controlled
    }
    crossing |= _unbounded_joints(lanes)
    built = [_segment(features, key, lights.get(key, 0)) for key in lanes]
    crossing |= crossing_segments({one.name: one for one, _ in built})
    segments, assumed = take_end_widths(
        [replace(one, crosses=one.name in crossing) for one, _ in built],
        {one.name for one, was_assumed in built if was_assumed},
    )
    areas = [
        (AreaKind.CROSSWALK if kind == "crosswalk" else AreaKind.DRIVABLE, polygon)
        for kind, polygon in features.polygons
        if kind != "speed_bump" and len(np.unique(polygon, axis=0)) >= 3
    ]
    return RoadMap(
        what=WHAT,
        place="map_features",
        segments=segments,
        areas=tuple(areas),
        notes=tuple(_notes(features, segments, assumed, crossing, controlled)),
    )


# Private


def _unbounded_joints(lanes: dict[int, Any]) -> set[int]:
    exits = {key: len(lane.exit_lanes) for key, lane in lanes.items()}
    entries = {key: len(lane.entry_lanes) for key, lane in lanes.items()}
    return {
        key
        for key, lane in lanes.items()
        if not lane.left_boundaries
        and not lane.right_boundaries
        and (
            any(exits.get(before, 0) > 1 for before in lane.entry_lanes)
            or any(entries.get(after, 0) > 1 for after in lane.exit_lanes)
        )
    }


def _segment(features: MapFeatures, key: int, light: int) -> tuple[Segment, bool]:
    """The segment, and whether its width was assumed."""
    lane, line = features.lanes[key], features.lines[key]
    left = edge_of(line, _parts(features, lane.left_boundaries))
    right = edge_of(line, _parts(features, lane.right_boundaries))
    width_m = width_of(line, left, right) or _beside_m(features, key)
    edges = whole_edge(line, left), whole_edge(line, right)
    both = edges if edges[0] is not None and edges[1] is not None else (None, None)
    limit = lane.speed_limit_mph
    has_limit = np.isfinite(limit) and limit > 0.0
    return (
        Segment(
            name=key,
            centerline=line,
            left=both[0],
            right=both[1],
            width_m=width_m or USUAL_M,
            successors=tuple(lane.exit_lanes),
            predecessors=tuple(lane.entry_lanes),
            left_neighbors=tuple(one.feature_id for one in lane.left_neighbors),
            right_neighbors=tuple(one.feature_id for one in lane.right_neighbors),
            speed_limit_mps=round(limit * MPS_OF_MPH, 3) if has_limit else None,
            light=LIGHT_OF.get(light, TrafficLight.UNKNOWN),
        ),
        width_m is None,
    )


def _parts(features: MapFeatures, boundaries: Iterable[Any]) -> list[tuple[int, int, FloatArray]]:
    return [
        (one.lane_start_index, one.lane_end_index, features.edges[one.boundary_feature_id])
        for one in boundaries
        if one.boundary_feature_id in features.edges
    ]


def _beside_m(features: MapFeatures, key: int) -> float | None:
    """How far the lanes beside it are, which is as wide as a lane."""
    lane, line = features.lanes[key], features.lines[key]
    none = np.full(line.shape, np.nan)
    for neighbor in (*lane.left_neighbors, *lane.right_neighbors):
        other = features.lines.get(neighbor.feature_id)
        if other is not None and len(other) >= 2:
            beside = edge_of(line, [(0, len(line), other)])
            # `width_of` doubles what is known of one side: half the way to the lane beside.
            width_m = width_of(line, (line + beside) / 2.0, none)
            if width_m is not None:
                return width_m
    return None


def _notes(
    features: MapFeatures,
    segments: Sequence[Segment],
    assumed: int,
    crossing: AbstractSet[Name],
    controlled: set[int],
) -> Iterator[Note]:
    yield from limit_notes(segments)
    if assumed:
        kind = SceneNoteKind.LANE_WIDTHS_ASSUMED
        yield Note(kind=kind, number=assumed, of=len(segments), value=USUAL_M)
    if not crossing:
        yield Note(kind=SceneNoteKind.NO_INTERSECTIONS)
    if not controlled:
        yield Note(kind=SceneNoteKind.NO_LIGHTS)
    bicycle_lanes = sum(lane.type == BICYCLE_LANE for lane in features.lanes.values())
    yield from count_notes({SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes})
    bumps = sum(kind == "speed_bump" for kind, _ in features.polygons)
    left_out = {"speed bumps": bumps, "stop signs": features.stop_signs}
    yield from left_out_notes(SceneNoteKind.MAP_PARTS_LEFT_OUT, left_out)
    yield Note(kind=SceneNoteKind.NO_WALKWAYS)
