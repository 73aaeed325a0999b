"""The reader of Waymo Open Motion scenario files.

`item` is the number of a record in the file, `frame` a step of it; without one the step that the
scenario calls its current one (1.1 s after its start). Coordinates are the data set's own.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

import google_crc32c
import numpy as np
from google.protobuf.message import DecodeError

from augment.errors import InvalidDocument
from augment.formats.reading import (
    Log,
    LoggedTrack,
    Moment,
    Reading,
    frame_in,
    frames_every,
    reading_at,
)
from augment.formats.road_map import (
    FURTHEST_M,
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
from augment.formats.waymo.scenario_pb2 import Scenario
from augment.scene.entities import AgentType, AreaKind, TrafficLight
from augment.scene.recording import Note, SceneNoteKind

WHAT = "Waymo Open Motion file"

_HEAD = struct.Struct("<QI")
_FOOT = struct.Struct("<I")


def read_records(path: Path, *, only: int | None = None) -> Iterator[tuple[int, bytes]]:
    """Each record's number and payload.

    Args:
        path: The file.
        only: The number of the one that is wanted: what lies before it is passed over unread.

    Raises:
        InvalidDocument: A length, a checksum or the end of the file is wrong.
    """
    try:
        with path.open("rb") as file:
            size = file.seek(0, 2)
            file.seek(0)
            yield from _records(path.name, file, size, only)
    except OSError as fault:
        raise InvalidDocument(WHAT, [(str(path), fault.strerror or str(fault))]) from None


def starts_a_record(path: Path) -> bool:
    """Whether the file begins with a length that has the right checksum."""
    with path.open("rb") as file:
        head = file.read(_HEAD.size)
    return len(head) == _HEAD.size and masked_crc32c(head[:8]) == _HEAD.unpack(head)[1]


def masked_crc32c(block: bytes) -> int:
    """What stands in the file beside a block: its CRC-32C, rotated and shifted."""
    crc: int = google_crc32c.value(block)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


# Private


def _records(
    name: str, file: BinaryIO, size: int, only: int | None
) -> Iterator[tuple[int, bytes]]:
    number, place = 0, 0
    while place < size:
        head = file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            raise _fault(name, number, "is cut off in its length")
        length, check = _HEAD.unpack(head)
        if masked_crc32c(head[:8]) != check:
            raise _fault(name, number, "has a length with a wrong checksum")
        end = place + _HEAD.size + length + _FOOT.size
        if end > size:
            missing = end - size
            raise _fault(name, number, f"is cut off: {missing} bytes of it are missing")
        if only is None or number == only:
            payload = file.read(length)
            (check,) = _FOOT.unpack(file.read(_FOOT.size))
            if masked_crc32c(payload) != check:
                raise _fault(name, number, "has a payload with a wrong checksum")
            yield number, payload
            if only is not None:
                return
        place = end
        file.seek(place)
        number += 1


def _fault(name: str, number: int, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(f"{name}: record {number}", text)])


@dataclass(slots=True, kw_only=True)
class MapFeatures:
    """The map of a scenario, by the features' ids.

    Attributes:
        lanes: The messages, and lines: their middles (P, 2).
        edges: Road lines and road edges (P, 2).
        polygons: Crosswalks, speed bumps and driveways (P, 2) by these names.
    """

    lanes: dict[int, Any] = field(default_factory=dict)
    lines: dict[int, FloatArray] = field(default_factory=dict)
    edges: dict[int, FloatArray] = field(default_factory=dict)
    polygons: list[tuple[str, FloatArray]] = field(default_factory=list)
    stop_signs: int = 0


def read_scenario(payload: bytes) -> Any:
    """The message of a record.

    Raises:
        InvalidDocument: It is no Scenario.
    """
    try:
        return Scenario.FromString(payload)
    except DecodeError as fault:
        raise InvalidDocument(WHAT, [("message", f"is broken: {fault}")]) from None


def features_of(scenario: Any) -> MapFeatures:
    """The map.

    Raises:
        InvalidDocument: A point is nowhere on earth.
    """
    features = MapFeatures()
    for feature in scenario.map_features:
        kind = feature.WhichOneof("feature_data")
        if kind == "lane":
            features.lanes[feature.id] = feature.lane
            features.lines[feature.id] = _points(feature.lane.polyline)
        elif kind in ("road_line", "road_edge"):
            features.edges[feature.id] = _points(getattr(feature, kind).points)
        elif kind == "stop_sign":
            features.stop_signs += 1
        elif kind is not None:
            features.polygons.append((kind, _points(getattr(feature, kind).points)))
    return features


def states_of(track: Any) -> FloatArray:
    """States (T, 4): x, y, heading and speed; NaN where the track is not valid."""
    rows = [
        (one.center_x, one.center_y, one.heading, np.hypot(one.velocity_x, one.velocity_y))
        if one.valid
        else (np.nan,) * 4
        for one in track.states
    ]
    states = np.array(rows, dtype=np.float64).reshape(-1, 4)
    states[~np.isfinite(states).all(axis=1)] = np.nan
    return states


# Private


def _points(points: Iterable[Any]) -> FloatArray:
    made = np.array([(point.x, point.y) for point in points], dtype=np.float64).reshape(-1, 2)
    if not (np.abs(made) <= FURTHEST_M).all():
        text = f"has a point that is not finite or beyond {FURTHEST_M:.0e} m"
        raise InvalidDocument(WHAT, [("map_features", text)])
    return made


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


LICENCE = "Waymo Open Dataset licence, non-commercial use"
TYPE_OF = {
    1: AgentType.VEHICLE,
    2: AgentType.PEDESTRIAN,
    3: AgentType.BICYCLE,
    4: AgentType.GENERIC_OBJECT,
}
UNSET = 0


class WaymoMotion:
    """The reader of scenario TFRecords."""

    name = "waymo"
    title = "Waymo Open Motion scenarios (TFRecord file)"

    def recognises(self, path: Path) -> bool:
        """A file that begins with a length and its checksum."""
        return path.is_file() and starts_a_record(path)

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Each record's steps."""
        for number, payload in read_records(path):
            times_s = list(read_scenario(payload).timestamps_seconds)
            for frame in frames_every(times_s, every_s):
                time_s = times_s[frame] - times_s[0]
                yield Moment(item=str(number), frame=frame, time_s=time_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step of one record."""
        number = _number(item)
        for found, payload in read_records(path, only=number):
            return _reading(read_scenario(payload), path, found, frame, name)
        raise InvalidDocument(WHAT, [("item", f"the file has no record {number}")])


# Private


def _number(item: str | None) -> int:
    if item is None:
        return 0
    if not (item.isascii() and item.isdecimal() and len(item) < 10):
        raise InvalidDocument(WHAT, [("item", f"{item!r} is no number of a record, from 0")])
    return int(item)


def _reading(scenario: Any, path: Path, number: int, frame: int | None, name: str) -> Reading:
    log = _log(scenario)
    frame = scenario.current_time_index if frame is None else frame
    frame_in(WHAT, frame, len(log.times_s))
    unset = sum(track.object_type == UNSET for track in scenario.tracks)
    return reading_at(
        log,
        frame,
        city_of(scenario, frame),
        name=name,
        world="Waymo Open Motion scenario frame",
        provenance=(
            f"Waymo Open Motion data set, {path.name}, scenario {_id(scenario)}, step {frame} of "
            f"{len(log.times_s)}; {LICENCE}"
        ),
        licence=LICENCE,
        notes=left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, {"TYPE_UNSET": unset}),
        item=str(number),
    )


def _id(scenario: Any) -> str:
    try:
        text: str = scenario.scenario_id.decode("ascii")
    except UnicodeDecodeError:
        raise InvalidDocument(WHAT, [("scenario_id", "is no plain text")]) from None
    return text


def _log(scenario: Any) -> Log:
    times_s = np.array(scenario.timestamps_seconds)
    if not len(times_s) or not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
        raise InvalidDocument(WHAT, [("timestamps_seconds", "must be there and ascend")])
    ego_index = scenario.sdc_track_index
    if not 0 <= ego_index < len(scenario.tracks):
        text = f"{ego_index} is none of the {len(scenario.tracks)} tracks"
        raise InvalidDocument(WHAT, [("sdc_track_index", text)])
    problems = [
        (f"tracks[{index}]", f"has {len(track.states)} states for {len(times_s)} times")
        for index, track in enumerate(scenario.tracks)
        if len(track.states) != len(times_s)
    ]
    problems += [
        (f"tracks[{index}].object_type", f"{track.object_type} is unknown; known: 0 to 4")
        for index, track in enumerate(scenario.tracks)
        if track.object_type not in TYPE_OF and track.object_type != UNSET
    ]
    if problems:
        raise InvalidDocument(WHAT, problems)
    ego = scenario.tracks[ego_index]
    length_m, width_m = _size(ego)
    return Log(
        what=WHAT,
        times_s=times_s - times_s[0],
        ego=states_of(ego),
        ego_length_m=length_m,
        ego_width_m=width_m,
        tracks=tuple(
            LoggedTrack(
                name=f"{track.id:012d}",
                type=TYPE_OF[track.object_type],
                length_m=_size(track)[0],
                width_m=_size(track)[1],
                states=states_of(track),
            )
            for index, track in enumerate(scenario.tracks)
            if index != ego_index
            and track.object_type != UNSET
            and any(one.valid for one in track.states)
        ),
    )


def _size(track: Any) -> tuple[float, float]:
    """Length and width; boxes change a little from step to step, the usual one is taken."""
    sizes = [(one.length, one.width) for one in track.states if one.valid]
    if not sizes:
        return 0.0, 0.0
    length_m, width_m = np.median(np.array(sizes, dtype=np.float64), axis=0).tolist()
    return length_m, width_m
