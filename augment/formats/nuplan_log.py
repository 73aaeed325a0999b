"""The reader of nuPlan logs: a database of ego, boxes and lights, with the map of its city.

A path is a log's .db; its map lies under a folder `maps` beside it or above it, as the data set
is laid out: maps/<location>/<version>/map.gpkg. `item` is the token of a lidar_pc. Tokens are
BLOBs; here they are their hexadecimal text.
`ego_pose` gives the rear axle, boxes their centre; velocities of the ego are in its own frame.
Rows of 20 Hz are taken at 10 Hz.
"""

import re
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from augment.formats.nuplan_map import city_around, open_tables
from augment.formats.reading import Log, LoggedTrack, LogReader, Moment, frames_every, tracks_of
from augment.formats.values import FloatArray, fault_at, look_up, read_finite
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType, TrafficLight

if TYPE_CHECKING:
    import pandas as pd

LICENCE = "nuPlan, CC BY-NC-SA 4.0"
REAR_AXLE_TO_CENTER_M = 1.461
STEP_US = 100_000
LASTS_US = 30_000_000
"""As long as interPlan's longest scenario."""
LATEST_US = 2**62
MOST_FRAMES = 20_000
TYPE_OF = {
    "vehicle": AgentType.VEHICLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "bicycle": AgentType.BICYCLE,
    "traffic_cone": AgentType.TRAFFIC_CONE,
    "barrier": AgentType.BARRIER,
    "czone_sign": AgentType.CONSTRUCTION_SIGN,
    "generic_object": AgentType.GENERIC_OBJECT,
}
_FRAME = "SELECT timestamp FROM lidar_pc WHERE token = ?"
LIGHT_OF = {"green": TrafficLight.GREEN, "yellow": TrafficLight.YELLOW, "red": TrafficLight.RED}


class NuPlan(LogReader):
    """The reader of nuPlan's log databases."""

    name = "nuplan"
    title = "nuPlan log (.db file, with maps/ beside or above it)"
    suffix, marker = ".db", b"SQLite format 3\0"

    def moments(self, path: Path, *, every_s: float) -> Iterator[Moment]:
        """Frames that far apart."""
        with open_tables(path) as base:
            tokens = _tokens(base)
        times_s = [(time - tokens[0][1]) * 1e-6 for _, time in tokens]
        for index in frames_every(times_s, every_s):
            yield Moment(item=tokens[index][0], time_s=times_s[index])

    def logs(self, path: Path, item: str | None) -> Iterator[Log]:
        """Half a minute from one lidar_pc on."""
        with open_tables(path) as base:
            place = base.execute("SELECT location, map_version, logfile FROM log").fetchone()
            if place is None:
                raise fault_at("log", "has no row")
            location, version, logfile = (str(one or "")[:200] for one in place)
            token = _token(base, item)
            times_s, ego, tracks = _motion(base, token)
            lights, notes = _lights(base, token), _tag_notes(base, token)
        yield Log(
            times_s=times_s,
            ego=ego,
            ego_size_m=(EGO_LENGTH_M, EGO_WIDTH_M),
            tracks=[*tracks.values()],
            map_at=lambda _: city_around(
                _map_of(path, location, version),
                location=location,
                center_m=ego[0, :2],
                lights=lights,
            ),
            world=f"UTM of {location}",
            title=f"nuPlan data set, log {logfile or path.stem}, lidar_pc {token}",
            licence=LICENCE,
            item=token,
            notes=notes,
        )


def vehicles_at(path: Path, tokens: Sequence[str]) -> dict[str, list[tuple[float, float]]]:
    """Return length and width of all vehicles, as listed, by those tokens that are in a log.

    Raises:
        InvalidDocument: The file is no log, or a size is no number.
    """
    text = (
        "SELECT length, width FROM lidar_box WHERE lidar_pc_token = ? AND track_token IN "
        "(SELECT t.token FROM track t JOIN category c ON c.token = t.category_token "
        "WHERE c.name = 'vehicle') ORDER BY rowid"
    )
    with open_tables(path) as base:
        known = [one for one in tokens if base.execute(_FRAME, (bytes.fromhex(one),)).fetchone()]
        return {
            one: [
                (round(length_m, 3), round(width_m, 3))
                for length_m, width_m in _finite(
                    base.execute(text, (bytes.fromhex(one),)).fetchall(), "lidar_box"
                )
            ]
            for one in known
        }


# Private


def _map_of(path: Path, *names: str) -> Path:
    """The map of a log's city, which lies in a folder of its location or of its version."""
    for name in names:
        if not re.fullmatch(r"[\w.-]{0,60}", name):
            raise fault_at("log", f"{name[:40]!r} is no name of a map")
    cities = [name for name in names if name.strip(".")]
    for folder in path.resolve().parents:
        found = {file for city in cities for file in (folder / "maps" / city).glob("*/map.gpkg")}
        if len(found) > 1:
            raise fault_at(str(folder / "maps"), "has several maps of this city")
        if found:
            return found.pop()
    text = f"has no map of {names[0]} beside or above it: maps/{names[0]}/*/map.gpkg"
    raise fault_at(str(path), text)


def _token(base: sqlite3.Connection, item: str | None) -> str:
    if item is None:
        return _tokens(base)[0][0]
    if not re.fullmatch(r"[0-9a-f]{16}", item.lower()):
        raise fault_at("item", f"{item[:40]!r} is no token of 16 hex digits")
    return item.lower()


def _tokens(base: sqlite3.Connection) -> list[tuple[str, int]]:
    """Tokens and times (µs) of all frames, in their order."""
    rows = base.execute(
        "SELECT DISTINCT hex(token), timestamp FROM lidar_pc ORDER BY timestamp"
    ).fetchall()
    if not rows:
        raise fault_at("item", "the log has no frame")
    return [(str(token).lower(), _whole(time, "lidar_pc.timestamp")) for token, time in rows]


def _whole(value: object, place: str) -> int:
    if isinstance(value, str) and value.isdecimal() and len(value) <= 18:
        return int(value)
    if not isinstance(value, int):
        raise fault_at(place, f"{str(value)[:40]!r} is no whole number")
    return value


def _motion(
    base: sqlite3.Connection, token: str
) -> tuple[FloatArray, FloatArray, dict[str, LoggedTrack]]:
    """Times, the ego's states and all tracks from a lidar_pc on, which is the first step."""
    start = base.execute(_FRAME, (bytes.fromhex(token),)).fetchone()
    if start is None:
        raise fault_at("item", f"there is no lidar_pc {token}")
    first = _whole(start[0], "lidar_pc.timestamp")
    rows = base.execute(
        "SELECT l.token, l.timestamp, e.x, e.y, e.qw, e.qx, e.qy, e.qz, e.vx, e.vy "
        "FROM lidar_pc l JOIN ego_pose e ON e.token = l.ego_pose_token "
        "WHERE l.timestamp BETWEEN ? AND ? ORDER BY l.timestamp LIMIT ?",
        (first, min(first, LATEST_US) + LASTS_US, MOST_FRAMES),
    ).fetchall()
    if not rows or rows[0][1] != first:
        raise fault_at("ego_pose", f"has no pose for lidar_pc {token}")
    chosen = rows[:1]
    for row in rows[1:]:
        if row[1] - chosen[-1][1] >= STEP_US * 0.9:
            chosen.append(row)
    x_m, y_m, qw, qx, qy, qz, vx, vy = _finite([row[2:] for row in chosen], "ego_pose").T
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    x_m = x_m + REAR_AXLE_TO_CENTER_M * np.cos(yaw)
    y_m = y_m + REAR_AXLE_TO_CENTER_M * np.sin(yaw)
    times_s = np.array([(row[1] - first) * 1e-6 for row in chosen])
    boxes = _boxes(base, [row[0] for row in chosen])
    ego = np.column_stack([x_m, y_m, yaw, np.hypot(vx, vy)])
    return times_s, ego, tracks_of(boxes, TYPE_OF, times_s)


def _finite(rows: Sequence[Sequence[Any]], place: str) -> FloatArray:
    """Finite numbers (R, C); NULL counts as 0."""
    return read_finite([[value or 0.0 for value in row] for row in rows], place)


def _boxes(base: sqlite3.Connection, frames: Sequence[bytes]) -> "pd.DataFrame":
    """All boxes of the frames, without a join: a log has millions, and no index need be."""
    import pandas as pd

    text = "SELECT t.token, c.name FROM track t JOIN category c ON c.token = t.category_token"
    kinds = dict(base.execute(text).fetchall())
    rows = base.execute(
        "SELECT lidar_pc_token, track_token, x, y, yaw, vx, vy, length, width FROM lidar_box "
        f"WHERE lidar_pc_token IN ({', '.join('?' * len(frames))})",
        list(frames),
    ).fetchall()
    rows = [row for row in rows if kinds.get(row[1]) not in (None, "ego")]
    for kind in {kinds[row[1]] for row in rows}:
        look_up(TYPE_OF, kind, "category.name")
    step_of = {frame: step for step, frame in enumerate(frames)}
    values = _finite([row[2:] for row in rows], "lidar_box").reshape(-1, 7)
    return pd.DataFrame(
        values, columns=["x_m", "y_m", "heading_rad", "vx", "vy", "length_m", "width_m"]
    ).assign(
        step=[step_of[row[0]] for row in rows],
        track=[row[1].hex() if isinstance(row[1], bytes) else str(row[1]) for row in rows],
        kind=[kinds[row[1]] for row in rows],
        speed_mps=np.hypot(values[:, 3], values[:, 4]),
    )


def _lights(base: sqlite3.Connection, token: str) -> dict[int, TrafficLight]:
    """The state by lane connector."""
    text = "SELECT lane_connector_id, status FROM traffic_light_status WHERE lidar_pc_token = ?"
    place = "traffic_light_status.lane_connector_id"
    return {
        _whole(connector, place): LIGHT_OF.get(str(state), TrafficLight.UNKNOWN)
        for connector, state in base.execute(text, (bytes.fromhex(token),))
    }


def _tag_notes(base: sqlite3.Connection, token: str) -> list[str]:
    text = (
        "SELECT DISTINCT type FROM scenario_tag WHERE lidar_pc_token = ? ORDER BY type LIMIT 100"
    )
    tags = [str(tag)[:80] for (tag,) in base.execute(text, (bytes.fromhex(token),))]
    return [f"Scenario tags of this moment: {', '.join(tags)}."] if tags else []
