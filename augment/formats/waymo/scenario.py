"""The reader of Waymo Open Motion scenario files.

`item` is the number of a record in the file, `frame` a step of it; without one the step that the
scenario calls its current one (1.1 s after its start). Coordinates are the data set's own.
"""

from __future__ import annotations

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
from augment.formats.road_map import left_out_notes
from augment.formats.waymo.scenario import (
    WHAT,
    city_of,
    read_records,
    read_scenario,
    starts_a_record,
    states_of,
)
from augment.scene.entities import AgentType
from augment.scene.recording import SceneNoteKind

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
