"""The reader of ScenarioNet's scenario descriptions, from nuScenes, Waymo or nuPlan.

A path is a file, or a data set's folder, where `item` is the name of a scenario's file in it or
below it; its index files are not needed. `frame` is a step; without one the step that the
description calls its current one, else 0.
"""

from collections import Counter
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats.reading import Log, LogReader, read_each
from augment.formats.road_map import NARROWEST_M, WIDEST_M, RoadMap, Segment, note_left_out
from augment.formats.scenarionet.unpickling import read_pickle
from augment.scene.entities import AgentType, AreaKind, TrafficLight, TrafficSide
from augment.scene.recording import Track

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
AREA_OF = {"CROSSWALK": AreaKind.CROSSWALK, "DRIVEWAY": AreaKind.DRIVABLE} | dict.fromkeys(
    ("ROAD_EDGE_SIDEWALK", "BOUNDARY_SIDEWALK", "SIDEWALK"), AreaKind.WALKWAY
)
PASSED_OVER = ("ROAD_LINE_", "ROAD_EDGE_", "BOUNDARY_")
"""Lines on the road and along it, which are no part of a scene."""
MEANINGLESS_KMH = 100.0
"""What converters from nuScenes write for every connector."""
LEFT_HAND = ("singapore", "sg-", "sg_")
LIGHT_OF = {"": TrafficLight.UNKNOWN} | foreign.name_all(
    {
        TrafficLight.GREEN: "GO GREEN",
        TrafficLight.YELLOW: "CAUTION YELLOW",
        TrafficLight.RED: "STOP RED",
        TrafficLight.UNKNOWN: "UNKNOWN",
    }
)
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
        chosen = files.values() if item is None else [foreign.look_up(files, item, "item")]
        yield from read_each(partial(_log, file, file.name) for file in chosen)


# Tracks


def _log(path: Path, item: str | None) -> Log:
    description = foreign.read_as(read_pickle(path), dict, "scenario")
    for name in ("tracks", "map_features", "metadata"):
        foreign.read_as(description.get(name), dict, name)
    metadata, doubts = description["metadata"], Doubts()
    times = metadata.get("ts", metadata.get("timestep"))
    if times is None:
        length = description.get("length")
        doubts.assume("Steps without times are taken as 0.1 s apart")
        times = np.arange(length if isinstance(length, int) and length <= 100_000 else 0) * 0.1
    times_s = foreign.read_times(times, "metadata.ts")
    tracks, left_out = dict[str, Track](), Counter[str]()
    for key, track in description["tracks"].items():
        with doubts.about("objects"):
            track = foreign.read_as(track, dict, f"tracks.{key}")
            kind = foreign.read_as(track.get("type"), str, f"tracks.{key}.type")
            if kind in LEFT_OUT:
                left_out[kind] += 1
                continue
            tracks[str(key)] = _track(str(key), track, len(times_s), doubts)
    ego_id = str(metadata.get("sdc_id"))
    if ego_id in map(str, description["tracks"].keys() - tracks.keys()):
        raise fault_at("metadata.sdc_id", " ".join([f"{ego_id} is no ego.", *doubts.notes]))
    ego = foreign.look_up(tracks, ego_id, "metadata.sdc_id")
    del tracks[ego.agent_id]
    if ego.width_m > ego.length_m:
        doubts.assume("The ego's length and width were swapped and put right")
    current = metadata.get("current_time_index")
    bounds = "current_time_index", 0, len(times_s) - 1
    frame = doubts.read("current times", foreign.read_whole, current, *bounds)
    texts = {
        name: doubts.read("names", foreign.read_as, values.get(name), str, name) or ""
        for values, name in (
            *((metadata, name) for name in ("dataset", "map", "provenance", "traffic_side")),
            *((description, name) for name in ("version", "id")),
        )
    }
    city, data_set = texts["map"][:60], (texts["dataset"] or texts["version"] or "unknown")[:40]
    licences = [text for name, text in DATA_LICENCES.items() if name in data_set.lower()]
    return Log(
        times_s=times_s,
        ego=ego.states,
        ego_size_m=(max(ego.length_m, ego.width_m), min(ego.length_m, ego.width_m)),
        tracks=[track for track in tracks.values() if np.isfinite(track.states).any()],
        map_at=lambda frame: _city(description, frame, city, texts["traffic_side"]),
        world=f"ScenarioNet frame of {data_set} {city}".strip(),
        title=f"{data_set} data set by ScenarioNet, {texts['id'][:120]}",
        licence=next(iter(licences), texts["provenance"][:300] or "licence not named"),
        is_free=not licences,
        item=item,
        frame=frame or 0,
        notes=[*note_left_out("objects", left_out), *doubts.notes],
    )


def _track(key: str, track: Any, steps: int, doubts: Doubts) -> Track:
    place = f"tracks.{key[:40]}"
    kind = foreign.look_up(TYPE_OF, track.get("type"), f"{place}.type")
    state = foreign.read_as(track.get("state"), dict, f"{place}.state")
    columns = {
        name: _column(state.get(name), steps, f"{place}.state.{name}", needed)
        for name, needed in _COLUMNS.items()
    }
    speed_mps = np.hypot(*columns["velocity"].T)
    states = np.column_stack([columns["position"], columns["heading"], speed_mps])
    valid = columns["valid"][:, 0]
    seen = ~(valid <= 0.0)
    odd = seen & ~np.isfinite(np.column_stack([states, valid])).all(axis=1)
    doubts.assume("A state that is valid and not finite was left out", int(odd.sum()))
    states[~seen | odd] = np.nan
    finer = doubts.read("finer types", foreign.read_as, track.get("metadata"), dict, place) or {}
    finest = doubts.read("finer types", foreign.read_as, finer.get("type"), str, place) or ""
    sizes_m = [0.0, 0.0]
    for number, name in enumerate(("length", "width")):
        with doubts.about("sizes"):
            column = _column(state.get(name, [0.0] * steps), steps, f"{place}.{name}", 1)[:, 0]
            values = column[seen & ~odd & np.isfinite(column) & (column > 0.0)]
            sizes_m[number] = float(np.median(values)) if len(values) else 0.0
    return Track(
        agent_id=key,
        type=AgentType.BUS if finest.startswith(BUS) else kind,
        length_m=sizes_m[0],
        width_m=sizes_m[1],
        states=states,
    )


def _column(value: object, steps: int, place: str, needed: int) -> FloatArray:
    """The rows (T, C) of each step."""
    rows = foreign.read_numbers(value, place, needed)
    if len(rows) != steps:
        raise fault_at(place, f"has {len(rows)} steps; the scenario has {steps}")
    return rows


# The map


def _city(description: dict[str, Any], frame: int, city_name: str, side: str) -> RoadMap:
    """The map with the lights of one step."""
    doubts = Doubts()
    states = description.get("dynamic_map_states")
    states = doubts.read("lights", foreign.read_as, states, dict, "dynamic_map_states") or {}
    lights = dict(doubts.read_all("lights", _light, ((*light, frame) for light in states.items())))
    lanes, areas, left_out = dict[str, dict[str, Any]](), [], Counter[str]()
    for key, value in description["map_features"].items():
        place = f"map_features.{str(key)[:40]}"
        with doubts.about("parts of the map"):
            feature = foreign.read_as(value, dict, place)
            kind = foreign.read_as(feature.get("type"), str, f"{place}.type")
            if kind in LANES:
                limit = feature.get("speed_limit_kmh")
                limit = limit.tolist() if isinstance(limit, np.ndarray) else limit
                lanes[str(key)] = feature | {"speed_limit_kmh": limit}
            elif kind in AREA_OF and feature.get("polygon") is not None:
                areas.append((AREA_OF[kind], foreign.read_finite(feature["polygon"], place, 2)))
            elif not kind.startswith(PASSED_OVER):
                left_out["bicycle lanes" if kind == BICYCLE_LANE else kind] += 1
    idle = len(lights.keys() - lanes.keys())
    doubts.assume("A traffic light governs no lane that is there", idle)
    connectors = {key for key, lane in lanes.items() if lane["type"] == CONNECTOR}
    is_limit_meant = any(lanes[key].get("speed_limit_kmh") for key in lanes.keys() - connectors)
    for key in connectors:
        if lanes[key].get("speed_limit_kmh") == MEANINGLESS_KMH and not is_limit_meant:
            lanes[key] = lanes[key] | {"speed_limit_kmh": None}
    rows = ((*lane, lights, doubts) for lane in lanes.items())
    segments = doubts.read_all("lanes", _segment, rows)
    # Told by our own writer alone.
    sides = dict.fromkeys(("", "left", "right"))
    doubts.doubt_unknown("sides of traffic", sides, [side], "metadata.traffic_side")
    is_left = side == "left" or city_name.lower().startswith(LEFT_HAND)
    return RoadMap(
        place="map_features",
        segments=tuple(segments),
        areas=tuple(areas),
        side=TrafficSide.LEFT if is_left and side != "right" else TrafficSide.RIGHT,
        is_side_told=side in ("left", "right"),
        left_out=left_out,
        tells_crossings=bool(connectors),
        doubts=doubts,
    )


def _light(key: object, light: object, frame: int) -> tuple[str, TrafficLight]:
    """The lane of a light, and its state at a step."""
    place = f"dynamic_map_states.{str(key)[:40]}"
    fields = foreign.read_as(light, dict, place)
    state = foreign.read_as(fields.get("state"), dict, f"{place}.state")
    steps = _list(state.get("object_state"), f"{place}.state.object_state")
    shown = foreign.look_up(dict(enumerate(steps)), frame, f"{place}.state.object_state")
    word = foreign.read_as("" if shown is None else shown, str, place).rsplit("_", 1)[-1].upper()
    return _name(fields.get("lane", key), f"{place}.lane"), foreign.look_up(LIGHT_OF, word, place)


def _segment(
    key: str, lane: dict[str, Any], lights: dict[str, TrafficLight], doubts: Doubts
) -> Segment:
    place = f"map_features.{key[:40]}"
    line = foreign.read_finite(lane.get("polyline"), place, 2)
    units = {"speed_limit_kmh": 1.0 / 3.6, "speed_limit_mph": 0.44704}
    rows = ((lane.get(name), f"{place}.{name}", unit_mps) for name, unit_mps in units.items())
    limits = doubts.read_all("speed limits", _limit, rows)
    joints = {
        name: doubts.read("neighbours of lanes", _names, lane.get(name), f"{place}.{name}") or ()
        for name in ("exit_lanes", "entry_lanes", "left_neighbor", "right_neighbor")
    }
    switch, inner = {True: True, False: False, None: False}, lane.get("interpolating")
    is_inner = doubts.read(
        "fields of lanes", foreign.look_up, switch, inner, f"{place}.interpolating"
    )
    return Segment(
        name=key,
        crosses=lane["type"] == CONNECTOR or bool(is_inner) or key in lights,
        centerline=line,
        width_m=doubts.read("widths of lanes", _width, lane, line, place),
        successors=joints["exit_lanes"],
        predecessors=joints["entry_lanes"],
        left_neighbors=joints["left_neighbor"],
        right_neighbors=joints["right_neighbor"],
        speed_limit_mps=next(iter(limits), None),
        light=lights.get(key, TrafficLight.UNKNOWN),
    )


def _limit(value: object, place: str, unit_mps: float) -> float | None:
    """A limit in m/s; 0 stands for none."""
    if not isinstance(value, str) and foreign.read_number(value, place) == 0.0:
        return None
    return foreign.read_speed(value, place, unit_mps)


def _name(value: object, place: str) -> str:
    if not isinstance(value, str | int) or isinstance(value, bool):
        raise fault_at(place, f"expected an id, got {str(value)[:40]!r}")
    return str(value)


def _list(value: object, place: str) -> list[Any]:
    """A list, or a table as one."""
    return foreign.read_as(value.tolist() if isinstance(value, np.ndarray) else value, list, place)


def _names(value: object, place: str) -> tuple[str, ...]:
    """Ids of lanes, given as such or as dictionaries with one."""
    values = _list(value, place)
    names = [value.get("feature_id") if isinstance(value, dict) else value for value in values]
    return tuple(_name(name, place) for name in names)


def _width(lane: dict[str, Any], line: FloatArray, place: str) -> float | None:
    """The median of the widths that the file gives, else the lane's area over its length."""
    row, polygon = lane.get("width"), lane.get("polygon")
    widths = np.empty(0)
    if row is not None:
        widths = foreign.read_numbers(row, f"{place}.width", 2).sum(axis=1)
    if not len(widths) and polygon is not None and len(line) >= 2:
        length_m = max(float(np.hypot(*np.diff(line, axis=0).T).sum()), 1e-6)
        ring = foreign.read_finite(polygon, f"{place}.polygon", 2)
        widths = np.array([shapely.Polygon(ring).area / length_m]) if len(ring) >= 3 else widths
    usable = widths[(widths >= NARROWEST_M) & (widths <= WIDEST_M)]
    return float(np.median(usable)) if len(usable) else None
