"""The pose tool on every scene: pieces, errors against the centrelines, time of a call.

    python -m bench.pose_on_lane

Errors are read every 0.25 m on the whole map: of the tool's answers by id, and of the control
points as the prompt writes them; headings against the chord of 0.75 m either way.
Calls are timed as a model makes them, from the arguments to the answer, on the 80 m that a
prompt shows: by a lane's id from its beginning, by its id from beside the ego (or the error if
that is nowhere beside it), and by four control points. "build" is the first time for a scene.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from statistics import median

import numpy as np

from augment.prompts.lane_curves import control_points
from augment.scene.bezier_lanes import bezier_lane
from augment.scene.entities import Scene
from augment.variants.pose_tool import PoseTool
from tests.variants.pose_accuracy import (
    accuracy,
    authored_scenes,
    recorded_scenes,
    text_accuracy,
    whole_map,
)

CALLS = 600
EVERY_M = 0.25
COLUMNS = (
    ("scene", 18),
    ("lanes", 6),
    ("pieces", 7),
    ("most", 5),
    ("id m", 7),
    ("id deg", 7),
    ("text m", 7),
    ("text deg", 9),
    ("worst on", 14),
    ("build ms", 9),
    ("lane us", 8),
    ("ego us", 7),
    ("points us", 10),
    ("p99 us", 7),
)


def main() -> None:
    print("".join(f"{title:>{width}}" for title, width in COLUMNS))
    scenes = authored_scenes()
    if folder := os.environ.get("REALDATA_DIR"):
        scenes += recorded_scenes(Path(folder))
    for scene in scenes:
        cells = (scene.name, *_accuracy_cells(scene), *_time_cells(scene))
        print("".join(f"{cell:>{width}}" for cell, (_, width) in zip(cells, COLUMNS, strict=True)))


def _accuracy_cells(scene: Scene) -> tuple[str, ...]:
    tool = whole_map(scene)
    by_id, by_text = accuracy(tool, EVERY_M), text_accuracy(tool, EVERY_M)
    counts = [len(curve.lane.pieces) for curve in tool.curves.values()]
    return (
        str(len(counts)),
        str(sum(counts)),
        str(max(counts)),
        f"{by_id.position_m.max():.3f}",
        f"{by_id.heading_deg(100):.2f}",
        f"{by_text.position_m.max():.3f}",
        f"{by_text.heading_deg(100):.2f}",
        by_text.worst_heading_on,
    )


def _time_cells(scene: Scene) -> tuple[str, ...]:
    bezier_lane.cache_clear()
    began = time.perf_counter()
    tool = PoseTool(scene)
    names = list(tool.curves)
    built_s = time.perf_counter() - began
    points = [control_points(curve.lane)[-1] for curve in tool.curves.values()]
    by_lane = [{"lane": name, "start": "lane", "distance_m": 1.0} for name in names]
    by_ego = [{"lane": name, "start": "Agent1", "distance_m": 1.0} for name in names]
    by_points = [{"lane": control, "start": "lane", "distance_m": 1.0} for control in points]
    timed = [_timed_us(tool, calls) for calls in (by_lane, by_ego, by_points)]
    return (
        f"{1000.0 * built_s:.0f}",
        *(f"{median(times):.0f}" for times in timed),
        f"{np.percentile(np.concatenate(timed), 99):.0f}",
    )


def _timed_us(tool: PoseTool, calls: list[dict[str, object]]) -> list[float]:
    """The time of each of some hundred calls in microseconds, those with an error included."""
    tool.answer(calls[0])
    times = []
    for number in range(CALLS):
        call = calls[number % len(calls)]
        began = time.perf_counter()
        tool.answer(call)
        times.append(1e6 * (time.perf_counter() - began))
    return times


if __name__ == "__main__":
    main()
