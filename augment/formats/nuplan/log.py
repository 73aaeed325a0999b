"""A log database around one lidar_pc: ego, boxes, lights.

Tokens are BLOBs; here they are their hexadecimal text. `ego_pose` gives the rear axle, boxes their
centre; velocities of the ego are in its own frame. Rows of 20 Hz are taken at 10 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from augment.errors import InvalidDocument
from augment.formats.nuplan.sqlite import WHAT, Tables
from augment.formats.recorded_log import Log, LoggedTrack
from augment.scene.entities import AgentType, TrafficLight
from augment.scene.sizes import EGO_LENGTH_M, EGO_WIDTH_M

REAR_AXLE_TO_CENTER_M = 1.461
STEP_US = 100_000
LASTS_US = 30_000_000
"""As long as interPlan's longest scenario."""

TYPE_OF = {
    "vehicle": AgentType.VEHICLE,
    "pedestrian": AgentType.PEDESTRIAN,
    "bicycle": AgentType.BICYCLE,
    "traffic_cone": AgentType.TRAFFIC_CONE,
    "barrier": AgentType.BARRIER,
    "czone_sign": AgentType.CONSTRUCTION_SIGN,
    "generic_object": AgentType.GENERIC_OBJECT,
}
LIGHT_OF = {
    "green": TrafficLight.GREEN,
    "yellow": TrafficLight.YELLOW,
    "red": TrafficLight.RED,
}
_COLUMNS = {
    "log": ("token", "location", "map_version", "logfile"),
    "lidar_pc": ("token", "ego_pose_token", "scene_token", "timestamp"),
    "ego_pose": ("token", "x", "y", "qw", "qx", "qy", "qz", "vx", "vy"),
    "lidar_box": ("lidar_pc_token", "track_token", "x", "y", "width", "length", "vx", "vy", "yaw"),
    "track": ("token", "category_token"),
    "category": ("token", "name"),
    "scenario_tag": ("lidar_pc_token", "type"),
    "traffic_light_status": ("lidar_pc_token", "lane_connector_id", "status"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LogPlace:
    """Where a log was recorded."""

    location: str
    version: str
    logfile: str


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
    location, version, logfile = (str(one or "") for one in rows[0])
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
    return [(str(token).lower(), int(time)) for token, time in rows]


def read_log(tables: Tables, token: str) -> Log:
    """What was recorded from a lidar_pc on, the first step being that lidar_pc.

    Raises:
        InvalidDocument: There is no such token, or a row breaks the format.
    """
    frames = _frames(tables, token)
    chosen = _every_tenth_of_a_second(frames)
    index = {row[0]: step for step, row in enumerate(chosen)}
    times_s = np.array([(row[1] - chosen[0][1]) * 1e-6 for row in chosen])
    ego = np.array([_ego_state(row) for row in chosen])
    return Log(
        what=WHAT,
        times_s=times_s,
        ego=ego,
        ego_length_m=EGO_LENGTH_M,
        ego_width_m=EGO_WIDTH_M,
        tracks=_tracks(tables, chosen[0][1], chosen[-1][1], index),
    )


def lights_at(tables: Tables, token: str) -> dict[int, TrafficLight]:
    """The state by lane connector."""
    rows = tables.rows(
        "SELECT lane_connector_id, status FROM traffic_light_status WHERE lidar_pc_token = ?",
        (bytes.fromhex(token),),
    )
    return {int(one): LIGHT_OF.get(str(state), TrafficLight.UNKNOWN) for one, state in rows}


# Private


def _frames(tables: Tables, token: str) -> list[tuple[Any, ...]]:
    start = tables.rows("SELECT timestamp FROM lidar_pc WHERE token = ?", (bytes.fromhex(token),))
    if not start:
        raise InvalidDocument(WHAT, [("item", f"there is no lidar_pc {token}")])
    first = int(start[0][0])
    rows = tables.rows(
        "SELECT l.token, l.timestamp, e.x, e.y, e.qw, e.qx, e.qy, e.qz, e.vx, e.vy "
        "FROM lidar_pc l JOIN ego_pose e ON e.token = l.ego_pose_token "
        "WHERE l.timestamp BETWEEN ? AND ? ORDER BY l.timestamp",
        (first, first + LASTS_US),
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
    try:
        x, y, qw, qx, qy, qz, vx, vy = (float(value) for value in row[2:])
    except (TypeError, ValueError):
        raise InvalidDocument(WHAT, [("ego_pose", "has a value that is no number")]) from None
    yaw = np.arctan2(2.0 * (qw * qz + qx * qy), 1.0 - 2.0 * (qy * qy + qz * qz))
    ahead = REAR_AXLE_TO_CENTER_M
    return x + ahead * np.cos(yaw), y + ahead * np.sin(yaw), float(yaw), float(np.hypot(vx, vy))


def _tracks(
    tables: Tables, first: int, last: int, index: dict[bytes, int]
) -> tuple[LoggedTrack, ...]:
    rows = tables.rows(
        "SELECT b.lidar_pc_token, hex(b.track_token), c.name, b.x, b.y, b.yaw, b.vx, b.vy, "
        "b.length, b.width FROM lidar_pc l JOIN lidar_box b ON b.lidar_pc_token = l.token "
        "JOIN track t ON t.token = b.track_token JOIN category c ON c.token = t.category_token "
        "WHERE l.timestamp BETWEEN ? AND ? ORDER BY l.timestamp",
        (first, last),
    )
    states: dict[str, Any] = {}
    shapes: dict[str, tuple[AgentType, float, float]] = {}
    for token, track, name, *numbers in rows:
        step = index.get(token)
        if step is None or name == "ego":
            continue
        if name not in TYPE_OF:
            text = f"unknown {str(name)[:40]!r}; known: {', '.join(TYPE_OF)}"
            raise InvalidDocument(WHAT, [("category.name", text)])
        try:
            x, y, yaw, vx, vy, length, width = (
                float(0.0 if one is None else one) for one in numbers
            )
        except (TypeError, ValueError):
            raise InvalidDocument(WHAT, [("lidar_box", "has a value that is no number")]) from None
        if track not in states:
            states[track] = np.full((len(index), 4), np.nan)
            shapes[track] = (TYPE_OF[name], length, width)
        states[track][step] = (x, y, yaw, np.hypot(vx, vy))
    return tuple(
        LoggedTrack(
            name=track.lower(),
            type=shapes[track][0],
            length_m=shapes[track][1],
            width_m=shapes[track][2],
            states=rows,
        )
        for track, rows in states.items()
    )
