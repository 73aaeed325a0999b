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

from augment import foreign
from augment.foreign import Doubts, FloatArray, fault_at
from augment.formats import reading
from augment.formats.nuplan_map import city_around, open_tables
from augment.scene.entities import EGO_LENGTH_M, EGO_WIDTH_M, AgentType, TrafficLight
from augment.scene.recording import Track

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
LIGHT_OF = {name: TrafficLight(name) for name in ("green", "yellow", "red", "unknown")}


class NuPlan(reading.LogReader):
    """The reader of nuPlan's log databases."""

    name = "nuplan"
    title = "nuPlan log (.db file, with maps/ beside or above it)"
    suffix, marker = ".db", b"SQLite format 3\0"

    def moments(self, path: Path, *, every_s: float) -> Iterator[reading.Moment]:
        """Frames that far apart."""
        with open_tables(path) as base:
            tokens = _tokens(base)
        times_s = [(time - tokens[0][1]) * 1e-6 for _, time in tokens]
        for index in reading.frames_every(times_s, every_s):
            yield reading.Moment(item=tokens[index][0], time_s=times_s[index])

    def logs(self, path: Path, item: str | None) -> Iterator[reading.Log]:
        """Half a minute from one lidar_pc on."""
        with open_tables(path) as base:
            place = base.execute("SELECT location, map_version, logfile FROM log").fetchone()
            if place is None:
                raise fault_at("log", "has no row")
            location, version, logfile = (str(cell or "")[:200] for cell in place)
            token = _token(base, item)
            doubts = Doubts()
            times_s, ego, tracks = _motion(base, token, doubts)
            lights, notes = _lights(base, token, doubts), _tag_notes(base, token)
        yield reading.Log(
            times_s=times_s,
            ego=ego,
            ego_size_m=(EGO_LENGTH_M, EGO_WIDTH_M),
            tracks=[*tracks.values()],
            map_at=lambda _: city_around(
                _find_map(path, location, version),
                location=location,
                center_m=ego[0, :2],
                lights=lights,
            ),
            world=f"UTM of {location}",
            title=f"nuPlan data set, log {logfile or path.stem}, lidar_pc {token}",
            licence=LICENCE,
            item=token,
            notes=[*notes, *doubts.notes],
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
        sizes_m = {}
        for token in tokens:
            if base.execute(_FRAME, (bytes.fromhex(token),)).fetchone():
                rows = base.execute(text, (bytes.fromhex(token),)).fetchall()
                table = foreign.read_finite(rows, "lidar_box", 2).round(3)
                sizes_m[token] = [(length_m, width_m) for length_m, width_m in table.tolist()]
        return sizes_m


# Private


def _find_map(path: Path, *names: str) -> Path:
    """The map of a log's city, which lies in a folder of its location or of its version."""
    for name in names:
        if not re.fullmatch(r"[\w.-]{0,60}", name):
            raise fault_at("log", f"{name[:40]!r} is no name of a map")
    cities = [name for name in names if name.strip(".")]
    for folder in path.resolve().parents:
        maps = {file for city in cities for file in (folder / "maps" / city).glob("*/map.gpkg")}
        if len(maps) > 1:
            raise fault_at(str(folder / "maps"), "has several maps of this city")
        if maps:
            return maps.pop()
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
    place = "lidar_pc.timestamp"
    return [(str(token).lower(), foreign.read_whole(time, place)) for token, time in rows]


def _motion(
    base: sqlite3.Connection, token: str, doubts: Doubts
) -> tuple[FloatArray, FloatArray, dict[str, Track]]:
    """Times, the ego's states and all tracks from a lidar_pc on, which is the first step."""
    start = base.execute(_FRAME, (bytes.fromhex(token),)).fetchone()
    if start is None:
        raise fault_at("item", f"there is no lidar_pc {token}")
    first = foreign.read_whole(start[0], "lidar_pc.timestamp")
    query = (
        "SELECT l.token, l.timestamp, e.x, e.y, e.qw, e.qx, e.qy, e.qz, e.vx, e.vy "
        "FROM lidar_pc l JOIN ego_pose e ON e.token = l.ego_pose_token "
        "WHERE l.timestamp BETWEEN ? AND ? ORDER BY l.timestamp LIMIT ?"
    )
    rows = base.execute(query, (first, min(first, LATEST_US) + LASTS_US, MOST_FRAMES)).fetchall()
    poses = _numbers(rows, "token timestamp", "x y qw qx qy qz", "vx vy", doubts)
    stamps = poses["timestamp"].tolist()
    if not stamps or stamps[0] != first:
        raise fault_at("ego_pose", f"has no pose for lidar_pc {token}")
    chosen = [0]
    for index, stamp in enumerate(stamps):
        if stamp - stamps[chosen[-1]] >= STEP_US * 0.9:
            chosen.append(index)
    poses = poses.iloc[chosen]
    qw, qx, qy, qz, vx, vy = poses.iloc[:, 4:].to_numpy().T
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    way = np.column_stack([np.cos(yaw), np.sin(yaw)])
    center_m = poses[["x", "y"]].to_numpy() + REAR_AXLE_TO_CENTER_M * way
    times_s = np.array([(stamps[index] - first) * 1e-6 for index in chosen])
    speed_mps = np.hypot(vx, vy)
    speed_mps = np.where(np.isnan(speed_mps), reading.speeds(times_s, center_m), speed_mps)
    boxes = _boxes(base, poses["token"].tolist(), doubts)
    ego = np.column_stack([center_m, yaw, speed_mps])
    return times_s, ego, reading.read_tracks(boxes, TYPE_OF, times_s, doubts)


def _numbers(
    rows: Sequence[Sequence[Any]], names: str, needed: str, further: str, doubts: Doubts
) -> "pd.DataFrame":
    """The rows with numbers in the needed columns; what is none in the further ones is NaN."""
    import pandas as pd

    columns, numbers = [*names.split(), *needed.split(), *further.split()], f"{needed} {further}"
    table = pd.DataFrame([*rows], columns=columns)
    for name in numbers.split():
        values = pd.to_numeric(table[name], errors="coerce").astype(np.float64)
        table[name] = values.where(values.abs() <= foreign.FURTHEST)
    whole = table[needed.split()].notna().all(axis=1)
    doubts.assume("A row with a gap or an odd number was left out", (~whole).sum())
    complete: pd.DataFrame = table[whole].reset_index(drop=True)
    gaps = complete[further.split()].isna().any(axis=1).sum()
    doubts.assume("A velocity that is not given is that of the motion, a size the usual", gaps)
    return complete


def _boxes(base: sqlite3.Connection, frames: Sequence[bytes], doubts: Doubts) -> "pd.DataFrame":
    """All boxes of the frames, without a join: a log has millions, and no index need be."""
    text = "SELECT t.token, c.name FROM track t JOIN category c ON c.token = t.category_token"
    kinds = dict(base.execute(text).fetchall())
    rows = base.execute(
        "SELECT lidar_pc_token, track_token, x, y, yaw, vx, vy, length, width FROM lidar_box "
        f"WHERE lidar_pc_token IN ({', '.join('?' * len(frames))})",
        list(frames),
    ).fetchall()
    names = {str(kinds.get(row[1])) for row in rows} - {"ego"}
    doubts.doubt_unknown("objects", TYPE_OF, names, "category.name")
    rows = [row for row in rows if kinds.get(row[1]) in TYPE_OF]
    boxes = _numbers(rows, "frame token", "x_m y_m heading_rad", "vx vy length_m width_m", doubts)
    return boxes.assign(
        step=boxes["frame"].map({frame: step for step, frame in enumerate(frames)}),
        track=[
            token.hex() if isinstance(token, bytes) else str(token) for token in boxes["token"]
        ],
        kind=boxes["token"].map(kinds),
        speed_mps=np.hypot(boxes["vx"], boxes["vy"]),
    )


def _lights(base: sqlite3.Connection, token: str, doubts: Doubts) -> dict[int, TrafficLight]:
    """The state by lane connector."""
    text = "SELECT lane_connector_id, status FROM traffic_light_status WHERE lidar_pc_token = ?"
    lights = {}
    for value, status in base.execute(text, (bytes.fromhex(token),)):
        with doubts.about("lights"):
            connector = foreign.read_whole(value, "traffic_light_status.lane_connector_id")
            lights[connector] = TrafficLight.UNKNOWN
            lights[connector] = foreign.look_up(LIGHT_OF, status, "traffic_light_status.status")
    return lights


def _tag_notes(base: sqlite3.Connection, token: str) -> list[str]:
    text = (
        "SELECT DISTINCT type FROM scenario_tag WHERE lidar_pc_token = ? ORDER BY type LIMIT 100"
    )
    tags = [str(tag)[:80] for (tag,) in base.execute(text, (bytes.fromhex(token),))]
    return [f"Scenario tags of this moment: {', '.join(tags)}."] if tags else []
