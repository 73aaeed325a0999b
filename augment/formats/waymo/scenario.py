"""The reader of Waymo Open Motion scenario files: TFRecords of the published Scenario message.

`item` is the number of a record in the file, `frame` a step of it; without one the step that the
scenario calls its current one (1.1 s after its start). Coordinates are the data set's own, x and
y. A record is its length (8 bytes, little endian), the length's checksum (4), the payload and the
payload's checksum (4); `scenario.proto` has the parts of the message that are read.
"""

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
from google.protobuf.message import DecodeError

from augment.errors import InvalidDocument
from augment.formats.reading import Log, LoggedTrack, Moment, Reading, moments_of, reading_at
from augment.formats.road_map import (
    FURTHEST_M,
    WIDEST_M,
    FloatArray,
    Name,
    RoadMap,
    Segment,
    crossing_segments,
    edge_of,
    fill_widths,
    left_out_notes,
    map_notes,
    width_of,
)
from augment.formats.waymo.scenario_pb2 import Scenario
from augment.scene.entities import AgentType, AreaKind, TrafficLight
from augment.scene.recording import SceneNoteKind

WHAT = "Waymo Open Motion file"
LICENCE = "Waymo Open Dataset licence, non-commercial use"
UNSET = 0
TYPE_OF = {
    1: AgentType.VEHICLE,
    2: AgentType.PEDESTRIAN,
    3: AgentType.BICYCLE,
    4: AgentType.GENERIC_OBJECT,
}
BICYCLE_LANE = 3
MPS_OF_MPH = 0.44704
_RED, _YELLOW, _GREEN = TrafficLight.RED, TrafficLight.YELLOW, TrafficLight.GREEN
LIGHT_OF = dict(enumerate((_RED, _YELLOW, _GREEN, _RED, _YELLOW, _GREEN, _RED, _YELLOW), start=1))
"""LANE_STATE_*: arrows and round lights alike; flashing ones as what they ask for."""
_HEAD, _FOOT = struct.Struct("<QI"), struct.Struct("<I")


class WaymoMotion:
    """The reader of scenario TFRecords."""

    name = "waymo"
    title = "Waymo Open Motion scenarios (TFRecord file)"

    def recognises(self, path: Path) -> bool:
        """A file that begins with a length and its checksum."""
        if not path.is_file():
            return False
        with path.open("rb") as file:
            head = file.read(_HEAD.size)
        return len(head) == _HEAD.size and masked_crc32c(head[:8]) == _HEAD.unpack(head)[1]

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Each record's steps."""
        for number, payload in read_records(path):
            yield from moments_of(_log(read_scenario(payload)), every_s, str(number))

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step of one record."""
        given = item or "0"
        if not (given.isascii() and given.isdecimal() and len(given) < 10):
            raise _fault("item", f"{item!r} is no number of a record, from 0")
        for number, payload in read_records(path, only=int(given)):
            scenario = read_scenario(payload)
            log, step = _log(scenario), scenario.current_time_index if frame is None else frame
            unset = sum(track.object_type == UNSET for track in scenario.tracks)
            return reading_at(
                log,
                step,
                city_of(scenario, step),
                name=name,
                world="Waymo Open Motion scenario frame",
                provenance=(
                    f"Waymo Open Motion data set, {path.name}, scenario {_id(scenario)}, step "
                    f"{step} of {len(log.times_s)}; {LICENCE}"
                ),
                licence=LICENCE,
                notes=left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, {"TYPE_UNSET": unset}),
                item=str(number),
            )
        raise _fault("item", f"the file has no record {given}")


def _fault(place: str, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(place, text)])


# Records and messages


def masked_crc32c(block: bytes) -> int:
    """Return what stands in the file beside a block: its CRC-32C, rotated and shifted."""
    crc: int = google_crc32c.value(block)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


def read_records(path: Path, *, only: int | None = None) -> Iterator[tuple[int, bytes]]:
    """Yield each record's number and payload.

    Args:
        path: The file.
        only: The number of the one that is wanted: what lies before it is passed over unread.

    Raises:
        InvalidDocument: A length, a checksum or the end of the file is wrong.
    """
    number, place, size = 0, 0, path.stat().st_size
    with path.open("rb") as file:
        while place < size:
            record = f"{path.name}: record {number}"
            head = file.read(_HEAD.size)
            if len(head) < _HEAD.size:
                raise _fault(record, "is cut off in its length")
            length, check = _HEAD.unpack(head)
            if masked_crc32c(head[:8]) != check:
                raise _fault(record, "has a length with a wrong checksum")
            end = place + _HEAD.size + length + _FOOT.size
            if end > size:
                raise _fault(record, f"is cut off: {end - size} bytes of it are missing")
            if only in (None, number):
                payload = file.read(length)
                (check,) = _FOOT.unpack(file.read(_FOOT.size))
                if masked_crc32c(payload) != check:
                    raise _fault(record, "has a payload with a wrong checksum")
                yield number, payload
                if only is not None:
                    return
            file.seek(end)
            number, place = number + 1, end


def read_scenario(payload: bytes) -> Any:
    """Return the message of a record.

    Raises:
        InvalidDocument: It is no Scenario.
    """
    try:
        return Scenario.FromString(payload)
    except DecodeError as fault:
        raise _fault("message", f"is broken: {fault}") from None


def _id(scenario: Any) -> str:
    try:
        text: str = scenario.scenario_id.decode("ascii")
    except UnicodeDecodeError:
        raise _fault("scenario_id", "is no plain text") from None
    return text


def _log(scenario: Any) -> Log:
    times_s = np.array(scenario.timestamps_seconds)
    if not len(times_s) or not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
        raise _fault("timestamps_seconds", "must be there and ascend")
    ego_index = scenario.sdc_track_index
    if not 0 <= ego_index < len(scenario.tracks):
        text = f"{ego_index} is none of the {len(scenario.tracks)} tracks"
        raise _fault("sdc_track_index", text)
    tracks = []
    for index, track in enumerate(scenario.tracks):
        place, kind = f"tracks[{index}]", track.object_type
        if len(track.states) != len(times_s):
            raise _fault(place, f"has {len(track.states)} states for {len(times_s)} times")
        if kind not in TYPE_OF and kind != UNSET:
            raise _fault(f"{place}.object_type", f"{kind} is unknown; known: 0 to 4")
        tracks.append(_track(track))
    ego = tracks[ego_index]
    return Log(
        what=WHAT,
        times_s=times_s - times_s[0],
        ego=ego.states,
        ego_length_m=ego.length_m,
        ego_width_m=ego.width_m,
        tracks=tuple(
            made
            for made, track in zip(tracks, scenario.tracks, strict=True)
            if made is not ego and track.object_type != UNSET and np.isfinite(made.states).any()
        ),
    )


def _track(track: Any) -> LoggedTrack:
    """The track; boxes change a little from step to step, the usual one is taken."""
    names = ("center_x", "center_y", "heading", "velocity_x", "velocity_y", "length", "width")
    rows = [[getattr(state, name) for name in names] for state in track.states]
    columns = np.array(rows, dtype=np.float64).reshape(-1, len(names))
    valid = np.array([state.valid for state in track.states], dtype=bool)
    states = np.column_stack([columns[:, :3], np.hypot(columns[:, 3], columns[:, 4])])
    states[~(valid & np.isfinite(states).all(axis=1))] = np.nan
    length_m, width_m = (
        np.median(columns[valid, 5:], axis=0).tolist() if valid.any() else (0.0, 0.0)
    )
    return LoggedTrack(
        name=f"{track.id:012d}",
        type=TYPE_OF.get(track.object_type, AgentType.GENERIC_OBJECT),
        length_m=length_m,
        width_m=width_m,
        states=states,
    )


# The map


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


def city_of(scenario: Any, frame: int) -> RoadMap:
    """Return the map with the lights of one step.

    A lane lies in an intersection if it interpolates between others, if a light controls it, if
    no line bounds it on either side while others begin where it begins or end where it ends, or
    if it is of a fork or merge and crosses another lane.

    Raises:
        InvalidDocument: A point is nowhere on earth.
    """
    features = _features(scenario)
    lanes = {
        key: lane
        for key, lane in features.lanes.items()
        if lane.type != BICYCLE_LANE and len(features.lines[key]) >= 2
    }
    states = [step.lane_states for step in scenario.dynamic_map_states]
    lights = {one.lane: one.state for one in states[frame]} if frame < len(states) else {}
    controlled = {one.lane for step in states for one in step}
    built: dict[Name, Segment] = {
        key: _segment(features, key, lights.get(key, 0)) for key in lanes
    }
    crossing: set[Name] = {
        key for key, lane in lanes.items() if lane.interpolating or key in controlled
    }
    crossing |= _unbounded_joints(lanes) | crossing_segments(built)
    segments, assumed = fill_widths(
        replace(one, crosses=key in crossing) for key, one in built.items()
    )
    bumps = sum(kind == "speed_bump" for kind, _ in features.polygons)
    bicycle_lanes = sum(lane.type == BICYCLE_LANE for lane in features.lanes.values())
    return RoadMap(
        what=WHAT,
        place="map_features",
        segments=segments,
        areas=tuple(
            (AreaKind.CROSSWALK if kind == "crosswalk" else AreaKind.DRIVABLE, polygon)
            for kind, polygon in features.polygons
            if kind != "speed_bump" and len(np.unique(polygon, axis=0)) >= 3
        ),
        notes=map_notes(
            segments,
            assumed=assumed,
            there={
                SceneNoteKind.NO_INTERSECTIONS: bool(crossing),
                SceneNoteKind.NO_LIGHTS: bool(controlled),
                SceneNoteKind.NO_WALKWAYS: False,
            },
            counts={SceneNoteKind.BICYCLE_LANES_LEFT_OUT: bicycle_lanes},
            left_out={"speed bumps": bumps, "stop signs": features.stop_signs},
        ),
    )


def _features(scenario: Any) -> MapFeatures:
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


def _points(points: Iterable[Any]) -> FloatArray:
    made = np.array([(point.x, point.y) for point in points], dtype=np.float64).reshape(-1, 2)
    if not (np.abs(made) <= FURTHEST_M).all():
        text = f"has a point that is not finite or beyond {FURTHEST_M:.0e} m"
        raise _fault("map_features", text)
    return made


def _unbounded_joints(lanes: dict[int, Any]) -> set[Name]:
    exits = {key: len(lane.exit_lanes) for key, lane in lanes.items()}
    entries = {key: len(lane.entry_lanes) for key, lane in lanes.items()}
    return {
        key
        for key, lane in lanes.items()
        if not (lane.left_boundaries or lane.right_boundaries)
        and (
            any(exits.get(before, 0) > 1 for before in lane.entry_lanes)
            or any(entries.get(after, 0) > 1 for after in lane.exit_lanes)
        )
    }


def _segment(features: MapFeatures, key: int, light: int) -> Segment:
    lane, line = features.lanes[key], features.lines[key]
    left, right = (
        edge_of(
            line,
            [
                (
                    part.lane_start_index,
                    part.lane_end_index,
                    features.edges[part.boundary_feature_id],
                )
                for part in boundaries
                if part.boundary_feature_id in features.edges
            ],
        )
        for boundaries in (lane.left_boundaries, lane.right_boundaries)
    )
    is_whole = _is_whole_edge(line, left) and _is_whole_edge(line, right)
    limit = lane.speed_limit_mph
    has_limit = np.isfinite(limit) and limit > 0.0
    return Segment(
        name=key,
        centerline=line,
        left=left if is_whole else None,
        right=right if is_whole else None,
        width_m=width_of(line, left, right) or _beside_m(features, key),
        successors=tuple(lane.exit_lanes),
        predecessors=tuple(lane.entry_lanes),
        left_neighbors=tuple(one.feature_id for one in lane.left_neighbors),
        right_neighbors=tuple(one.feature_id for one in lane.right_neighbors),
        speed_limit_mps=round(limit * MPS_OF_MPH, 3) if has_limit else None,
        light=LIGHT_OF.get(light, TrafficLight.UNKNOWN),
    )


def _is_whole_edge(line: FloatArray, edge: FloatArray) -> bool:
    """Whether an edge is known all along, has a length and is nowhere another lane's."""
    if len(edge) < 2 or not np.isfinite(edge).all():
        return False
    is_near = np.hypot(*(edge - line).T).max() <= WIDEST_M
    return bool(is_near and np.hypot(*np.diff(edge, axis=0).T).sum() > 0.5)


def _beside_m(features: MapFeatures, key: int) -> float | None:
    """How far the lanes beside it are, which is as wide as a lane."""
    lane, line = features.lanes[key], features.lines[key]
    for neighbor in (*lane.left_neighbors, *lane.right_neighbors):
        other = features.lines.get(neighbor.feature_id)
        if other is not None and len(other) >= 2:
            beside = edge_of(line, [(0, len(line), other)])
            # `width_of` doubles what is known of one side: half the way to the lane beside.
            width_m = width_of(line, (line + beside) / 2.0, np.full(line.shape, np.nan))
            if width_m is not None:
                return width_m
    return None
