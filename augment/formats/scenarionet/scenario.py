"""The reader of ScenarioNet's scenario descriptions, from nuScenes, Waymo or nuPlan.

A path is a file, or a data set's folder, where `item` is the name of a scenario's file in it or
below it; its index files are not needed. `frame` is a step; without one the step that the
description calls its current one, else 0.
"""

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from augment.formats.reading import Log, LoggedTrack, LogReader
from augment.formats.road_map import NARROWEST_M, WIDEST_M, RoadMap, Segment, left_out_notes
from augment.formats.scenarionet.unpickling import read_pickle
from augment.formats.values import (
    FloatArray,
    fault_at,
    look_up,
    read_finite,
    read_numbers,
    read_times,
)
from augment.scene.entities import LENGTH_WIDTH_M, AgentType, AreaKind, TrafficLight, TrafficSide

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
CONNECTOR, BICYCLE_LANE = "LANE_SURFACE_UNSTRUCTURE", "LANE_BIKE_LANE"
LANES = frozenset(
    {"LANE_SURFACE_STREET", "LANE_FREEWAY", "LANE_UNKNOWN", "LANE_BUS_LANE", CONNECTOR}
)
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
_COLUMNS = {"position": 2, "heading": 1, "velocity": 2, "valid": 1}
"""How many numbers a step needs."""


class ScenarioNet(LogReader):
    """The reader of scenario pickles."""

    name = "scenarionet"
    title = "ScenarioNet scenario description (pickle file), or a data set of them (folder)"
    suffix, marker = ".pkl", b"\x80"

    def recognises(self, path: Path) -> bool:
        """A pickle by its name and first bytes, not opened as one; a folder by its files."""
        if path.is_dir():
            return any(path.glob(_SCENARIOS)) or any(path.glob(f"*/{_SCENARIOS}"))
        return super().recognises(path)

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """The scenario of a file, or one or all of a folder's."""
        if not path.is_dir():
            if item is not None:
                raise fault_at("item", f"a file holds one scenario, {item!r} is not there")
            yield _log(path, None)
            return
        files = {file.name: file for file in sorted(path.rglob(_SCENARIOS))}
        chosen = files.values() if item is None else [look_up(files, item, "item")]
        yield from (_log(file, file.name) for file in chosen)


# Tracks


def _log(path: Path, item: str | None) -> Log:
    description = read_pickle(path)
    for name in ("tracks", "map_features", "metadata"):
        if not isinstance(description, dict) or not isinstance(description.get(name), dict):
            raise fault_at(name, "is missing, or is no dictionary")
    metadata = description["metadata"]
    given = metadata.get("ts", metadata.get("timestep"))
    if given is None:
        length = description.get("length")
        given = np.arange(length if isinstance(length, int) and length <= 100_000 else 0) * 0.1
    times_s = read_times(given, "metadata.ts")
    tracks, left_out = {}, Counter[str]()
    for key, track in description["tracks"].items():
        kind = track.get("type") if isinstance(track, dict) else None
        if kind in LEFT_OUT:
            left_out[kind] += 1
        else:
            place = f"tracks.{str(key)[:40]}"
            look_up(TYPE_OF, kind, f"{place}.type")
            tracks[str(key)] = _track(str(key), track, len(times_s), place)
    ego = look_up(tracks, str(metadata.get("sdc_id")), "metadata.sdc_id")
    del tracks[ego.name]
    notes = left_out_notes("objects", left_out)
    if ego.width_m > ego.length_m:
        notes.append("The ego's length and width were swapped and put right.")
    current, city = metadata.get("current_time_index"), str(metadata.get("map") or "")[:60]
    data_set = str(metadata.get("dataset") or description.get("version") or "unknown")[:40]
    licences = [text for name, text in DATA_LICENCES.items() if name in data_set.lower()]
    own = str(metadata.get("provenance") or "licence not named")[:300]
    return Log(
        times_s=times_s,
        ego=ego.states,
        ego_size_m=(max(ego.length_m, ego.width_m), min(ego.length_m, ego.width_m)),
        tracks=[track for track in tracks.values() if np.isfinite(track.states).any()],
        map_at=lambda frame: _city(description, frame, city),
        world=f"ScenarioNet frame of {data_set} {city}".strip(),
        title=f"{data_set} data set by ScenarioNet, {str(description.get('id'))[:120]}",
        licence=next(iter(licences), own),
        is_free=not licences,
        item=item,
        frame=current if isinstance(current, int) else 0,
        notes=notes,
    )


def _track(key: str, track: dict[str, Any], steps: int, place: str) -> LoggedTrack:
    state = track.get("state")
    if not isinstance(state, dict):
        raise fault_at(f"{place}.state", "is missing")
    columns = {
        name: read_numbers(state.get(name), f"{place}.state.{name}", needed)
        for name, needed in _COLUMNS.items()
    }
    known = {
        size: read_numbers(state[size], place)[:, 0]
        for size in ("length", "width")
        if size in state
    }
    for name, column in (columns | known).items():
        if len(column) != steps:
            text = f"has {len(column)} steps; the scenario has {steps}"
            raise fault_at(f"{place}.state.{name}", text)
    speed_mps = np.hypot(*columns["velocity"].T)
    states = np.column_stack([columns["position"], columns["heading"], speed_mps])
    seen = (columns["valid"][:, 0] > 0.0) & np.isfinite(states).all(axis=1)
    states[~seen] = np.nan
    finer = track.get("metadata")
    is_bus = isinstance(finer, dict) and str(finer.get("type", "")).startswith(BUS)
    kind = AgentType.BUS if is_bus else TYPE_OF[track["type"]]
    sizes_m = list(LENGTH_WIDTH_M[kind])
    for number, column in enumerate(known.values() if len(known) == 2 else ()):
        values = column[seen & np.isfinite(column) & (column > 0.0)]
        sizes_m[number] = float(np.median(values)) if len(values) else sizes_m[number]
    return LoggedTrack(name=key, type=kind, length_m=sizes_m[0], width_m=sizes_m[1], states=states)


# The map


def _city(description: dict[str, Any], frame: int, city_name: str) -> RoadMap:
    """The map with the lights of one step."""
    lights = _lights(description.get("dynamic_map_states") or {}, frame)
    lanes, areas, left_out = {}, [], Counter[str]()
    for key, feature in description["map_features"].items():
        kind = feature.get("type") if isinstance(feature, dict) else None
        if not isinstance(kind, str):
            raise fault_at(f"map_features.{key}", "needs a type")
        if kind in LANES:
            lanes[str(key)] = feature
        elif kind in AREA_OF and feature.get("polygon") is not None:
            ring = read_finite(feature["polygon"], f"map_features.{key}", 2)
            if len(np.unique(ring, axis=0)) >= 3:
                areas.append((AREA_OF[kind], ring))
        elif not kind.startswith(PASSED_OVER):
            left_out["bicycle lanes" if kind == BICYCLE_LANE else kind] += 1
    connectors = {key for key, lane in lanes.items() if lane["type"] == CONNECTOR}
    is_limit_meant = any(lanes[key].get("speed_limit_kmh") for key in lanes.keys() - connectors)
    for key in connectors:
        if lanes[key].get("speed_limit_kmh") == MEANINGLESS_KMH and not is_limit_meant:
            lanes[key] = lanes[key] | {"speed_limit_kmh": None}
    told = description["metadata"].get("traffic_side")  # by our own writer alone
    is_left = told == "left" or city_name.lower().startswith(LEFT_HAND)
    return RoadMap(
        place="map_features",
        segments=tuple(_segment(key, lane, lights) for key, lane in lanes.items()),
        areas=tuple(areas),
        side=TrafficSide.LEFT if is_left and told != "right" else TrafficSide.RIGHT,
        is_side_told=told in ("left", "right"),
        left_out=left_out,
        tells_crossings=bool(connectors),
    )


def _lights(states: object, frame: int) -> dict[str, TrafficLight]:
    """The state by lane at a step."""
    lights = {}
    for key, light in states.items() if isinstance(states, dict) else ():
        state = light.get("state") if isinstance(light, dict) else None
        steps = state.get("object_state") if isinstance(state, dict) else None
        if not isinstance(light, dict):
            continue
        steps = steps.tolist() if isinstance(steps, np.ndarray) else steps
        shown = steps[frame] if isinstance(steps, list) and frame < len(steps) else None
        word = str(shown or "UNKNOWN").rsplit("_", 1)[-1].upper()
        lights[str(light.get("lane", key))] = look_up(LIGHT_OF, word, f"dynamic_map_states.{key}")
    return lights


def _segment(key: str, lane: dict[str, Any], lights: dict[str, TrafficLight]) -> Segment:
    place = f"map_features.{key}"
    line = read_finite(lane.get("polyline"), place, 2)
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
        width_m=_width(lane, line, place),
        successors=_names(lane.get("exit_lanes")),
        predecessors=_names(lane.get("entry_lanes")),
        left_neighbors=_names(lane.get("left_neighbor")),
        right_neighbors=_names(lane.get("right_neighbor")),
        speed_limit_mps=next(iter(limits), None),
        light=lights.get(key, TrafficLight.UNKNOWN),
    )


def _names(value: object) -> tuple[str, ...]:
    """Ids of lanes, given as such or as dictionaries with one."""
    given = value if isinstance(value, list) else []
    names = [one.get("feature_id") if isinstance(one, dict) else one for one in given]
    return tuple(str(name) for name in names if isinstance(name, str | int))


def _width(lane: dict[str, Any], line: FloatArray, place: str) -> float | None:
    """The median of the widths that the file gives, else the lane's area over its length."""
    given, polygon = lane.get("width"), lane.get("polygon")
    widths = np.empty(0)
    if isinstance(given, np.ndarray) and given.ndim == 2 and given.shape[1] == 2:
        widths = given.sum(axis=1)
    elif polygon is not None and len(line) >= 2:
        length_m = max(float(np.hypot(*np.diff(line, axis=0).T).sum()), 1e-6)
        ring = read_finite(polygon, place, 2)
        widths = np.array([shapely.Polygon(ring).area / length_m]) if len(ring) >= 3 else widths
    known = widths[(widths >= NARROWEST_M) & (widths <= WIDEST_M)]
    return float(np.median(known)) if len(known) else None
