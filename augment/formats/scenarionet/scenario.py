"""The reader of ScenarioNet's scenario descriptions, from nuScenes, Waymo or nuPlan.

A path is a file, or a data set's folder, where `item` is the name of a file or its number from 0.
`frame` is a step; without one the step that the description calls its current one, else 0.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
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
from augment.formats.road_map import FloatArray, left_out_notes
from augment.formats.scenarionet.scenario import city_of, file_in, is_data_set, names_in
from augment.formats.scenarionet.unpickling import WHAT, read_pickle
from augment.scene.entities import LENGTH_WIDTH_M, AgentType
from augment.scene.recording import Note, SceneNoteKind

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
