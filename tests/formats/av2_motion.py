"""A small Motion Forecasting scenario on the map of av2_logs, in the published layout.

City frame: the data set's car drives north at 10 m/s and is at (100, 201.42) in step 49.
"""

import json
import math
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow import parquet

from tests.formats.av2_logs import city_map

STEPS, OBSERVED = 110, 50


def row(track: str, kind: str, step: int, x: float, y: float, **fields: Any) -> dict[str, Any]:
    made: dict[str, Any] = {
        "track_id": track, "object_type": kind, "object_category": 2, "timestep": step,
        "position_x": x, "position_y": y, "heading": math.pi / 2,
        "velocity_x": 0.0, "velocity_y": 0.0, "observed": step < OBSERVED,
        "start_timestamp": 1.0, "end_timestamp": 2.0, "num_timestamps": STEPS,
        "scenario_id": "made", "focal_track_id": "7", "city": "pittsburgh",
    }  # fmt: skip
    return made | fields


def rows() -> list[dict[str, Any]]:
    """The car, an oncoming cyclist (focal) at 5 m/s, a walker from step 40 on."""
    made = []
    for step in range(STEPS):
        north = 201.42 + step - 49
        made.append(row("AV", "vehicle", step, 100.0, north, velocity_y=10.0))
        away = {"heading": -math.pi / 2, "velocity_y": -5.0}
        made.append(row("7", "cyclist", step, 96.0, 240.0 - 0.5 * (step - 49), **away))
        if step >= 40:
            made.append(row("8", "pedestrian", step, 106.0, 215.0, velocity_x=-1.0))
        made.append(row("9", "static", step, 104.0, 210.0))
    return made


def write_scenario(
    folder: Path, *, table: list[dict[str, Any]] | None = None, city: dict[str, Any] | None = None
) -> Path:
    folder.mkdir(parents=True)
    made = pa.Table.from_pylist(rows() if table is None else table)
    parquet.write_table(made, folder / "scenario_made.parquet")
    (folder / "log_map_archive_made.json").write_text(json.dumps(city or city_map()))
    return folder
