from __future__ import annotations

from pathlib import Path

import pytest

from augment.prompts.vectors import short_names
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from tests.recorded import recorded
from tests.variants.pose_accuracy import (
    FILES,
    Accuracy,
    accuracy,
    authored_scenes,
    recorded_scenes,
    text_accuracy,
    whole_map,
)

BY_ID = 0.02, 0.5
BY_TEXT = 0.1, 3.0


def assert_within(found: Accuracy, position_m: float, heading_deg: float) -> None:
    assert found.position_m.max() <= position_m, found.worst_position_on
    assert found.heading_deg(100) <= heading_deg, found.worst_heading_on


@pytest.mark.parametrize("scene", authored_scenes()[::4], ids=lambda scene: scene.name)
def test_on_authored_lanes_the_tool_and_the_text_are_on_the_lane(scene: Scene) -> None:
    tool = whole_map(scene)
    assert_within(accuracy(tool), *BY_ID)
    assert_within(text_accuracy(tool), *BY_TEXT)


@pytest.mark.realdata
@pytest.mark.parametrize("number", range(len(FILES)))
def test_on_recorded_lanes_the_tool_and_the_text_are_on_the_lane(
    realdata: Path, number: int
) -> None:
    tool = whole_map(recorded_scenes(realdata)[number])
    assert_within(accuracy(tool), *BY_ID)
    assert_within(text_accuracy(tool), *BY_TEXT)


@pytest.mark.realdata
def test_on_recorded_lanes_a_distance_leads_where_the_centrelines_lead(realdata: Path) -> None:
    scene, _ = recorded(realdata)
    tool, graph, names = whole_map(scene), LaneGraph(scene), short_names(scene)
    start = scene.ego.lane_id
    assert start is not None
    s_m = graph.lane(start).centerline.project(0.0, 0.0).s_m
    for distance_m in (-20.0, 12.5, 40.0, 90.0, 120.0):
        wanted = graph.along(start, s_m, distance_m)
        found = tool.pose_on_lane(names.lanes[start], "Agent1", distance_m)
        assert wanted is not None
        assert found.lane == names.lanes[wanted.lane_id]
        gap_m = abs(found.pose.x_m - wanted.pose.x_m) + abs(found.pose.y_m - wanted.pose.y_m)
        assert gap_m < 0.02
