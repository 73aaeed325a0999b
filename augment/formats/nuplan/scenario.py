"""The reader of nuPlan logs.

A path is a log's .db; its map lies under a folder `maps` beside it or above it, as the data set
is laid out: maps/<location>/<version>/map.gpkg. `item` is the token of a lidar_pc, or
`tag:<scenario type>` for the first frame that has the tag, `tag:<scenario type>:<number>` for
another of them, counted from 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan_log import (
    WHAT,
    LogPlace,
    Mission,
    Tables,
    check_tables,
    has_token,
    lights_at,
    mission_at,
    open_tables,
    place_of,
    read_log,
    tokens_of,
)
from augment.formats.nuplan_map import city_around
from augment.formats.reading import Moment, Reading, frames_every, reading_at
from augment.geometry.frames import Pose
from augment.scene.recording import Note, SceneNoteKind

LICENCE = "nuPlan, CC BY-NC-SA 4.0"
TAG = "tag:"
_TOKEN = re.compile(r"[0-9a-f]{16}")


class NuPlan:
    """The reader of nuPlan's log databases."""

    name = "nuplan"
    title = "nuPlan log (.db file, with maps/ beside or above it)"

    def recognises(self, path: Path) -> bool:
        """A SQLite file by its name and first bytes."""
        if path.suffix.lower() != ".db" or not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(16) == b"SQLite format 3\0"

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Frames that far apart."""
        with open_tables(path) as tables:
            check_tables(tables)
            tokens = tokens_of(tables, None)
        if not tokens:
            raise InvalidDocument(WHAT, [("lidar_pc", "has no row")])
        times_s = [(time - tokens[0][1]) * 1e-6 for _, time in tokens]
        for index in frames_every(times_s, every_s):
            yield Moment(item=tokens[index][0], time_s=times_s[index])

    def read(self, path: Path, *, item: str | None, frame: int | None, name: str) -> Reading:
        """The scene at one lidar_pc, and half a minute from there on."""
        if frame:
            raise InvalidDocument(
                WHAT, [("frame", "a token names the frame itself; leave it out")]
            )
        with open_tables(path) as tables:
            check_tables(tables)
            place = place_of(tables)
            token = _token(tables, item)
            log = read_log(tables, token)
            lights, mission = lights_at(tables, token), mission_at(tables, token)
        origin = log.ego_pose(0)
        city = city_around(
            map_of(path, place),
            location=place.location,
            center_m=(origin.x_m, origin.y_m),
            lights=lights,
            route=mission.roadblocks,
        )
        return reading_at(
            log,
            0,
            city,
            name=name,
            world=f"UTM of {place.location}",
            provenance=(
                f"nuPlan data set, log {place.logfile or path.stem}, lidar_pc {token}; {LICENCE}"
            ),
            licence=LICENCE,
            notes=_mission_notes(mission, origin),
            item=token,
        )


def tokens_in(path: Path, tokens: Sequence[str]) -> tuple[str, ...]:
    """Those of some tokens that a log has a lidar_pc of.

    Raises:
        InvalidDocument: The file is no log.
    """
    with open_tables(path) as tables:
        tables.need("lidar_pc", ("token",))
        return tuple(token for token in tokens if has_token(tables, token))


def map_of(path: Path, place: LogPlace) -> Path:
    """The map of a log's city.

    Raises:
        InvalidDocument: It is nowhere, or there are several.
    """
    for name in (place.location, place.version):
        if not re.fullmatch(r"[\w.-]{0,60}", name):
            raise InvalidDocument(WHAT, [("log", f"{name[:40]!r} is no name of a map")])
    cities = dict.fromkeys(one for one in (place.location, place.version) if one.strip("."))
    for folder in path.resolve().parents:
        maps = [
            file for city in cities for file in sorted((folder / "maps" / city).glob("*/map.gpkg"))
        ]
        if len(maps) > 1:
            raise InvalidDocument(WHAT, [(str(folder / "maps"), "has several maps of this city")])
        if maps:
            return maps[0]
    text = f"has no map of {place.location} beside or above it: maps/{place.location}/*/map.gpkg"
    raise InvalidDocument(WHAT, [(str(path), text)])


# Private


def _mission_notes(mission: Mission, origin: Pose) -> Iterator[Note]:
    if mission.goal_m is not None:
        ((x_m, y_m),) = origin.to_local(np.array([mission.goal_m])).tolist()
        yield Note(kind=SceneNoteKind.MISSION_GOAL, names=(f"{x_m:.1f}", f"{y_m:.1f}"))
    if mission.tags:
        yield Note(kind=SceneNoteKind.SCENARIO_TAGS, names=mission.tags)


def _token(tables: Tables, item: str | None) -> str:
    if item is None or item.startswith(TAG):
        tag, number = (None, 0) if item is None else _tag(item)
        found = tokens_of(tables, tag)
        if not found:
            text = "the log has no frame" if tag is None else f"no frame has the tag {tag!r}"
            raise InvalidDocument(WHAT, [("item", text)])
        if number >= len(found):
            text = f"{len(found)} frames have the tag {tag!r}, from 0 on; not {number}"
            raise InvalidDocument(WHAT, [("item", text)])
        return found[number][0]
    if not _TOKEN.fullmatch(item.lower()):
        raise InvalidDocument(
            WHAT, [("item", f"{item[:40]!r} is neither a token of 16 hex digits nor tag:TYPE")]
        )
    return item.lower()


def _tag(item: str) -> tuple[str, int]:
    """The type after "tag:", and which of its frames: "tag:TYPE" or "tag:TYPE:3"."""
    name, _, number = item.removeprefix(TAG).rpartition(":")
    if name and number.isdecimal() and len(number) < 10:
        return name, int(number)
    return item.removeprefix(TAG), 0
