"""How near the pose tool is to the centrelines themselves, by a reference of its own."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.formats.readers import recognise
from augment.geometry.frames import Pose
from augment.prompts.vectors import control_points, curve_from, short_names
from augment.scene.codec import scene_from_document
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from augment.variants.pose_tool import PoseTool

FIXTURES = Path(__file__).parents[2] / "fixtures"
FILES = (
    "av2_sensor/7fab2350-7eaf-3b7e-a39d-6937a4c1bede",
    "commonroad/USA_Peach-4_8_T-1.xml",
    "scenarionet/sd_nuscenes_mini_val_scene-0103*.pkl",
    "waymo_motion/womd_scenario_input.tfrecord",
)

CHORD_M = 0.75
EVERY_M = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """Over all places of all lanes; headings (N,) only where the chord lies within the lane."""

    position_m: NDArray[np.float64]
    heading_rad: NDArray[np.float64]
    worst_position_on: str
    worst_heading_on: str

    def heading_deg(self, percentile: float) -> float:
        return math.degrees(float(np.percentile(self.heading_rad, percentile)))


def authored_scenes() -> list[Scene]:
    """The scenes of the catalogue, and of further sets that lie beside it."""
    return [
        scene_from_document(json.loads(path.read_text(encoding="utf-8")))
        for path in sorted(FIXTURES.glob("**/scenes/*.json"))
    ]


@cache
def recorded_scenes(realdata: Path) -> tuple[Scene, ...]:
    """One scene of each recorded file."""
    found = []
    for pattern in FILES:
        (path,) = realdata.glob(pattern)
        reader = recognise(path)
        found.append(reader.read(path, item=None, frame=None, name=reader.name).scene)
    return tuple(found)


def whole_map(scene: Scene) -> PoseTool:
    return PoseTool(scene, radius_m=math.inf)


def accuracy(tool: PoseTool, every_m: float = EVERY_M) -> Accuracy:
    """What the tool says by id on each lane of its scene, from end to end."""
    return _measured(
        tool, every_m, lambda name: lambda s_m: tool.pose_on_lane(name, "lane", s_m).pose
    )


def text_accuracy(tool: PoseTool, every_m: float = EVERY_M) -> Accuracy:
    """The same of the control points that the prompt shows, as written to the centimetre."""

    def reader_of(name: str) -> Callable[[float], Pose]:
        lane = tool.curves[name].lane
        pieces = [curve_from(control) for control in control_points(lane)]

        def read(s_m: float) -> Pose:
            number = lane.piece_at(s_m)
            piece, curve = lane.pieces[number], pieces[number]
            share = (s_m - piece.start_m) / piece.length_m
            return curve.pose_at(min(share, 1.0) * curve.length_m)

        return read

    return _measured(tool, every_m, reader_of)


def _measured(
    tool: PoseTool, every_m: float, reader_of: Callable[[str], Callable[[float], Pose]]
) -> Accuracy:
    names = short_names(tool.scene)
    positions: list[float] = []
    headings: list[float] = []
    worst_position, worst_heading = (0.0, ""), (0.0, "")
    for way in LaneGraph(tool.scene).lanes.values():
        name = names.lanes[way.id]
        gaps_m, turns_rad = _errors_on(reader_of(name), way.centerline.points_m, every_m)
        positions += gaps_m
        headings += turns_rad
        worst_position = max(worst_position, (max(gaps_m), name))
        worst_heading = max(worst_heading, (max(turns_rad, default=0.0), name))
    return Accuracy(
        position_m=np.array(positions),
        heading_rad=np.array(headings),
        worst_position_on=worst_position[1],
        worst_heading_on=worst_heading[1],
    )


def _errors_on(
    pose_at: Callable[[float], Pose], points: NDArray[np.float64], every_m: float
) -> tuple[list[float], list[float]]:
    lengths = [math.dist(a, b) for a, b in pairwise(points)]
    along = np.concatenate([[0.0], np.cumsum(lengths)])

    def source(s_m: float) -> tuple[float, float]:
        return (
            float(np.interp(s_m, along, points[:, 0])),
            float(np.interp(s_m, along, points[:, 1])),
        )

    gaps_m, turns_rad = [], []
    for s_m in [*np.arange(0.0, along[-1], every_m).tolist(), float(along[-1])]:
        pose = pose_at(s_m)
        gaps_m.append(math.dist((pose.x_m, pose.y_m), source(s_m)))
        if CHORD_M <= s_m <= along[-1] - CHORD_M:
            (x0, y0), (x1, y1) = source(s_m - CHORD_M), source(s_m + CHORD_M)
            turn = pose.heading_rad - math.atan2(y1 - y0, x1 - x0)
            turns_rad.append(abs(math.remainder(turn, math.tau)))
    return gaps_m, turns_rad
