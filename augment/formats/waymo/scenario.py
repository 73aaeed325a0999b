"""The reader of Waymo Open Motion scenario files: TFRecords of the published Scenario message.

`item` is the number of a record in the file, `frame` a step of it; without one the step that the
scenario calls its current one (1.1 s after its start). Coordinates are the data set's own, x and
y. A record is its length (8 bytes, little endian), the length's checksum (4), the payload and the
payload's checksum (4); `scenario.proto` has the parts of the message
that are read, `scenario.desc` the same as protoc writes it.
"""

import struct
from collections.abc import Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessages
from google.protobuf.unknown_fields import UnknownFieldSet

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats import road_map
from augment.formats.reading import Log, LogReader, read_each
from augment.scene.entities import AgentType, AreaKind, TrafficLight
from augment.scene.recording import Track

LICENCE = "Waymo Open Dataset licence, non-commercial use"
EXAMPLES = (
    "holds tf.Example records, which are not read; take the data set's Scenario form, the files "
    "under scenario/training, scenario/validation or scenario/testing"
)
UNSET = 0
_OTHER = AgentType.GENERIC_OBJECT
TYPE_OF = dict(
    enumerate((_OTHER, AgentType.VEHICLE, AgentType.PEDESTRIAN, AgentType.BICYCLE, _OTHER))
)
AREA_OF = {"crosswalk": AreaKind.CROSSWALK, "driveway": AreaKind.DRIVABLE}
BICYCLE_LANE = 3
LANE_TYPES = dict.fromkeys((0, 1, 2, BICYCLE_LANE))
MPS_OF_MPH = 0.44704
_RED, _YELLOW, _GREEN = TrafficLight.RED, TrafficLight.YELLOW, TrafficLight.GREEN
_COLOURS = (_RED, _YELLOW, _GREEN, _RED, _YELLOW, _GREEN, _RED, _YELLOW)
LIGHT_OF = dict(enumerate((TrafficLight.UNKNOWN, *_COLOURS)))
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
        return len(head) == _HEAD.size and mask_crc32c(head[:8]) == _HEAD.unpack(head)[1]

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """One of each record."""
        records = read_records(path, only=item)
        yield from read_each(partial(_log, path.name, *record) for record in records)


def _log(file: str, number: int, payload: bytes) -> Log:
    scenario, doubts = read_scenario(payload), Doubts()
    with doubts.about("fields of messages"):
        _check_fields(scenario)
    times_s = foreign.read_times(scenario.timestamps_seconds, "timestamps_seconds")
    tracks = dict[int, Track]()
    for index, track in enumerate(scenario.tracks):
        with doubts.about("objects"):
            tracks[index] = _track(index, track, len(times_s), doubts)
    sdc = scenario.sdc_track_index if scenario.HasField("sdc_track_index") else None
    if sdc is not None and sdc not in tracks and 0 <= sdc < len(scenario.tracks):
        raise fault_at("sdc_track_index", " ".join([f"{sdc} is no ego.", *doubts.notes]))
    ego = foreign.look_up(tracks, sdc, "sdc_track_index")
    unset = {i for i, track in enumerate(scenario.tracks) if track.object_type == UNSET}
    if not scenario.HasField("current_time_index"):
        doubts.assume("A current step that is not given is the first")
    current = scenario.current_time_index, "current_time_index", 0, len(times_s) - 1
    name = scenario.scenario_id[:100].decode("ascii", errors="replace")
    return Log(
        times_s=times_s,
        ego=ego.states,
        ego_size_m=(ego.length_m, ego.width_m),
        tracks=[
            track
            for index, track in tracks.items()
            if track is not ego and index not in unset and np.isfinite(track.states).any()
        ],
        map_at=lambda frame: read_city(scenario, frame),
        world="Waymo Open Motion scenario frame",
        title=f"Waymo Open Motion data set, {file}, scenario {name}",
        licence=LICENCE,
        item=str(number),
        frame=doubts.read("current times", foreign.read_whole, *current) or 0,
        notes=[*road_map.note_left_out("objects", {"TYPE_UNSET": len(unset)}), *doubts.notes],
    )


# Records and messages


def mask_crc32c(block: bytes) -> int:
    """Return a block's checksum as the file has it: its CRC-32C, rotated and shifted."""
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
            if mask_crc32c(head[:8]) != check:
                raise fault_at(record, "has a length with a wrong checksum")
            end = file.tell() + length + _FOOT.size
            if end > size:
                raise fault_at(record, f"is cut off: {end - size} bytes of it are missing")
            if only in (None, str(number)):
                payload = file.read(length)
                (check,) = _FOOT.unpack(file.read(_FOOT.size))
                if mask_crc32c(payload) != check:
                    raise fault_at(record, "has a payload with a wrong checksum")
                yield number, payload
            file.seek(end)
            number += 1


def read_scenario(payload: bytes) -> Any:
    """Return the message of a record.

    Raises:
        InvalidDocument: It is none, or one of the data set's other form.
    """
    if any(name in payload for name in (b"roadgraph_samples/", b"state/current/")):
        raise fault_at("record", EXAMPLES)
    try:
        return Scenario.FromString(payload)
    except DecodeError as fault:
        raise fault_at("message", f"is broken: {fault}") from None


def _check_fields(message: Any) -> None:
    """Raise InvalidDocument for a field that is written in another type than the format's."""
    fields = message.DESCRIPTOR.fields_by_number
    for unknown in UnknownFieldSet(message):
        if unknown.field_number in fields:
            name = f"{message.DESCRIPTOR.name}.{fields[unknown.field_number].name}"
            raise fault_at(name, "is not of the format's type")
    for field, value in message.ListFields():
        if field.message_type is not None:
            for part in value if field.is_repeated else [value]:
                _check_fields(part)


def _track(index: int, track: Any, steps: int, doubts: Doubts) -> Track:
    """The track; boxes change a little from step to step, the usual one is taken."""
    place = f"tracks[{index}]"
    kind = foreign.look_up(TYPE_OF, track.object_type, f"{place}.object_type")
    if len(track.states) != steps:
        raise fault_at(place, f"has {len(track.states)} states for {steps} times")
    rows = [[getattr(state, name) for name in _STATE] for state in track.states]
    columns = foreign.read_numbers(rows, place, len(_STATE))
    valid = np.array([state.valid for state in track.states], dtype=bool)
    whole = np.array([all(map(state.HasField, _STATE)) for state in track.states], dtype=bool)
    states = np.column_stack([columns[:, :3], np.hypot(columns[:, 3], columns[:, 4])])
    odd = valid & ~(whole & np.isfinite(states).all(axis=1))
    doubts.assume("A state that is valid and not whole or finite was left out", int(odd.sum()))
    seen = valid & ~odd
    states[~seen] = np.nan
    sizes_m = np.median(columns[seen, 5:], axis=0).tolist() if seen.any() else (0.0, 0.0)
    return Track(
        agent_id=f"{track.id:012d}",
        type=kind,
        length_m=sizes_m[0],
        width_m=sizes_m[1],
        states=states,
    )


# The map


def read_city(scenario: Any, frame: int) -> road_map.RoadMap:
    """Return the map with the lights of one step."""
    lanes, edges, areas = list[tuple[int, Any]](), dict[int, FloatArray](), []
    left_out, doubts = {"bicycle lanes": 0, "speed bumps": 0, "stop signs": 0}, Doubts()
    for feature in scenario.map_features:
        kind, place = feature.WhichOneof("feature_data"), f"map_features.{feature.id}"
        if kind == "lane" and feature.lane.type == BICYCLE_LANE:
            left_out["bicycle lanes"] += 1
        elif kind == "lane":
            lanes.append((feature.id, feature.lane))
        elif kind in ("road_line", "road_edge"):
            with doubts.about("road lines"):
                edges[feature.id] = _points(getattr(feature, kind).points, place)
        elif kind in ("speed_bump", "stop_sign"):
            left_out[f"{kind.replace('_', ' ')}s"] += 1
        elif kind in AREA_OF:
            with doubts.about("areas"):
                areas.append((AREA_OF[kind], _points(getattr(feature, kind).points, place)))
    states = [step.lane_states for step in scenario.dynamic_map_states]
    lights = {
        light.lane: doubts.read(
            "states of lights", foreign.look_up, LIGHT_OF, light.state, "lane_states"
        )
        for light in (states[frame] if frame < len(states) else ())
    }
    controlled = {light.lane for step in states for light in step}
    idle = len(controlled - {feature.id for feature in scenario.map_features})
    doubts.assume("A traffic light governs no lane that is there", idle)
    segments = doubts.index_last("lanes", lanes).items()
    rows = ((*lane, edges, lights, controlled, doubts) for lane in segments)
    return road_map.RoadMap(
        place="map_features",
        segments=tuple(doubts.read_all("lanes", _segment, rows)),
        areas=tuple(areas),
        left_out=left_out,
        tells_crossings=False,
        doubts=doubts,
    )


def _points(points: Iterable[Any], place: str) -> FloatArray:
    if not all(point.HasField("x") and point.HasField("y") for point in points):
        raise fault_at(place, "has a point without x or y")
    return foreign.read_finite([(point.x, point.y) for point in points], place, 2)


def _segment(
    key: int,
    lane: Any,
    edges: Mapping[int, FloatArray],
    lights: Mapping[int, TrafficLight | None],
    controlled: set[int],
    doubts: Doubts,
) -> road_map.Segment:
    place = f"map_features.{key}"
    line = _points(lane.polyline, place)
    foreign.look_up(LANE_TYPES, lane.type, f"{place}.type")

    def read_edge(part: Any) -> tuple[int, int, FloatArray]:
        edge = foreign.look_up(edges, part.boundary_feature_id, f"{place}.boundary_feature_id")
        start, end = part.lane_start_index, part.lane_end_index
        text = "An edge of a lane counts as far as the lane's line goes"
        doubts.assume(text, not 0 <= start <= end < len(line))
        return start, end, edge

    left, right = (
        road_map.edge_distances(
            line, doubts.read_all("edges of lanes", read_edge, ((part,) for part in boundaries))
        )
        for boundaries in (lane.left_boundaries, lane.right_boundaries)
    )
    is_whole = _is_whole_edge(line, left) and _is_whole_edge(line, right)
    limit = lane.speed_limit_mph or None  # 0 stands for none
    return road_map.Segment(
        name=key,
        crosses=lane.interpolating or key in controlled,
        centerline=line,
        left=left if is_whole else None,
        right=right if is_whole else None,
        width_m=road_map.mean_width(line, left, right),
        successors=tuple(lane.exit_lanes),
        predecessors=tuple(lane.entry_lanes),
        left_neighbors=tuple(neighbor.feature_id for neighbor in lane.left_neighbors),
        right_neighbors=tuple(neighbor.feature_id for neighbor in lane.right_neighbors),
        speed_limit_mps=doubts.read("speed limits", foreign.read_speed, limit, place, MPS_OF_MPH),
        light=lights.get(key) or TrafficLight.UNKNOWN,
    )


def _is_whole_edge(line: FloatArray, edge: FloatArray) -> bool:
    """Return whether an edge is known all along, has a length and is nowhere another lane's."""
    if len(edge) < 2 or not np.isfinite(edge).all():
        return False
    is_near = np.hypot(*(edge - line).T).max() <= road_map.WIDEST_M
    return bool(is_near and np.hypot(*np.diff(edge, axis=0).T).sum() > 0.5)
