"""The reader of ScenarioNet's scenario descriptions, from nuScenes, Waymo or nuPlan.

A path is a file, or a data set's folder, where `item` is the name of a file or its number from 0.
`frame` is a step; without one the step that the description calls its current one, else 0. A
folder holds a file for each scenario and may hold two indices:

    dataset_summary.pkl  file name -> what the scenario is
    dataset_mapping.pkl  file name -> the folder that it lies in, from here
"""

from collections import Counter
from collections.abc import Iterator
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
    moments_of,
    reading_at,
)
from augment.formats.road_map import (
    FURTHEST_M,
    NARROWEST_M,
    WIDEST_M,
    FloatArray,
    RoadMap,
    Segment,
    crossing_segments,
    edge_of,
    fill_widths,
    left_out_notes,
    map_notes,
    width_of,
)
from augment.formats.scenarionet.unpickling import WHAT, read_pickle
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, AreaKind, TrafficLight, TrafficSide
from augment.scene.recording import Note, SceneNoteKind

SUMMARY, MAPPING = "dataset_summary.pkl", "dataset_mapping.pkl"
ENDING = ".pkl"
_SCENARIOS = "sd_*.pkl"
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
LIGHT_OF = {
    "GO": TrafficLight.GREEN,
    "GREEN": TrafficLight.GREEN,
    "CAUTION": TrafficLight.YELLOW,
    "YELLOW": TrafficLight.YELLOW,
    "STOP": TrafficLight.RED,
    "RED": TrafficLight.RED,
    "UNKNOWN": TrafficLight.UNKNOWN,
}


class ScenarioNet:
    """The reader of scenario pickles."""

    name = "scenarionet"
    title = "ScenarioNet scenario description (pickle file), or a data set of them (folder)"

    def recognises(self, path: Path) -> bool:
        """A pickle by its name and first byte, not opened as one; a folder by its files."""
        if path.is_dir():
            return (path / SUMMARY).is_file() or any(path.glob(_SCENARIOS))
        if path.suffix.lower() != ENDING or not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(1) == b"\x80"

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Steps in which the ego is there, of one scenario after the other."""
        for item in _names_in(path) if path.is_dir() else [None]:
            file = path if item is None else _file_in(path, item)
            log, _ = _log(_description(file))
            yield from moments_of(log, every_s, item)

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step."""
        if path.is_dir():
            path = _file_in(path, item)
            item = path.name
        elif item is not None:
            raise _fault("item", f"a file holds one scenario, {item!r} is not there")
        description = _description(path)
        log, notes = _log(description)
        metadata = description["metadata"]
        if frame is None:
            current = metadata.get("current_time_index")
            frame = current if isinstance(current, int) else 0
        frame_in(WHAT, frame, len(log.times_s))
        place = str(metadata.get("map") or "")[:60]
        data_set = str(metadata.get("dataset") or description.get("version") or "unknown")[:40]
        licences = [text for one, text in DATA_LICENCES.items() if one in data_set.lower()]
        own = str(metadata.get("provenance") or "licence not named")[:300]
        return reading_at(
            log,
            frame,
            _city(description, frame, place),
            name=name,
            world=f"ScenarioNet frame of {data_set} {place}".strip(),
            provenance=(
                f"{data_set} data set by ScenarioNet, {str(description.get('id'))[:120]}, step "
                f"{frame} of {len(log.times_s)}; {(*licences, own)[0]}"
            ),
            licence=next(iter(licences), None),
            notes=notes,
            item=item,
        )


def _fault(place: str, text: str) -> InvalidDocument:
    return InvalidDocument(WHAT, [(place, text)])


# Folders


def _table(file: Path) -> dict[str, Any]:
    found = read_pickle(file) if file.is_file() else {}
    if not isinstance(found, dict) or not all(isinstance(key, str) for key in found):
        raise _fault(file.name, "is no dictionary of file names")
    return found


def _names_in(folder: Path) -> list[str]:
    """The file names of all scenarios, in the summary's order, else in the alphabet's."""
    names = [name for name in _table(folder / SUMMARY) if name.endswith(ENDING)]
    names = names or sorted(file.name for file in folder.glob(_SCENARIOS))
    if not names:
        raise _fault(str(folder), "holds no scenario")
    return names


def _file_in(folder: Path, item: str | None) -> Path:
    """The file of that name or number, the first for None; not outside of the data set."""
    name = item or "0"
    if not name.endswith(ENDING):
        names = _names_in(folder)
        if not name.isdecimal() or len(name) > 9 or int(name) >= len(names):
            text = f"{name[:60]!r} is neither a file here nor a number from 0 to {len(names) - 1}"
            raise _fault("item", f"{text}; {', '.join(names[:12])}")
        name = names[int(name)]
    place = _table(folder / MAPPING).get(name, "")
    if not isinstance(place, str) or "\0" in place + name or Path(name).name != name:
        raise _fault(MAPPING, f"{name[:60]!r} has no folder")
    file = (folder / place / name).resolve()
    if not file.is_relative_to(folder.resolve().parent):
        raise _fault(MAPPING, f"{name[:60]!r} lies outside of the data set")
    if not file.is_file():
        raise _fault("item", f"{name[:60]!r} is not in {folder}")
    return file


# Tracks


def _description(path: Path) -> dict[str, Any]:
    found = read_pickle(path)
    if not isinstance(found, dict):
        raise _fault("", "holds no scenario description")
    for name in ("tracks", "map_features", "metadata"):
        if not isinstance(found.get(name), dict):
            raise _fault(name, "is missing, or is no dictionary")
    return found


def _array(value: object, place: str) -> FloatArray:
    """Numbers of one or two dimensions as (N, C)."""
    try:
        made = np.array(value)
    except ValueError:
        made = np.array(None)
    if made.dtype.kind not in "iufb" or made.ndim not in (1, 2):
        raise _fault(place, "needs an array of numbers")
    return np.asarray(made, dtype=np.float64).reshape(len(made), -1)


def _log(description: dict[str, Any]) -> tuple[Log, list[Note]]:
    tracks, metadata = description["tracks"], description["metadata"]
    ego_id = metadata.get("sdc_id")
    if not isinstance(ego_id, str | int) or ego_id not in tracks:
        raise _fault("metadata.sdc_id", f"{str(ego_id)[:40]!r} is none of the tracks")
    given = metadata.get("ts", metadata.get("timestep"))
    if given is None:
        length = description.get("length")
        given = np.arange(length if isinstance(length, int) and length <= 100_000 else 0) * 0.1
    times_s = _array(given, "metadata.ts").reshape(-1)
    if not len(times_s) or not np.isfinite(times_s).all() or (np.diff(times_s) <= 0.0).any():
        raise _fault("metadata.ts", "must be finite times that ascend")
    made, left_out = {}, Counter[str]()
    for key, track in tracks.items():
        kind = track.get("type") if isinstance(track, dict) else None
        if kind in LEFT_OUT:
            left_out[kind] += 1
        elif kind in TYPE_OF:
            made[key] = _track(str(key), track, len(times_s))
        else:
            known = ", ".join([*TYPE_OF, *sorted(LEFT_OUT)])
            raise _fault(f"tracks.{key}.type", f"unknown {str(kind)[:40]!r}; known: {known}")
    if ego_id not in made:
        raise _fault("metadata.sdc_id", "the ego is of a type that is left out")
    notes = left_out_notes(SceneNoteKind.OBJECTS_LEFT_OUT, left_out)
    ego = made.pop(ego_id)
    if ego.width_m > ego.length_m:
        notes.append(Note(kind=SceneNoteKind.EGO_SIZE_SWAPPED))
    log = Log(
        what=WHAT,
        times_s=times_s - times_s[0],
        ego=ego.states,
        ego_length_m=max(ego.length_m, ego.width_m),
        ego_width_m=min(ego.length_m, ego.width_m),
        tracks=tuple(track for track in made.values() if np.isfinite(track.states).any()),
    )
    return log, notes


def _track(key: str, track: dict[str, Any], steps: int) -> LoggedTrack:
    state = track.get("state")
    place = f"tracks.{key[:40]}.state"
    if not isinstance(state, dict):
        raise _fault(place, "is missing")
    columns = {}
    for name, needed in _COLUMNS.items():
        if needed or name in state:
            column = _array(state.get(name), f"{place}.{name}")
            if len(column) != steps:
                text = f"has {len(column)} steps; the scenario has {steps}"
                raise _fault(f"{place}.{name}", text)
            if column.shape[1] < needed:
                raise _fault(f"{place}.{name}", f"needs {needed} numbers a step")
            columns[name] = column
    speed_mps = np.hypot(*columns["velocity"][:, :2].T)
    states = np.column_stack([columns["position"][:, :2], columns["heading"][:, 0], speed_mps])
    seen = (columns["valid"][:, 0] > 0.0) & np.isfinite(states).all(axis=1)
    states[~seen] = np.nan
    finer = track.get("metadata")
    is_bus = isinstance(finer, dict) and str(finer.get("type", "")).startswith(BUS)
    kind = AgentType.BUS if is_bus else TYPE_OF[track["type"]]
    sizes_m = list(LENGTH_WIDTH_M[kind])
    if "length" in columns and "width" in columns:
        for number, name in enumerate(("length", "width")):
            values = columns[name][seen, 0]
            known = values[np.isfinite(values) & (values > 0.0)]
            sizes_m[number] = float(np.median(known)) if len(known) else sizes_m[number]
    length_m, width_m = sizes_m
    return LoggedTrack(name=key, type=kind, length_m=length_m, width_m=width_m, states=states)


_COLUMNS = {"position": 2, "heading": 1, "velocity": 2, "valid": 1, "length": 0, "width": 0}
"""How many numbers a step needs; 0 where the column may be missing."""


# The map


def _points(value: object, place: str) -> FloatArray:
    """The points (P, 2) of a line or polygon; what lies in z is left."""
    points = _array(value, place)
    if points.shape[1] not in (2, 3):
        raise _fault(place, "needs points of two or three numbers")
    if not (np.abs(points) <= FURTHEST_M).all():
        raise _fault(place, f"needs finite numbers up to {FURTHEST_M:.0e}")
    return points[:, :2]


def _city(description: dict[str, Any], frame: int, place_name: str) -> RoadMap:
    """The map with the lights of one step."""
    lights = _lights(description.get("dynamic_map_states") or {}, frame)
    lanes, areas, left_out = {}, [], Counter[str]()
    for key, feature in description["map_features"].items():
        kind = feature.get("type") if isinstance(feature, dict) else None
        if not isinstance(kind, str):
            raise _fault(f"map_features.{key}", "needs a type")
        if kind in LANES:
            lanes[str(key)] = feature
        elif kind in AREA_OF and feature.get("polygon") is not None:
            ring = _points(feature["polygon"], f"map_features.{key}")
            if len(np.unique(ring, axis=0)) >= 3:
                areas.append((AREA_OF[kind], ring))
        elif not kind.startswith(PASSED_OVER):
            left_out[kind] += 1
    connectors = {key for key, lane in lanes.items() if lane["type"] == CONNECTOR}
    meaningless = {
        key for key in connectors if lanes[key].get("speed_limit_kmh") == MEANINGLESS_KMH
    }
    if any(lanes[key].get("speed_limit_kmh") for key in lanes.keys() - connectors):
        meaningless = set()
    built = [_segment(key, lane, key in meaningless, lights) for key, lane in lanes.items()]
    if not connectors:
        crossing = crossing_segments({one.name: one for one in built})
        built = [replace(one, crosses=one.crosses or one.name in crossing) for one in built]
    segments, assumed = fill_widths(built)
    told = description["metadata"].get("traffic_side")  # by our own writer alone
    is_left = told == "left" or place_name.lower().startswith(LEFT_HAND)
    notes = []
    if meaningless:
        kind, limit_mps = SceneNoteKind.SPEED_LIMITS_IGNORED, round(MEANINGLESS_KMH / 3.6, 1)
        notes.append(Note(kind=kind, number=len(meaningless), value=limit_mps))
    kinds = {kind for kind, _ in areas}
    return RoadMap(
        what=WHAT,
        place="map_features",
        segments=segments,
        areas=tuple(areas),
        side=TrafficSide.LEFT if is_left and told != "right" else TrafficSide.RIGHT,
        is_side_told=told in ("left", "right"),
        notes=(
            *notes,
            *map_notes(
                segments,
                assumed=assumed,
                there={
                    SceneNoteKind.NO_CONNECTIVITY: any(
                        one.successors or one.predecessors for one in segments
                    ),
                    SceneNoteKind.NO_INTERSECTIONS: any(one.crosses for one in segments),
                    SceneNoteKind.NO_LIGHTS: bool(lights),
                    SceneNoteKind.NO_WALKWAYS: AreaKind.WALKWAY in kinds,
                    SceneNoteKind.NO_DRIVABLE_AREAS: AreaKind.DRIVABLE in kinds,
                },
                counts={SceneNoteKind.BICYCLE_LANES_LEFT_OUT: left_out.pop(BICYCLE_LANE, 0)},
                left_out=left_out,
            ),
        ),
    )


def _lights(states: object, frame: int) -> dict[str, TrafficLight]:
    """The state by lane at a step."""
    if not isinstance(states, dict):
        raise _fault("dynamic_map_states", "is no dictionary")
    lights = {}
    for key, light in states.items():
        state = light.get("state") if isinstance(light, dict) else None
        steps = state.get("object_state") if isinstance(state, dict) else None
        if not isinstance(light, dict):
            continue
        steps = steps.tolist() if isinstance(steps, np.ndarray) else steps
        shown = steps[frame] if isinstance(steps, list) and frame < len(steps) else None
        word = str(shown or "UNKNOWN").rsplit("_", 1)[-1].upper()
        if word not in LIGHT_OF:
            text = f"unknown state {str(shown)[:40]!r}; known endings: {', '.join(LIGHT_OF)}"
            raise _fault(f"dynamic_map_states.{key}", text)
        lights[str(light.get("lane", key))] = LIGHT_OF[word]
    return lights


def _segment(
    key: str, lane: dict[str, Any], is_meaningless: bool, lights: dict[str, TrafficLight]
) -> Segment:
    line = _points(lane.get("polyline"), f"map_features.{key}")
    limits = []
    for name, factor in (("speed_limit_kmh", 1.0 / 3.6), ("speed_limit_mph", 0.44704)):
        value = lane.get(name)
        value = value[0] if isinstance(value, list) and len(value) == 1 else value
        if isinstance(value, int | float) and 0.0 < value <= 300.0:
            limits.append(round(float(value) * factor, 3))
    return Segment(
        name=key,
        crosses=lane["type"] == CONNECTOR or lane.get("interpolating") is True or key in lights,
        centerline=line,
        width_m=_width(lane, line, f"map_features.{key}"),
        successors=_names(lane.get("exit_lanes")),
        predecessors=_names(lane.get("entry_lanes")),
        left_neighbors=_names(lane.get("left_neighbor")),
        right_neighbors=_names(lane.get("right_neighbor")),
        speed_limit_mps=limits[0] if limits and not is_meaningless else None,
        light=lights.get(key, TrafficLight.UNKNOWN),
    )


def _names(value: object) -> tuple[str, ...]:
    """Ids of lanes, given as such or as dictionaries with one."""
    given = value if isinstance(value, list) else []
    names = [one.get("feature_id") if isinstance(one, dict) else one for one in given]
    return tuple(str(name) for name in names if isinstance(name, str | int))


def _width(lane: dict[str, Any], line: FloatArray, place: str) -> float | None:
    """The widths that the file gives, else of the lane's polygon: where it is cut across."""
    given = lane.get("width")
    if isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == 2:
        widths = given.sum(axis=1)
        known = widths[(widths >= NARROWEST_M) & (widths <= WIDEST_M)]
        if len(known):
            return float(np.median(known))
    if lane.get("polygon") is None or len(line) < 2:
        return None
    ring = _points(lane["polygon"], place)
    # The outline's points to the left and to the right of the lane's middle, along it.
    nearest = np.hypot(*np.moveaxis(ring[:, None] - line[:-1], 2, 0)).argmin(axis=1)
    step, offset = np.diff(line, axis=0)[nearest], ring - line[nearest]
    aside = step[:, 0] * offset[:, 1] - step[:, 1] * offset[:, 0]
    along = np.argsort(nearest, kind="stable")
    sides = [ring[along][aside[along] > 0.0], ring[along][aside[along] < 0.0]]
    if min(map(len, sides)) < 2:
        return None
    inner = line[len(line) // 4 : max(3 * len(line) // 4, len(line) // 4 + 1)]
    left, right = (edge_of(inner, [(0, len(line), side)]) for side in sides)
    return width_of(inner, left, right)
