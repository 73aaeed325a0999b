"""A small Argoverse 2 log on disk, in the published layout, whose right answers are known.

City frame: the ego drives north (heading 90 degrees) at 10 m/s; its rear axle is at (100, 200) at
sweep 0. Street: two lanes of 4 m; the ego's is under it, the other one comes towards it on its
left. 30 m ahead an intersection of 10 m leads straight on or, over two segments, to the left.
"""

import json
import math
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import feather

STEP_NS = 100_000_000
START_NS = 315_966_253_660_357_000
SWEEPS = 5
HEADING_RAD = math.pi / 2

Point = tuple[float, float]


def quaternion(heading_rad: float) -> dict[str, float]:
    return {"qw": math.cos(heading_rad / 2), "qx": 0.0, "qy": 0.0, "qz": math.sin(heading_rad / 2)}


def box(
    sweep: int, track: str, x: float, y: float, heading: float = 0.0, **fields: Any
) -> dict[str, Any]:
    """A row of annotations.feather, in the ego frame (rear axle) of its sweep."""
    row: dict[str, Any] = {
        "timestamp_ns": START_NS + sweep * STEP_NS, "track_uuid": track,
        "category": "REGULAR_VEHICLE", "num_interior_pts": 9,
        "length_m": 4.5, "width_m": 1.9, "height_m": 1.6, "tx_m": x, "ty_m": y, "tz_m": 0.5,
    }  # fmt: skip
    return row | quaternion(heading) | fields


def boxes() -> list[dict[str, Any]]:
    """A parked car, an oncoming one at 5 m/s, a cone, and a walker who appears at sweep 3."""
    rows = []
    for sweep in range(SWEEPS):
        driven = 1.0 * sweep
        rows += [
            box(sweep, "parked", 21.42 - driven, 0.0),
            box(sweep, "oncoming", 41.42 - driven - 0.5 * sweep, 4.0, math.pi),
            box(sweep, "cone", 11.42 - driven, -1.5, category="CONSTRUCTION_CONE"),
        ]
        if sweep >= 3:
            rows.append(box(sweep, "walker", 9.42 - driven, -5.0, category="PEDESTRIAN"))
    return rows


def poses() -> list[dict[str, Any]]:
    """Ego poses at twice the sweeps' rate; the frame is tilted by nothing."""
    return [
        {"timestamp_ns": START_NS + half * STEP_NS // 2}
        | {"tx_m": 100.0, "ty_m": 200.0 + 0.5 * half, "tz_m": 7.0}
        | quaternion(HEADING_RAD)
        for half in range(2 * SWEEPS)
    ]


def points(*pairs: Point) -> list[dict[str, float]]:
    return [{"x": x, "y": y, "z": 0.0} for x, y in pairs]


def segment(
    number: int, left: list[Point], right: list[Point], *after: int, **fields: Any
) -> dict[str, Any]:
    made: dict[str, Any] = {
        "id": number, "is_intersection": False, "lane_type": "VEHICLE",
        "left_lane_boundary": points(*left), "right_lane_boundary": points(*right),
        "left_lane_mark_type": "NONE", "right_lane_mark_type": "NONE",
        "left_neighbor_id": None, "right_neighbor_id": None,
        "successors": list(after), "predecessors": [],
    }  # fmt: skip
    return made | fields


def city_map() -> dict[str, Any]:
    crossed = {"is_intersection": True}
    segments = [
        segment(11, [(98, 150), (98, 190)], [(102, 150), (102, 190)], 12),
        segment(12, [(98, 190), (98, 230)], [(102, 190), (102, 230)], 21, 22, left_neighbor_id=14),
        segment(13, [(98, 240), (98, 300)], [(102, 240), (102, 300)], predecessors=[21]),
        segment(14, [(98, 230), (98, 150)], [(94, 230), (94, 150)], left_neighbor_id=12),
        segment(15, [(90, 233), (60, 233)], [(90, 237), (60, 237)]),
        segment(16, [(102, 150), (102, 230)], [(104, 150), (104, 230)], lane_type="BIKE"),
        segment(21, [(98, 230), (98, 240)], [(102, 230), (102, 240)], **crossed),
        segment(22, [(98, 230), (97.5, 232)], [(102, 230), (101, 234)], 23, **crossed),
        segment(23, [(97.5, 232), (90, 233)], [(101, 234), (90, 237)], 15, **crossed),
        segment(99, [(98, 900), (98, 950)], [(102, 900), (102, 950)]),
    ]
    square = points((94, 150), (104, 150), (104, 300), (94, 300))
    edges = {f"edge{n}": points((94, y), (104, y)) for n, y in ((1, 226), (2, 229))}
    return {
        "lane_segments": {str(one["id"]): one for one in segments},
        "drivable_areas": {"4": {"id": 4, "area_boundary": square}},
        "pedestrian_crossings": {"5": {"id": 5} | edges},
    }


def write_log(
    folder: Path,
    *,
    box_rows: list[dict[str, Any]] | None = None,
    pose_rows: list[dict[str, Any]] | None = None,
    city: dict[str, Any] | None = None,
) -> Path:
    (folder / "map").mkdir(parents=True)
    tables = {
        "annotations": boxes() if box_rows is None else box_rows,
        "city_SE3_egovehicle": poses() if pose_rows is None else pose_rows,
    }
    for name, rows in tables.items():
        feather.write_feather(pa.Table.from_pylist(rows), folder / f"{name}.feather")
    map_file = folder / "map" / "log_map_archive_made____PIT_city_1.json"
    map_file.write_text(json.dumps(city_map() if city is None else city))
    return folder
