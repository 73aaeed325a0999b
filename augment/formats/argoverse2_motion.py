"""Argoverse 2 Motion Forecasting scenarios: one folder a scenario, 11 s at 10 Hz.

    <id>/scenario_<id>.parquet, <id>/log_map_archive_<id>.json

A frame is a timestep, counted from 0; without one it is the last that the data set calls observed,
so that the future to be forecast is what follows t0. `item` is the track that is to be the ego;
without one the data set's own car. Positions are centres, in the city frame.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.errors import InvalidDocument
from augment.formats.argoverse2 import (
    EGO_LENGTH_M,
    EGO_WIDTH_M,
    LICENCE,
    MOST_NAMED,
    Columns,
    FloatArray,
    map_file_in,
    read_map,
    read_parquet,
)
from augment.formats.reading import Log, LoggedTrack, Moment, Reading, frames_every, reading_at
from augment.scene.entities import LENGTH_WIDTH_M, AgentType
from augment.scene.recording import Note, SceneNoteKind

WHAT = "Argoverse 2 forecasting scenario"
EGO = "AV"
STEP_S = 0.1
MOST_STEPS = 10_000

TYPE_OF = {
    "vehicle": AgentType.VEHICLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "motorcyclist": AgentType.BICYCLE,
    "cyclist": AgentType.BICYCLE,
    "riderless_bicycle": AgentType.BICYCLE,
    "bus": AgentType.BUS,
    "construction": AgentType.TRAFFIC_CONE,
    "static": AgentType.GENERIC_OBJECT,
    "background": AgentType.GENERIC_OBJECT,
    "unknown": AgentType.GENERIC_OBJECT,
}
MERGED = frozenset({"motorcyclist", "riderless_bicycle", "construction", "static", "background"})

_TEXTS = ("track_id", "object_type")
_WHOLE = ("timestep", "observed")
_NUMBERS = ("position_x", "position_y", "heading", "velocity_x", "velocity_y")


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionFile:
    """What a scenario file holds.

    Attributes:
        current: The last observed step.
        kinds: The object types that are here.
    """

    log: Log
    current: int
    kinds: frozenset[str]


class ArgoverseMotion:
    """The reader of Argoverse 2 Motion Forecasting scenarios."""

    name = "av2-motion"
    title = "Argoverse 2 Motion Forecasting scenario (folder, or its parquet file)"

    def recognises(self, path: Path) -> bool:
        """A scenario file by its name, or a folder with one."""
        return any(path.glob("scenario_*.parquet")) if path.is_dir() else _is_scenario(path)

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Steps in which the ego is there."""
        log = _read(_scenario_file(path), EGO).log
        frames = np.flatnonzero(np.isfinite(log.ego).all(axis=1))
        times_s = log.times_s[frames].tolist()
        for index in frames_every(times_s, every_s):
            yield Moment(frame=int(frames[index]), time_s=times_s[index] - times_s[0])

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one step, and what was recorded to the end of the scenario."""
        file = _scenario_file(path)
        forecast = _read(file, item or EGO)
        log = forecast.log
        frame = forecast.current if frame is None else frame
        ego = "" if item is None else f", track {item} as the ego"
        return reading_at(
            log,
            frame,
            read_map(map_file_in(file.parent, WHAT), what=WHAT),
            name=name,
            world="Argoverse 2 city frame",
            provenance=(
                f"Argoverse 2 Motion Forecasting data set, "
                f"{file.stem.removeprefix('scenario_')[:80]}, step {frame} of "
                f"{len(log.times_s)}{ego}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=_notes(forecast.kinds),
            item=item,
        )


# Private


def _notes(kinds: frozenset[str]) -> Iterator[Note]:
    yield Note(kind=SceneNoteKind.NO_BOX_SIZES)
    merged = tuple(f"{kind}: {TYPE_OF[kind].value}" for kind in sorted(kinds & MERGED))
    if merged:
        yield Note(kind=SceneNoteKind.CLASSES_MERGED, names=merged)


def _is_scenario(path: Path) -> bool:
    return path.is_file() and path.name.startswith("scenario_") and path.suffix == ".parquet"


def _scenario_file(path: Path) -> Path:
    files = sorted(path.glob("scenario_*.parquet")) if path.is_dir() else [path]
    if len(files) != 1:
        text = f"{len(files)} such files in {path}; there must be one"
        raise InvalidDocument(WHAT, [("scenario_*.parquet", text)])
    return files[0]


def _read(file: Path, ego_id: str) -> MotionFile:
    columns = read_parquet(file, what=WHAT, numbers=_NUMBERS, texts=_TEXTS, whole=_WHOLE)
    steps = columns["timestep"]
    if not len(steps):
        raise InvalidDocument(WHAT, [(file.name, "has no row")])
    if steps.min() < 0 or steps.max() >= MOST_STEPS:
        raise InvalidDocument(WHAT, [("timestep", f"lies outside of 0 to {MOST_STEPS - 1}")])
    count = int(steps.max()) + 1
    kinds = _kinds(columns)
    names = columns["track_id"].values
    if ego_id not in names:
        known = ", ".join(names[:12])
        raise InvalidDocument(
            WHAT, [("track_id", f"{ego_id[:40]!r} is not there; known: {known}")]
        )
    tracks = _tracks(columns, count)
    seen = columns["observed"] > 0
    log = Log(
        what=WHAT,
        times_s=np.arange(count, dtype=np.float64) * STEP_S,
        ego=tracks.pop(ego_id).states,
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=tuple(tracks.values()),
    )
    return MotionFile(log=log, current=int(steps[seen].max()) if seen.any() else 0, kinds=kinds)


def _kinds(columns: Columns) -> frozenset[str]:
    column = columns["object_type"]
    used = frozenset(column.values[code] for code in np.unique(column.codes))
    unknown = sorted(used - set(TYPE_OF))[:MOST_NAMED]
    if unknown:
        known = ", ".join(TYPE_OF)
        problems = [("object_type", f"unknown {one!r}; known: {known}") for one in unknown]
        raise InvalidDocument(WHAT, problems)
    return used


def _tracks(columns: Columns, count: int) -> dict[str, LoggedTrack]:
    names, kinds, steps = columns["track_id"], columns["object_type"], columns["timestep"]
    speed = np.hypot(columns["velocity_x"], columns["velocity_y"])
    place = [columns[name] for name in ("position_x", "position_y", "heading")]
    rows = np.column_stack([*place, speed])
    return {
        names.values[code]: _track(
            names.values[code], kinds.values[kinds.codes[mine[0]]], steps[mine], rows[mine], count
        )
        for code, mine in _grouped(names.codes)
    }


def _grouped(codes: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """The rows of each code."""
    order = np.argsort(codes, kind="stable")
    found, starts = np.unique(codes[order], return_index=True)
    yield from zip(found.tolist(), np.split(order, starts[1:]), strict=True)


def _track(
    name: str, kind: str, steps: NDArray[np.int64], rows: FloatArray, count: int
) -> LoggedTrack:
    length_m, width_m = LENGTH_WIDTH_M[TYPE_OF[kind]]
    states = np.full((count, 4), np.nan)
    states[steps] = rows
    return LoggedTrack(
        name=name, type=TYPE_OF[kind], length_m=length_m, width_m=width_m, states=states
    )
