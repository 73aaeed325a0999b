"""How long a scene takes to read, and how much memory: a nuPlan log of 500 MB, an Argoverse log.

    REALDATA_DIR=... python -m bench.imports [--megabytes N] [--rounds N]

The nuPlan log and its map are made, in the published schema (tokens are primary keys, there is no
other index) and with random tokens. Each round is a process of its own, which has to load what
the readers need too. It prints the table that docs/benchmarks.md holds.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import resource
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from augment.formats.readers import reader_of
from bench.report import load, table
from tests.formats.nuplan_files import CITIES, degrees, geometry, token, write_log, write_map

CITY = "us-nv-las-vegas-strip"
BOXES = 120
"""In a frame; the city has up to a few hundred."""
STREETS = 60
"""Of a grid of so many by so many lanes, 25 m apart and 100 m long."""


def write_big_log(folder: Path, megabytes: int) -> Path:
    """A log of 20 Hz that goes on until the file has that size."""
    file = write_log(folder, CITY, steps=1)
    _, east, north, _ = CITIES[CITY]
    base = sqlite3.connect(file)
    base.execute("PRAGMA synchronous = OFF")
    base.execute("PRAGMA journal_mode = OFF")
    for name in ("lidar_pc", "ego_pose", "lidar_box"):
        base.execute(f"DELETE FROM {name}")
    for number in range(BOXES):
        base.execute(
            "INSERT INTO track VALUES (?, ?, 1.9, 4.6, 1.5)", (token(70 + number), token(50))
        )
    step = 0
    while file.stat().st_size < megabytes * 1_000_000:
        for _ in range(200):
            _add_frame(base, step, east, north)
            step += 1
        base.commit()
    base.close()
    return file


def _add_frame(base: sqlite3.Connection, step: int, east: float, north: float) -> None:
    x, frame = east + 0.25 * step, _random(f"frame {step}")
    pose = _random(f"pose {step}")
    stamp = 1_000_000 + 50_000 * step
    base.execute(
        "INSERT INTO lidar_pc VALUES (?, NULL, NULL, ?, NULL, ?, 'a/b.pcd', ?)",
        (frame, pose, token(7), stamp),
    )
    base.execute(
        "INSERT INTO ego_pose VALUES "
        "(?, ?, ?, ?, 0, 1, 0, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0, 32611, ?)",
        (pose, stamp, x, north, token(1)),
    )
    base.executemany(
        "INSERT INTO lidar_box VALUES "
        "(?, ?, ?, NULL, NULL, ?, ?, 0, 1.9, 4.6, 1.5, 5, 0, 0, 0, 1)",
        [
            (
                _random(f"box {step} {one}"),
                frame,
                token(70 + one),
                x + 2.0 * (one - BOXES / 2),
                north + one % 5 * 4.0,
            )
            for one in range(BOXES)
        ],
    )


def write_big_map(folder: Path) -> Path:
    """A grid of streets in the place of the small map's lanes."""
    file = write_map(folder, CITY)
    code, east, north, _ = CITIES[CITY]
    base = sqlite3.connect(file)
    base.execute("PRAGMA synchronous = OFF")
    for name in ("lanes_polygons", "baseline_paths", "boundaries"):
        base.execute(f"DELETE FROM {name}")
    for fid, x, y in _grid():
        line = np.column_stack([np.arange(x, x + 101, 2.0), np.full(51, y)])
        shapes = [
            geometry(degrees(code % 100, line + np.array([east, north + left])))
            for left in (0.0, 2.0, -2.0)
        ]
        base.execute(
            "INSERT INTO lanes_polygons VALUES (?, ?, 90, 0, ?, ?, 13.4, NULL, NULL, 0, NULL)",
            (fid, geometry(_outline(code, x, y, east, north), polygon=True), 2 * fid, 2 * fid + 1),
        )
        base.execute("INSERT INTO baseline_paths VALUES (?, ?, ?, NULL)", (fid, shapes[0], fid))
        for side in (0, 1):
            row = (2 * fid + side, shapes[1 + side])
            base.execute("INSERT INTO boundaries VALUES (?, ?, 2)", row)
    base.commit()
    base.close()
    return file


def _random(what: str) -> bytes:
    return hashlib.blake2b(what.encode(), digest_size=8).digest()


CHOSEN = _random("frame 400")


def _grid() -> Iterator[tuple[int, float, float]]:
    for number in range(STREETS * STREETS):
        row, column = divmod(number, STREETS)
        yield number + 1, 100.0 * (column - STREETS / 2), 25.0 * (row - STREETS / 2)


def _outline(code: int, x: float, y: float, east: float, north: float) -> np.ndarray:
    ring = [(x, y + 2), (x + 100, y + 2), (x + 100, y - 2), (x, y - 2), (x, y + 2)]
    return degrees(code % 100, np.array(ring) + np.array([east, north]))


def _measure_here(name: str, path: Path, item: str | None) -> None:
    """Read once, in this process; print seconds and MB at the most."""
    before = time.perf_counter(), time.process_time()
    scene = reader_of(name).read(path, item=item, frame=None, name="bench").scene
    wall_s, cpu_s = time.perf_counter() - before[0], time.process_time() - before[1]
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(wall_s, cpu_s, peak_mb, len(scene.lanes), len(scene.agents))


def _row(what: str, rounds: int, name: str, path: Path, item: str = "") -> list[str]:
    call = [sys.executable, "-m", "bench.imports", "--read", name, str(path), item]
    told = [
        [float(one) for one in subprocess.check_output(call, text=True).split()]
        for _ in range(rounds)
    ]
    wall_s, cpu_s, peak_mb, lanes, agents = zip(*told, strict=True)
    return [
        what,
        f"{lanes[0]:.0f}, {agents[0]:.0f}",
        f"{min(wall_s):.2f}, {statistics.median(wall_s):.2f}",
        f"{min(cpu_s):.2f}, {statistics.median(cpu_s):.2f}",
        f"{max(peak_mb):.0f}",
    ]


def main() -> None:
    """Make the files, measure, print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--megabytes", type=int, default=500)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--read", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.read:
        name, path, item = given.read
        _measure_here(name, Path(path), item or None)
        return
    busy, rows = load(), []
    with tempfile.TemporaryDirectory() as folder:
        map_mb = write_big_map(Path(folder)).stat().st_size / 1e6
        file = write_big_log(Path(folder), given.megabytes)
        what = f"nuPlan, a log of {file.stat().st_size / 1e6:.0f} MB, a map of {map_mb:.0f} MB"
        rows.append(_row(what, given.rounds, "nuplan", file, CHOSEN.hex()))
    if "REALDATA_DIR" in os.environ:
        logs = sorted((Path(os.environ["REALDATA_DIR"]) / "av2_sensor").iterdir())
        rows.append(_row("an Argoverse 2 Sensor log", given.rounds, "av2", logs[0]))
    head = ["read", "lanes, agents", "seconds: shortest, median", "of the CPU", "MB at most"]
    print(f"{given.rounds} rounds, {busy}:\n")
    print(table(head, rows))


if __name__ == "__main__":
    main()
