"""Argoverse 2 Sensor logs: one folder a log, with boxes, ego poses and a vector map.

    <log>/annotations.feather, <log>/city_SE3_egovehicle.feather, <log>/map/log_map_archive_*.json

A frame is an annotated sweep, counted from 0. The scene's frame is that of t0's ego, with its
origin at the ego's geometric centre (see `log`).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from augment.errors import InvalidDocument
from augment.formats.argoverse2 import BOXES, LICENCE, WHAT, read_log, read_map
from augment.formats.reading import Moment, Reading, frames_every, reading_at
from augment.scene.recording import Note, SceneNoteKind


class ArgoverseSensor:
    """The reader of Argoverse 2 Sensor logs."""

    name = "av2"
    title = "Argoverse 2 Sensor log (folder)"

    def recognises(self, path: Path) -> bool:
        """A folder with annotations."""
        return (path / BOXES).is_file()

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Sweeps that far apart."""
        _check_folder(path)
        times_s = read_log(path).times_s.tolist()
        for frame in frames_every(times_s, every_s):
            yield Moment(frame=frame, time_s=times_s[frame] - times_s[0])

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one annotated sweep, and what was recorded to the end of the log."""
        _check_folder(path)
        if item is not None:
            raise InvalidDocument(WHAT, [("item", f"a log has no parts, {item!r} is not there")])
        frame = frame or 0
        map_file = map_file_in(path / "map", WHAT)
        log = read_log(path)
        return reading_at(
            log,
            frame,
            read_map(map_file, what=WHAT),
            name=name,
            world=city_of(map_file),
            provenance=(
                f"Argoverse 2 Sensor data set, log {path.resolve().name}, frame {frame} of "
                f"{len(log.times_s)}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=[Note(kind=SceneNoteKind.SPEEDS_DIFFERENCED)],
        )


def map_file_in(folder: Path, what: str) -> Path:
    """The one map archive in a folder.

    Raises:
        InvalidDocument: There is none, or several.
    """
    files = sorted(folder.glob("log_map_archive_*.json"))
    if len(files) != 1:
        text = "no such file" if not files else f"{len(files)} such files; there must be one"
        in_map = folder.name == "map"
        place = "map/log_map_archive_*.json" if in_map else "log_map_archive_*.json"
        where = folder.parent if in_map else folder
        raise InvalidDocument(what, [(place, f"{text} in {where}")])
    return files[0]


def city_of(map_file: Path) -> str:
    """What the frame of a map is called."""
    city = re.search(r"____([A-Z]+)_city", map_file.name)
    return f"Argoverse 2 city frame {city[1]}" if city else "Argoverse 2 city frame"


# Private


def _check_folder(path: Path) -> None:
    if not path.is_dir():
        raise InvalidDocument(WHAT, [(str(path), "is not a folder")])
