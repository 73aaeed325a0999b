"""The reader of ScenarioNet's scenario descriptions, from nuScenes, Waymo or nuPlan.

A path is a file, or a data set's folder, where `item` is the name of a file or its number from 0.
`frame` is a step; without one the step that the description calls its current one, else 0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

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
from augment.formats.scenarionet.unpickling import WHAT, read_pickle
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, AreaKind, TrafficLight, TrafficSide
from augment.scene.recording import Note, SceneNoteKind

SUMMARY, MAPPING = "dataset_summary.pkl", "dataset_mapping.pkl"
ENDING = ".pkl"
MOST_NAMED = 12
_SCENARIOS = "sd_*.pkl"


def is_data_set(path: Path) -> bool:
    """Whether a folder looks like one."""
    return path.is_dir() and ((path / SUMMARY).is_file() or any(path.glob(_SCENARIOS)))


def names_in(folder: Path) -> list[str]:
    """The file names of all scenarios, in the summary's order, else in the alphabet's.

    Raises:
        InvalidDocument: There is none, or the summary breaks its format.
    """
    if (folder / SUMMARY).is_file():
        names = [name for name in _table(folder / SUMMARY) if name.endswith(ENDING)]
    else:
        names = sorted(file.name for file in folder.glob(_SCENARIOS))
    if not names:
        raise InvalidDocument(WHAT, [(str(folder), "holds no scenario")])
    return names


def file_in(folder: Path, item: str | None) -> Path:
    """The file of one scenario.

    Args:
        folder: The data set.
        item: A file name, or its number from 0; None for the first.

    Raises:
        InvalidDocument: There is none such, or it would lie outside of the folder and those
            beside it.
    """
    name = item if item is not None and item.endswith(ENDING) else _name_at(folder, item)
    place: Any = ""
    if (folder / MAPPING).is_file():
        place = _table(folder / MAPPING).get(name, "")
    if not isinstance(place, str) or "\0" in place + name or Path(name).name != name:
        raise InvalidDocument(WHAT, [(MAPPING, f"{name[:60]!r} has no folder")])
    file = (folder / place / name).resolve()
    if not file.is_relative_to(folder.resolve().parent):
        raise InvalidDocument(WHAT, [(MAPPING, f"{name[:60]!r} lies outside of the data set")])
    if not file.is_file():
        raise InvalidDocument(WHAT, [("item", f"{name[:60]!r} is not in {folder}")])
    return file


# Private


def _name_at(folder: Path, item: str | None) -> str:
    names = names_in(folder)
    if item is None:
        return names[0]
    if item.isdecimal() and len(item) < 10 and int(item) < len(names):
        return names[int(item)]
    known = ", ".join(names[:MOST_NAMED])
    text = f"{item[:60]!r} is neither a file here nor a number from 0 to {len(names) - 1}; {known}"
    raise InvalidDocument(WHAT, [("item", text)])


def _table(file: Path) -> dict[str, Any]:
    found = read_pickle(file)
    if not isinstance(found, dict) or not all(isinstance(key, str) for key in found):
        raise InvalidDocument(WHAT, [(file.name, "is no dictionary of file names")])
    return found


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


TYPE_OF = {
    "VEHICLE": AgentType.VEHICLE,
    "PEDESTRIAN": AgentType.PEDESTRIAN,
    "CYCLIST": AgentType.BICYCLE,
    "TRAFFIC_CONE": AgentType.TRAFFIC_CONE,
    "TRAFFIC_BARRIER": AgentType.BARRIER,
    "TRAFFIC_OBJECT": AgentType.GENERIC_OBJECT,
    "OTHER": AgentType.GENERIC_OBJECT,
}
BUS = "vehicle.bus"
"""What finer types of buses begin with, where a converter keeps them."""
LEFT_OUT = frozenset({"UNSET", "TRAFFIC_LIGHT"})
DATA_LICENCES = {
    "nuscenes": "nuScenes, CC BY-NC-SA 4.0",
    "waymo": "Waymo Open Dataset licence, non-commercial use",
    "nuplan": "nuPlan, CC BY-NC-SA 4.0",
    "argoverse": "Argoverse 2, CC BY-NC-SA 4.0",
}


class ScenarioNet:
    """The reader of scenario pickles."""

    name = "scenarionet"
    title = "ScenarioNet scenario description (pickle file), or a data set of them (folder)"

    def recognises(self, path: Path) -> bool:
        """A pickle by its name and first byte, not opened as one; a folder by its files."""
        if path.is_dir():
            return is_data_set(path)
        if path.suffix.lower() != ".pkl" or not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(1) == b"\x80"

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Steps in which the ego is there, of one scenario after the other."""
        for item in names_in(path) if path.is_dir() else [None]:
            log, _ = _log(_description(path if item is None else file_in(path, item)))
            seen = np.isfinite(log.ego).all(axis=1)
            frames = np.flatnonzero(seen)
            times_s = log.times_s[seen].tolist()
            for index in frames_every(times_s, every_s):
                time_s = times_s[index] - times_s[0]
                yield Moment(item=item, frame=int(frames[index]), time_s=time_s)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step."""
        if path.is_dir():
            path = file_in(path, item)
            item = path.name
        elif item is not None:
            raise _fault("item", f"a file holds one scenario, {item!r} is not there")
        description = _description(path)
        log, notes = _log(description)
        metadata = description["metadata"]
        current = metadata.get("current_time_index")
        if frame is None:
            frame = current if isinstance(current, int) else 0
        frame_in(WHAT, frame, len(log.times_s))
        place = str(metadata.get("map") or "")[:60]
        data_set = str(metadata.get("dataset") or description.get("version") or "unknown")[:40]
        licence, said = _licence(data_set), str(metadata.get("provenance") or "")[:300]
        return reading_at(
            log,
            frame,
            city_of(description, frame, place_name=place),
            name=name,
            world=f"ScenarioNet frame of {data_set} {place}".strip(),
            provenance=(
                f"{data_set} data set by ScenarioNet, {str(description.get('id'))[:120]}, step "
                f"{frame} of {len(log.times_s)}; {licence or said or 'licence not named'}"
            ),
            licence=licence,
            notes=notes,
            item=item,
        )


# Private


def _fault(place: str, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(place, text)])


def _licence(data_set: str) -> str | None:
    licences = [text for name, text in DATA_LICENCES.items() if name in data_set.lower()]
    return licences[0] if licences else None


def _description(path: Path) -> dict[str, Any]:
    found = read_pickle(path)
    if not isinstance(found, dict):
        raise _fault("", "holds no scenario description")
    for name in ("tracks", "map_features", "metadata"):
        if not isinstance(found.get(name), dict):
            raise _fault(name, "is missing, or is no dictionary")
    return found


def _log(description: dict[str, Any]) -> tuple[Log, list[Note]]:
    tracks, metadata = description["tracks"], description["metadata"]
    ego_id = metadata.get("sdc_id")
    if not isinstance(ego_id, str | int) or ego_id not in tracks:
        raise _fault("metadata.sdc_id", f"{str(ego_id)[:40]!r} is none of the tracks")
    times_s = _times(metadata, description.get("length"), tracks[ego_id])
    made, left_out = [], Counter[str]()
    for key, track in tracks.items():
        kind = track.get("type") if isinstance(track, dict) else None
        if kind in LEFT_OUT:
            left_out[str(kind)] += 1
        elif kind not in TYPE_OF:
            known = ", ".join([*TYPE_OF, *sorted(LEFT_OUT)])
            raise _fault(f"tracks.{key}.type", f"unknown {str(kind)[:40]!r}; known: {known}")
        else:
            made.append((key, _track(key, track, len(times_s))))
    ego = next((track for key, track in made if key == ego_id), None)
    if ego is None:
        raise _fault("metadata.sdc_id", "the ego is of a type that is left out")
    notes = list(left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, left_out))
    length_m, width_m = ego.length_m, ego.width_m
    if width_m > length_m:
        length_m, width_m = width_m, length_m
        notes.append(Note(kind=SceneNoteKind.EGO_SIZE_SWAPPED))
    log = Log(
        what=WHAT,
        times_s=times_s,
        ego=ego.states,
        ego_length_m=length_m,
        ego_width_m=width_m,
        tracks=tuple(
            track
            for key, track in made
            if key != ego_id and np.isfinite(track.states).all(axis=1).any()
        ),
    )
    return log, notes


def _times(metadata: dict[str, Any], length: object, ego: object) -> FloatArray:
    given = metadata.get("ts", metadata.get("timestep"))
    if isinstance(given, list):
        given = np.array([one for one in given if isinstance(one, int | float)], dtype=np.float64)
    if not isinstance(given, np.ndarray):
        steps = length if isinstance(length, int) and 0 < length <= 100_000 else 0
        given = np.arange(steps) * 0.1
    times_s = (
        np.asarray(given, dtype=np.float64).reshape(-1) if given.dtype.kind in "iuf" else None
    )
    if times_s is None or not len(times_s) or not np.isfinite(times_s).all():
        raise _fault("metadata.ts", "must be finite times")
    if (np.diff(times_s) <= 0.0).any():
        raise _fault("metadata.ts", "must ascend")
    made: FloatArray = times_s - times_s[0]
    return made


def _track(key: object, track: dict[str, Any], steps: int) -> LoggedTrack:
    state = track.get("state")
    place = f"tracks.{str(key)[:40]}.state"
    if not isinstance(state, dict):
        raise _fault(place, "is missing")
    position = _column(state, "position", steps, place)
    heading = _column(state, "heading", steps, place)[:, 0]
    velocity = _column(state, "velocity", steps, place)
    valid = _column(state, "valid", steps, place)[:, 0]
    if position.shape[1] < 2 or velocity.shape[1] < 2:
        raise _fault(place, "position and velocity need x and y")
    states = np.column_stack([position[:, :2], heading, np.hypot(*velocity[:, :2].T)])
    seen = (valid > 0.0) & np.isfinite(states).all(axis=1)
    states[~seen] = np.nan
    kind = TYPE_OF[track["type"]]
    finer = track.get("metadata")
    if isinstance(finer, dict) and str(finer.get("type", "")).startswith(BUS):
        kind = AgentType.BUS
    sizes = [
        _usual(_column(state, name, steps, place)[:, 0], seen, usual)
        for name, usual in zip(("length", "width"), LENGTH_WIDTH_M[kind], strict=True)
        if name in state
    ]
    length_m, width_m = sizes if len(sizes) == 2 else LENGTH_WIDTH_M[kind]
    return LoggedTrack(name=str(key), type=kind, length_m=length_m, width_m=width_m, states=states)


def _usual(values: FloatArray, seen: np.ndarray[Any, np.dtype[np.bool_]], usual: float) -> float:
    known = values[seen & np.isfinite(values) & (values > 0.0)]
    return float(np.median(known)) if len(known) else usual


def _column(state: dict[str, Any], name: str, steps: int, place: str) -> FloatArray:
    """A column (T, C) of numbers."""
    value = state.get(name)
    if isinstance(value, list):
        try:
            value = np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            value = None
    if not isinstance(value, np.ndarray) or value.dtype.kind not in "iufb" or value.ndim > 2:
        raise _fault(f"{place}.{name}", "needs an array of numbers")
    if value.ndim == 0 or len(value) != steps:
        length = 0 if value.ndim == 0 else len(value)
        raise _fault(f"{place}.{name}", f"has {length} steps; the scenario has {steps}")
    made: FloatArray = np.asarray(value, dtype=np.float64).reshape(steps, -1)
    if made.shape[1] == 0:
        raise _fault(f"{place}.{name}", "has no numbers")
    return made
