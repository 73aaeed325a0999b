from __future__ import annotations

from pathlib import Path

import pytest

from augment.prompts.names import short_names
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from tests.recorded import recorded
from tests.variants.pose_accuracy import accuracy, authored_scenes, whole_map


@pytest.mark.parametrize("scene", authored_scenes(), ids=lambda scene: scene.name)
def test_on_authored_lanes_the_tool_is_on_the_lane_and_along_it(scene: Scene) -> None:
    found = accuracy(whole_map(scene))
    assert found.position_m.max() < 0.3, found.worst_position_on
    assert found.heading_deg(100) <= 3.0, found.worst_heading_on


@pytest.mark.realdata
@pytest.mark.parametrize("frame", [0, 60])
def test_on_recorded_lanes_the_tool_is_on_the_lane_and_mostly_along_it(
    realdata: Path, frame: int
) -> None:
    found = accuracy(whole_map(recorded(realdata, frame)[0]))
    print(
        f"recorded lanes: at most {found.position_m.max():.3f} m off ({found.worst_position_on}), "
        f"heading {found.heading_deg(95):.2f} degrees at the 95th percentile, "
        f"{found.heading_deg(100):.2f} at worst ({found.worst_heading_on})"
    )
    assert found.position_m.max() < 0.3, found.worst_position_on
    assert found.heading_deg(95) <= 3.0


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
        assert gap_m < 0.6
