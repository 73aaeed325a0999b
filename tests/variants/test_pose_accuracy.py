"""How near the pose tool and the control points of a prompt are to the centrelines themselves."""

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from augment.prompts.vectors import control_points, curve_from, short_names
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from augment.variants.pose_tool import PoseTool
from tests.fixtures.shelf import HARD_SCENES, SCENES, whole_scene
from tests.formats.test_recorded_formats import FILES, reading

AUTHORED = [whole_scene(name) for name in [*HARD_SCENES, *SCENES][::4]]
EVERY_M = 4.0


def on_polyline(points: NDArray[np.float64], s_m: float) -> tuple[float, float]:
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    return (float(np.interp(s_m, along, points[:, 0])), float(np.interp(s_m, along, points[:, 1])))


def assert_on_the_lanes(scene: Scene) -> None:
    """By id within 2 cm, by the text within 10 cm, on every lane from end to end."""
    tool, names = PoseTool(scene, radius_m=math.inf), short_names(scene)
    for way in LaneGraph(scene).lanes.values():
        name, line = names.lanes[way.id], way.centerline
        lane = tool.curves[name].lane
        pieces = [curve_from(control) for control in control_points(lane)]
        for s_m in np.arange(0.0, line.length_m, EVERY_M).tolist():
            wanted = on_polyline(line.points_m, s_m)
            pose = tool.pose_on_lane(name, "lane", s_m).pose
            assert math.dist((pose.x_m, pose.y_m), wanted) <= 0.02, name
            number = max(0, sum(piece.start_m <= s_m for piece in lane) - 1)
            share = (s_m - lane[number].start_m) / lane[number].length_m
            curve = pieces[number]
            (drawn,) = curve.points(curve.parameters_at([share * curve.length_m]))
            assert math.dist(drawn.tolist(), wanted) <= 0.1, name


@pytest.mark.slow
@pytest.mark.parametrize("scene", AUTHORED, ids=lambda scene: scene.name)
def test_on_authored_lanes_the_tool_and_the_text_are_on_the_lane(scene: Scene) -> None:
    assert_on_the_lanes(scene)


@pytest.mark.slow
@pytest.mark.realdata
@pytest.mark.parametrize("name", FILES)
def test_on_recorded_lanes_tool_and_text_are_on_the_lane(realdata: Path, name: str) -> None:
    assert_on_the_lanes(reading(realdata, name).scene)
