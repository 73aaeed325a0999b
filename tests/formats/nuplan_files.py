"""A small nuPlan log and map in the published schema, whose right answers are known.

The ego's rear axle starts at EAST, NORTH of its city's zone and drives east at 10 m/s; a lane of
4 m lies under it, one to its left beside it, an intersection of one connector 40 m ahead.
Degrees come from metres by the inverse of a local projection, found by bisection.
"""

import math
import sqlite3
import struct
from pathlib import Path

import numpy as np

from augment.formats.nuplan_map import to_utm

CITIES = {
    "sg-one-north": (32648, 365_000.0, 143_000.0, "9.17.1964"),
    "us-nv-las-vegas-strip": (32611, 664_000.0, 3_998_000.0, "9.15.1915"),
    "us-ma-boston": (32619, 331_000.0, 4_690_000.0, "9.12.1817"),
    "us-pa-pittsburgh-hazelwood": (32617, 587_000.0, 4_475_000.0, "9.17.1937"),
}
REAR_AXLE_TO_CENTER_M = 1.461

_ONLY = "token BLOB NOT NULL"
_XYZ = "x FLOAT, y FLOAT, z FLOAT"
COLUMNS = {
    "log": f"{_ONLY}, vehicle_name VARCHAR(64), date VARCHAR(64), timestamp INTEGER, "
    "logfile VARCHAR(64), location VARCHAR(64), map_version VARCHAR(64)",
    "lidar_pc": f"{_ONLY}, ego_pose_token BLOB NOT NULL, "
    "lidar_token BLOB, scene_token BLOB, filename VARCHAR(128), timestamp INTEGER",
    "ego_pose": f"{_ONLY}, timestamp INTEGER, {_XYZ}, qw FLOAT, qx FLOAT, qy FLOAT, qz FLOAT, "
    "vx FLOAT, vy FLOAT, vz FLOAT, log_token BLOB",
    "lidar_box": f"{_ONLY}, lidar_pc_token BLOB NOT NULL, track_token BLOB NOT NULL, "
    f"{_XYZ}, width FLOAT, length FLOAT, height FLOAT, "
    "vx FLOAT, vy FLOAT, vz FLOAT, yaw FLOAT, confidence FLOAT",
    "track": f"{_ONLY}, category_token BLOB, width FLOAT, length FLOAT, height FLOAT",
    "category": f"{_ONLY}, name VARCHAR(64), description TEXT",
    "scene": f"{_ONLY}, log_token BLOB, name TEXT, goal_ego_pose_token BLOB, roadblock_ids TEXT",
    "scenario_tag": f"{_ONLY}, lidar_pc_token BLOB NOT NULL, type TEXT, agent_track_token BLOB",
    "traffic_light_status": f"{_ONLY}, lidar_pc_token BLOB NOT NULL, "
    "lane_connector_id INTEGER, status VARCHAR(8)",
}
"""Of the published tables those that are read, without neighbours in time and accelerations."""


def token(number: int) -> bytes:
    return struct.pack(">Q", number)


def degrees(zone: int, points: np.ndarray) -> np.ndarray:
    """Longitude and latitude of metres, by Newton's steps on the projection itself."""
    made = np.tile([6.0 * zone - 183.0, 20.0], (len(points), 1))
    for _ in range(12):
        here = to_utm(made, zone=zone, is_south=False)
        east = (to_utm(made + np.array([1e-6, 0.0]), zone=zone, is_south=False) - here) / 1e-6
        north = (to_utm(made + np.array([0.0, 1e-6]), zone=zone, is_south=False) - here) / 1e-6
        gap = points - here
        turn = east[:, 0] * north[:, 1] - north[:, 0] * east[:, 1]
        made[:, 0] += (gap[:, 0] * north[:, 1] - north[:, 0] * gap[:, 1]) / turn
        made[:, 1] += (east[:, 0] * gap[:, 1] - gap[:, 0] * east[:, 1]) / turn
    return made


def geometry(points: np.ndarray, *, polygon: bool = False) -> bytes:
    body = struct.pack("<I", len(points)) + points.astype("<f8").tobytes()
    if polygon:
        body = struct.pack("<I", 1) + body
    head = b"GP\0" + bytes([1]) + struct.pack("<i", 4326)
    return head + b"\1" + struct.pack("<I", 3 if polygon else 2) + body


def strip(x: float, to: float, y: float, half: float = 2.0) -> list[tuple[float, float]]:
    return [(x, y + half), (to, y + half), (to, y - half), (x, y - half), (x, y + half)]


def write_map(root: Path, city: str) -> Path:
    code, east, north, version = CITIES[city]
    file = root / "maps" / city / version / "map.gpkg"
    file.parent.mkdir(parents=True, exist_ok=True)
    base = sqlite3.connect(file)
    base.execute("PRAGMA synchronous = OFF")

    def shape(points: list[tuple[float, float]], *, polygon: bool = False) -> bytes:
        metres = np.array(points) + np.array([east, north])
        return geometry(degrees(code % 100, metres), polygon=polygon)

    def layer(name: str, columns: str, *rows: tuple[object, ...]) -> None:
        base.execute(f"CREATE TABLE {name} (fid INTEGER PRIMARY KEY, geom BLOB, {columns})")
        base.execute("INSERT INTO gpkg_geometry_columns VALUES (?, 'geom', 4326)", (name,))
        for row in rows:
            base.execute(f"INSERT INTO {name} VALUES ({', '.join('?' * len(row))})", row)

    base.execute("CREATE TABLE gpkg_geometry_columns (table_name, column_name, srs_id)")
    base.execute("CREATE TABLE meta (fid INTEGER PRIMARY KEY, key TEXT, value TEXT)")
    base.execute("INSERT INTO meta VALUES (1, 'projectedCoordSystem', ?)", (f"epsg:{code}",))
    layer(
        "lanes_polygons",
        "lane_group_fid, lane_index, left_boundary_fid, right_boundary_fid, speed_limit_mps, "
        "from_edge_fid, to_edge_fid, lane_type_fid, width",
        (1, shape(strip(-40, 40, 0), polygon=True), 90, 1, 2, 3, 13.4, None, None, 0, None),
        (2, shape(strip(-40, 40, 4), polygon=True), 90, 0, 1, 2, math.nan, None, None, 0, None),
        (3, shape(strip(55, 120, 0), polygon=True), 91, 0, 4, 5, None, None, None, 0, None),
        (4, shape(strip(-40, 40, -3), polygon=True), 90, 2, 3, 6, None, None, None, 1, None),
    )
    line = "boundary_type_fid"
    edges = (
        *(((-40, 6), (40, 6), 2), ((40, 2), (-40, 2), 0), ((-40, -2), (40, -2), 2)),
        *(((55, 2), (120, 2), 2), ((55, -2), (120, -2), 2), ((-40, -4), (40, -4), 2)),
        *(((40, 2), (55, 2), 2), ((40, -2), (55, -2), 2)),
    )
    rows = [(n, shape([start, end]), kind) for n, (start, end, kind) in enumerate(edges, start=1)]
    layer("boundaries", line, *rows)
    layer(
        "baseline_paths",
        "lane_fid, lane_connector_fid",
        (1, shape([(-40, 0), (40, 0)]), 1, None),
        (2, shape([(-40, 4), (40, 4)]), 2, None),
        (3, shape([(55, 0), (120, 0)]), 3, None),
        (4, shape([(40, 0), (55, 0)]), None, 11),
        (5, shape([(-40, -3), (40, -3)]), 4, None),
    )
    layer(
        "lane_connectors",
        "exit_lane_fid, entry_lane_fid, lane_group_connector_fid, intersection_fid, "
        "turn_type_fid, traffic_light_stop_line_fids, speed_limit_mps",
        (11, shape([(40, 0), (55, 0)]), 1, 3, 30, 70, 1, "5,6", None),
    )
    layer(
        "gen_lane_connectors_scaled_width_polygons",
        "lane_connector_fid, left_boundary_fid, right_boundary_fid",
        (1, shape(strip(40, 55, 0), polygon=True), 11, 7, 8),
    )
    layer("lane_groups_polygons", line, (90, None, 0), (91, None, 0))
    layer("lane_group_connectors", line, (30, None, 0))
    layer("intersections", line, (70, shape(strip(40, 55, 0, 8), polygon=True), 0))
    layer("walkways", line, (71, shape(strip(-40, 40, -8), polygon=True), 0))
    for empty in ("crosswalks", "carpark_areas", "generic_drivable_areas", "road_segments"):
        layer(empty, line)
    base.commit()
    base.close()
    return file


def write_log(root: Path, city: str, steps: int = 21) -> Path:
    _, east, north, _ = CITIES[city]
    file = root / "made.db"
    base = sqlite3.connect(file)
    base.execute("PRAGMA synchronous = OFF")
    for table, columns in COLUMNS.items():
        base.execute(f"CREATE TABLE {table} ({columns}, PRIMARY KEY (token))")

    def add(table: str, *row: object) -> None:
        base.execute(f"INSERT INTO {table} VALUES ({', '.join('?' * len(row))})", row)

    add("log", token(1), "g", "2021", 0, "2021.05.12_made", city, city)
    add("category", token(50), "vehicle", "")
    add("category", token(51), "pedestrian", "")
    add("track", token(60), token(50), 1.9, 4.6, 1.5)
    add("track", token(61), token(51), 0.7, 0.8, 1.7)
    add("scene", token(7), token(1), "scene", token(1000 + steps - 1), "90 91")
    for step in range(steps):
        time, x = 1_000_000 + 50_000 * step, east + 0.5 * step
        frame = token(100 + step)
        add("lidar_pc", frame, token(1000 + step), None, token(7), "", time)
        pose = (x, north, 0.0, 1.0, 0.0, 0.0, 0.0, 10.0, 0.0, 0.0)
        add("ego_pose", token(1000 + step), time, *pose, token(1))
        box = (east + 21.461, north, 0.0, 1.9, 4.6, 1.5, 3.0, 4.0, 0.0, 0.0, 1.0)
        add("lidar_box", token(2000 + step), frame, token(60), *box)
        if step >= 10:
            walker = (east + 11.461, north - 8.0, 0.0, 0.7, 0.8, 1.7, 0.0, 1.0, 0.0, 1.5708, 1.0)
            add("lidar_box", token(3000 + step), frame, token(61), *walker)
        state = "green" if step < 10 else "red"
        add("traffic_light_status", token(4000 + step), frame, 11, state)
    add("scenario_tag", token(5000), token(110), "high_magnitude_speed", None)
    base.commit()
    base.close()
    return file
