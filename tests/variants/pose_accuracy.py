"""How near the pose tool is to the centrelines themselves, by a reference of its own."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from augment.prompts.names import short_names
from augment.scene.codec import scene_from_document
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from augment.variants.pose_tool import PoseTool

AUTHORED = Path(__file__).parents[2] / "fixtures" / "scenes"

CHORD_M = 2.5
STEP_M = 0.25


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
    return [
        scene_from_document(json.loads(path.read_text(encoding="utf-8")))
        for path in sorted(AUTHORED.glob("*.json"))
    ]


def whole_map(scene: Scene) -> PoseTool:
    return PoseTool(scene, radius_m=math.inf)


def accuracy(tool: PoseTool) -> Accuracy:
    """Each lane of the tool's scene read every 0.25 m from its beginning to its end."""
    names = short_names(tool.scene)
    positions: list[float] = []
    headings: list[float] = []
    worst_position, worst_heading = (0.0, ""), (0.0, "")
    for way in LaneGraph(tool.scene).lanes.values():
        name = names.lanes[way.id]
        gaps_m, turns_rad = _errors_on(tool, name, way.centerline.points_m)
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
    tool: PoseTool, name: str, points: NDArray[np.float64]
) -> tuple[list[float], list[float]]:
    lengths = [math.dist(a, b) for a, b in pairwise(points)]
    along = np.concatenate([[0.0], np.cumsum(lengths)])

    def source(s_m: float) -> tuple[float, float]:
        return (
            float(np.interp(s_m, along, points[:, 0])),
            float(np.interp(s_m, along, points[:, 1])),
        )

    gaps_m, turns_rad = [], []
    for s_m in [*np.arange(0.0, along[-1], STEP_M).tolist(), float(along[-1])]:
        pose = tool.pose_on_lane(name, "lane", s_m).pose
        gaps_m.append(math.dist((pose.x_m, pose.y_m), source(s_m)))
        if CHORD_M <= s_m <= along[-1] - CHORD_M:
            (x0, y0), (x1, y1) = source(s_m - CHORD_M), source(s_m + CHORD_M)
            turn = pose.heading_rad - math.atan2(y1 - y0, x1 - x0)
            turns_rad.append(abs(math.remainder(turn, math.tau)))
    return gaps_m, turns_rad
