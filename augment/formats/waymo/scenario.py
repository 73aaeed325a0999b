"""The reader of Waymo Open Motion scenario files: TFRecords of the published Scenario message.

`item` is the number of a record in the file, `frame` a step of it; without one the step that the
scenario calls its current one (1.1 s after its start). Coordinates are the data set's own, x and
y. A record is its length (8 bytes, little endian), the length's checksum (4), the payload and the
payload's checksum (4); `scenario.proto` has the parts of the message
that are read, `scenario.desc` the same as protoc writes it.
"""

import struct
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessages

from augment.formats.reading import Log, LoggedTrack, LogReader
from augment.formats.road_map import WIDEST_M, RoadMap, Segment, edge_of, left_out_notes, width_of
from augment.formats.values import (
    FloatArray,
    fault_at,
    look_up,
    read_finite,
    read_numbers,
    read_times,
)
from augment.scene.entities import AgentType, AreaKind, TrafficLight

LICENCE = "Waymo Open Dataset licence, non-commercial use"
UNSET = 0
TYPE_OF = {
    UNSET: AgentType.GENERIC_OBJECT,
    1: AgentType.VEHICLE,
    2: AgentType.PEDESTRIAN,
    3: AgentType.BICYCLE,
    4: AgentType.GENERIC_OBJECT,
}
AREA_OF = {"crosswalk": AreaKind.CROSSWALK, "driveway": AreaKind.DRIVABLE}
BICYCLE_LANE = 3
MPS_OF_MPH = 0.44704
_RED, _YELLOW, _GREEN = TrafficLight.RED, TrafficLight.YELLOW, TrafficLight.GREEN
LIGHT_OF = dict(enumerate((_RED, _YELLOW, _GREEN, _RED, _YELLOW, _GREEN, _RED, _YELLOW), start=1))
"""LANE_STATE_*: arrows and round lights alike; flashing ones as what they ask for."""
_MESSAGES = FileDescriptorSet.FromString((Path(__file__).parent / "scenario.desc").read_bytes())
Scenario: Any = GetMessages(_MESSAGES.file)["scenario_arena.waymo.Scenario"]
_HEAD, _FOOT = struct.Struct("<QI"), struct.Struct("<I")
_STATE = ("center_x", "center_y", "heading", "velocity_x", "velocity_y", "length", "width")


class WaymoMotion(LogReader):
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

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """One of each record."""
        for number, payload in read_records(path, only=item):
            scenario = read_scenario(payload)
            tracks = [_track(index, track) for index, track in enumerate(scenario.tracks)]
            times_s = read_times(scenario.timestamps_seconds, "timestamps_seconds")
            for one in tracks:
                if len(one.states) != len(times_s):
                    text = f"has {len(one.states)} states for {len(times_s)} times"
                    raise fault_at(f"track {one.name}", text)
            ego = look_up(dict(enumerate(tracks)), scenario.sdc_track_index, "sdc_track_index")
            kinds = [track.object_type for track in scenario.tracks]
            name = scenario.scenario_id[:100].decode("ascii", errors="replace")
            yield Log(
                times_s=times_s,
                ego=ego.states,
                ego_size_m=(ego.length_m, ego.width_m),
                tracks=[
                    one
                    for one, kind in zip(tracks, kinds, strict=True)
                    if one is not ego and kind != UNSET and np.isfinite(one.states).any()
                ],
                map_at=lambda frame, scenario=scenario: city_of(scenario, frame),  # type: ignore[misc]
                world="Waymo Open Motion scenario frame",
                title=f"Waymo Open Motion data set, {path.name}, scenario {name}",
                licence=LICENCE,
                item=str(number),
                frame=scenario.current_time_index,
                notes=left_out_notes("objects", {"TYPE_UNSET": kinds.count(UNSET)}),
            )


# Records and messages


def masked_crc32c(block: bytes) -> int:
    """Return what stands in the file beside a block: its CRC-32C, rotated and shifted."""
    crc: int = google_crc32c.value(block)
    return (((crc >> 15) | (crc << 17)) + 0xA282EAD8) & 0xFFFFFFFF


def read_records(path: Path, *, only: str | None = None) -> Iterator[tuple[int, bytes]]:
    """Yield each record's number and payload.

    Args:
        path: The file.
        only: The number of the one that is wanted: what lies before it is passed over unread.

    Raises:
        InvalidDocument: A length, a checksum or the end of the file is wrong.
    """
    number, size = 0, path.stat().st_size
    with path.open("rb") as file:
        while file.tell() < size:
            record = f"{path.name}: record {number}"
            head = file.read(_HEAD.size)
            if len(head) < _HEAD.size:
                raise fault_at(record, "is cut off in its length")
            length, check = _HEAD.unpack(head)
            if masked_crc32c(head[:8]) != check:
                raise fault_at(record, "has a length with a wrong checksum")
            end = file.tell() + length + _FOOT.size
            if end > size:
                raise fault_at(record, f"is cut off: {end - size} bytes of it are missing")
            if only in (None, str(number)):
                payload = file.read(length)
                (check,) = _FOOT.unpack(file.read(_FOOT.size))
                if masked_crc32c(payload) != check:
                    raise fault_at(record, "has a payload with a wrong checksum")
                yield number, payload
            file.seek(end)
            number += 1


def read_scenario(payload: bytes) -> Any:
    """Return the message of a record.

    Raises:
        InvalidDocument: It is none.
    """
    try:
        return Scenario.FromString(payload)
    except DecodeError as fault:
        raise fault_at("message", f"is broken: {fault}") from None


def _track(index: int, track: Any) -> LoggedTrack:
    """The track; boxes change a little from step to step, the usual one is taken."""
    kind = look_up(TYPE_OF, track.object_type, f"tracks[{index}].object_type")
    rows = [[getattr(state, name) for name in _STATE] for state in track.states]
    columns = read_numbers(rows, f"tracks[{index}]", len(_STATE))
    valid = np.array([state.valid for state in track.states], dtype=bool)
    states = np.column_stack([columns[:, :3], np.hypot(columns[:, 3], columns[:, 4])])
    states[~(valid & np.isfinite(states).all(axis=1))] = np.nan
    sizes_m = np.median(columns[valid, 5:], axis=0).tolist() if valid.any() else (0.0, 0.0)
    return LoggedTrack(
        name=f"{track.id:012d}", type=kind, length_m=sizes_m[0], width_m=sizes_m[1], states=states
    )


# The map


def city_of(scenario: Any, frame: int) -> RoadMap:
    """Return the map with the lights of one step.

    Raises:
        InvalidDocument: A point is nowhere on earth.
    """
    lanes, edges, areas = dict[int, Any](), dict[int, FloatArray](), []
    left_out = {"bicycle lanes": 0, "speed bumps": 0, "stop signs": 0}
    for feature in scenario.map_features:
        kind = feature.WhichOneof("feature_data")
        if kind == "lane" and feature.lane.type == BICYCLE_LANE:
            left_out["bicycle lanes"] += 1
        elif kind == "lane" and len(feature.lane.polyline) >= 2:
            lanes[feature.id] = feature.lane
        elif kind in ("road_line", "road_edge"):
            edges[feature.id] = _points(getattr(feature, kind).points)
        elif kind in ("speed_bump", "stop_sign"):
            left_out[f"{kind.replace('_', ' ')}s"] += 1
        elif kind in AREA_OF:
            polygon = _points(getattr(feature, kind).points)
            if len(np.unique(polygon, axis=0)) >= 3:
                areas.append((AREA_OF[kind], polygon))
    states = [step.lane_states for step in scenario.dynamic_map_states]
    lights = {one.lane: one.state for one in states[frame]} if frame < len(states) else {}
    controlled = {one.lane for step in states for one in step}
    return RoadMap(
        place="map_features",
        segments=tuple(
            _segment(key, lane, edges, lights.get(key, 0), key in controlled)
            for key, lane in lanes.items()
        ),
        areas=tuple(areas),
        left_out=left_out,
        tells_crossings=False,
    )


def _points(points: Iterable[Any]) -> FloatArray:
    return read_finite([(point.x, point.y) for point in points], "map_features", 2)


def _segment(
    key: int, lane: Any, edges: Mapping[int, FloatArray], light: int, is_controlled: bool
) -> Segment:
    line = _points(lane.polyline)
    left, right = (
        edge_of(
            line,
            [
                (part.lane_start_index, part.lane_end_index, edges[part.boundary_feature_id])
                for part in boundaries
                if part.boundary_feature_id in edges
            ],
        )
        for boundaries in (lane.left_boundaries, lane.right_boundaries)
    )
    is_whole = _is_whole_edge(line, left) and _is_whole_edge(line, right)
    limit = lane.speed_limit_mph
    has_limit = np.isfinite(limit) and limit > 0.0
    return Segment(
        name=key,
        crosses=lane.interpolating or is_controlled,
        centerline=line,
        left=left if is_whole else None,
        right=right if is_whole else None,
        width_m=width_of(line, left, right),
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
