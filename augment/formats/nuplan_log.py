"""Rows out of a SQLite file that somebody else made, opened for reading alone."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan_map import WHAT, Tables, city_around, open_tables
from augment.formats.reading import Log, LoggedTrack, Moment, Reading, frames_every, reading_at
from augment.geometry.frames import Pose
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType, TrafficLight
from augment.scene.recording import Note, SceneNoteKind

REAR_AXLE_TO_CENTER_M = 1.461
STEP_US = 100_000
LASTS_US = 30_000_000
"""As long as interPlan's longest scenario."""
LATEST_US = 2**62
MOST_FRAMES = 20_000
MOST_ROADBLOCKS = 1_000

TYPE_OF = {
    "vehicle": AgentType.VEHICLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "bicycle": AgentType.BICYCLE,
    "traffic_cone": AgentType.TRAFFIC_CONE,
    "barrier": AgentType.BARRIER,
    "czone_sign": AgentType.CONSTRUCTION_SIGN,
    "generic_object": AgentType.GENERIC_OBJECT,
}
LIGHT_OF = {"green": TrafficLight.GREEN, "yellow": TrafficLight.YELLOW, "red": TrafficLight.RED}
_COLUMNS = {
    "log": ("token", "location", "map_version", "logfile"),
    "lidar_pc": ("token", "ego_pose_token", "scene_token", "timestamp"),
    "ego_pose": ("token", "x", "y", "qw", "qx", "qy", "qz", "vx", "vy"),
    "lidar_box": ("lidar_pc_token", "track_token", "x", "y", "width", "length", "vx", "vy", "yaw"),
    "track": ("token", "category_token"),
    "category": ("token", "name"),
    "scenario_tag": ("lidar_pc_token", "type"),
    "traffic_light_status": ("lidar_pc_token", "lane_connector_id", "status"),
    "scene": ("token", "goal_ego_pose_token", "roadblock_ids"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LogPlace:
    """Where a log was recorded."""

    location: str
    version: str
    logfile: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Mission:
    """Where the ego was sent, and what a moment is tagged as.

    Attributes:
        roadblocks: Ids of lane groups and group connectors, in their order.
        goal_m: East and north; None where there is none.
        tags: Scenario types, in alphabetical order.
    """

    roadblocks: tuple[str, ...]
    goal_m: tuple[float, float] | None
    tags: tuple[str, ...]


def check_tables(tables: Tables) -> None:
    """Whether the database has what is needed.

    Raises:
        InvalidDocument: A table or a column is missing.
    """
    for table, columns in _COLUMNS.items():
        tables.need(table, columns)


def place_of(tables: Tables) -> LogPlace:
    """City and map of the log.

    Raises:
        InvalidDocument: The log is empty.
    """
    rows = tables.rows("SELECT location, map_version, logfile FROM log LIMIT 1")
    if not rows:
        raise InvalidDocument(WHAT, [("log", "has no row")])
    location, version, logfile = (str(row or "")[:200] for row in rows[0])
    return LogPlace(location=location, version=version, logfile=logfile)


def tokens_of(tables: Tables, tag: str | None) -> list[tuple[str, int]]:
    """Tokens and times (µs) of all frames, or of those with a scenario tag, in their order."""
    if tag is None:
        query, values = "SELECT hex(token), timestamp FROM lidar_pc ORDER BY timestamp", ()
        rows = tables.rows(query, values)
    else:
        rows = tables.rows(
            "SELECT DISTINCT hex(l.token), l.timestamp FROM lidar_pc l JOIN scenario_tag s "
            "ON s.lidar_pc_token = l.token WHERE s.type = ? ORDER BY l.timestamp",
            (tag,),
        )
    return [(str(token).lower(), _whole(time, "lidar_pc.timestamp")) for token, time in rows]


def has_token(tables: Tables, token: str) -> bool:
    """Whether the log has a lidar_pc of that token."""
    text = "SELECT 1 FROM lidar_pc WHERE token = ? LIMIT 1"
    return bool(tables.rows(text, (bytes.fromhex(token),)))


def read_log(tables: Tables, token: str) -> Log:
    """What was recorded from a lidar_pc on, the first step being that lidar_pc.

    Raises:
        InvalidDocument: There is no such token, or a row breaks the format.
    """
    chosen = _every_tenth_of_a_second(_frames(tables, token))
    index = {row[0]: step for step, row in enumerate(chosen)}
    times_s = np.array([(row[1] - chosen[0][1]) * 1e-6 for row in chosen])
    ego = np.array([_ego_state(row) for row in chosen])
    return Log(
        what=WHAT,
        times_s=times_s,
        ego=ego,
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=_tracks(tables, index),
    )


def lights_at(tables: Tables, token: str) -> dict[int, TrafficLight]:
    """The state by lane connector."""
    rows = tables.rows(
        "SELECT lane_connector_id, status FROM traffic_light_status WHERE lidar_pc_token = ?",
        (bytes.fromhex(token),),
    )
    place = "traffic_light_status.lane_connector_id"
    return {
        _whole(one, place): LIGHT_OF.get(str(state), TrafficLight.UNKNOWN) for one, state in rows
    }


def mission_at(tables: Tables, token: str) -> Mission:
    """Route and goal of the scene that a lidar_pc belongs to, and its own tags."""
    frame = (bytes.fromhex(token),)
    scenes = tables.rows(
        "SELECT s.roadblock_ids, e.x, e.y FROM lidar_pc l JOIN scene s ON s.token = l.scene_token "
        "LEFT JOIN ego_pose e ON e.token = s.goal_ego_pose_token WHERE l.token = ? LIMIT 1",
        frame,
    )
    tags = tables.rows(
        "SELECT DISTINCT type FROM scenario_tag WHERE lidar_pc_token = ? ORDER BY type LIMIT 100",
        frame,
    )
    # Documented with commas, written with spaces.
    roadblocks = re.split(r"[\s,]+", str(scenes[0][0] or "")) if scenes else []
    goal = _numbers(scenes[0][1:], "ego_pose") if scenes and scenes[0][1] is not None else None
    return Mission(
        roadblocks=tuple(
            roadblock[:20] for roadblock in roadblocks[:MOST_ROADBLOCKS] if roadblock
        ),
        goal_m=None if goal is None else (goal[0], goal[1]),
        tags=tuple(str(one)[:80] for (one,) in tags),
    )


# Private


def _whole(value: object, place: str) -> int:
    if isinstance(value, str) and value.isdecimal() and len(value) <= 18:
        return int(value)
    if not isinstance(value, int):
        raise InvalidDocument(WHAT, [(place, f"{str(value)[:40]!r} is no whole number")])
    return value


def _numbers(values: Sequence[Any], place: str) -> list[float]:
    """Finite numbers; NULL counts as 0."""
    try:
        numbers = [0.0 if value is None else float(value) for value in values]
    except (TypeError, ValueError, OverflowError):
        raise InvalidDocument(WHAT, [(place, "has a value that is no number")]) from None
    if not all(map(math.isfinite, numbers)):
        raise InvalidDocument(WHAT, [(place, "has a value that is not finite")])
    return numbers


def _frames(tables: Tables, token: str) -> list[tuple[Any, ...]]:
    start = tables.rows("SELECT timestamp FROM lidar_pc WHERE token = ?", (bytes.fromhex(token),))
    if not start:
        raise InvalidDocument(WHAT, [("item", f"there is no lidar_pc {token}")])
    first = _whole(start[0][0], "lidar_pc.timestamp")
    rows = tables.rows(
        "SELECT l.token, l.timestamp, e.x, e.y, e.qw, e.qx, e.qy, e.qz, e.vx, e.vy "
        "FROM lidar_pc l JOIN ego_pose e ON e.token = l.ego_pose_token "
        "WHERE l.timestamp BETWEEN ? AND ? ORDER BY l.timestamp LIMIT ?",
        (first, min(first, LATEST_US) + LASTS_US, MOST_FRAMES),
    )
    if not rows or rows[0][1] != first:
        raise InvalidDocument(WHAT, [("ego_pose", f"has no pose for lidar_pc {token}")])
    return rows


def _every_tenth_of_a_second(frames: list[tuple[Any, ...]]) -> list[tuple[Any, ...]]:
    chosen = [frames[0]]
    for row in frames[1:]:
        if row[1] - chosen[-1][1] >= STEP_US * 0.9:
            chosen.append(row)
    return chosen


def _ego_state(row: tuple[Any, ...]) -> tuple[float, float, float, float]:
    x, y, qw, qx, qy, qz, vx, vy = _numbers(row[2:], "ego_pose")
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    ahead = REAR_AXLE_TO_CENTER_M
    return x + ahead * np.cos(yaw), y + ahead * np.sin(yaw), float(yaw), float(np.hypot(vx, vy))


def _tracks(tables: Tables, index: dict[bytes, int]) -> tuple[LoggedTrack, ...]:
    """All boxes of the chosen frames, one by one: a log has millions, and no index need be."""
    names = dict(
        tables.each(
            "SELECT t.token, c.name FROM track t JOIN category c ON c.token = t.category_token"
        )
    )
    states: dict[bytes, Any] = {}
    shapes: dict[bytes, tuple[AgentType, float, float]] = {}
    marks = ", ".join("?" * len(index))
    for token, track, *numbers in tables.each(
        "SELECT lidar_pc_token, track_token, x, y, yaw, vx, vy, length, width FROM lidar_box "
        f"WHERE lidar_pc_token IN ({marks})",
        list(index),
    ):
        kind = names.get(track)
        if kind is None or kind == "ego":
            continue  # as a join leaves it out
        x, y, yaw, vx, vy, length, width = _numbers(numbers, "lidar_box")
        if track not in states:
            states[track] = np.full((len(index), 4), np.nan)
            shapes[track] = (_type_of(kind), length, width)
        states[track][index[token]] = (x, y, yaw, math.hypot(vx, vy))
    return tuple(
        LoggedTrack(
            name=bytes(track).hex() if isinstance(track, bytes) else str(track),
            type=shapes[track][0],
            length_m=shapes[track][1],
            width_m=shapes[track][2],
            states=rows,
        )
        for track, rows in states.items()
    )


def _type_of(name: object) -> AgentType:
    if name not in TYPE_OF:
        text = f"unknown {str(name)[:40]!r}; known: {', '.join(TYPE_OF)}"
        raise InvalidDocument(WHAT, [("category.name", text)])
    return TYPE_OF[str(name)]


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
