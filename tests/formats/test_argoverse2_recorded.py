"""The reader on recorded logs: what must hold of any of them, and what is known of one."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from shapely import Point, Polygon, union_all

from augment.geometry.angles import difference
from augment.scene.codec import scene_from_document, scene_to_document
from augment.scene.entities import AgentType, AreaKind, Scene, TrafficSide
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Recording
from augment.scene.recording_codec import recording_from_document, recording_to_document
from tests.recorded import recorded

pytestmark = pytest.mark.realdata


@pytest.fixture
def start(realdata: Path) -> tuple[Scene, Recording]:
    return recorded(realdata)


def test_the_ego_is_as_fast_as_the_data_sets_notes_say(start: tuple[Scene, Recording]) -> None:
    scene, recording = start
    assert scene.ego.speed_mps == pytest.approx(10.5, abs=0.15)
    assert recording.times_s[-1] == pytest.approx(15.5, abs=0.1)
    steps = np.hypot(*np.diff(recording.ego[:, :2], axis=0).T)
    assert steps.sum() == pytest.approx(72.0, abs=2.0)
    assert scene.traffic_side is TrafficSide.RIGHT


def test_a_lane_lies_under_the_ego_and_leads_on(start: tuple[Scene, Recording]) -> None:
    scene, _ = start
    graph = LaneGraph(scene)
    assert scene.ego.lane_id is not None
    place = graph.lane(scene.ego.lane_id).centerline.project(0.0, 0.0)
    heading = graph.lane(scene.ego.lane_id).centerline.heading_at(place.s_m)
    assert abs(heading) < math.radians(15.0)
    assert graph.along(scene.ego.lane_id, place.s_m, 120.0) is not None


def test_lanes_are_as_wide_as_lanes(start: tuple[Scene, Recording]) -> None:
    # The map counts parking bays along a street to its lanes.
    widths = [way.width_m for way in LaneGraph(start[0]).lanes.values()]
    assert 2.8 < float(np.median(widths)) < 5.0
    assert min(widths) > 2.0
    assert max(widths) < 10.0


def test_ways_join_where_the_map_says_they_do(start: tuple[Scene, Recording]) -> None:
    scene, _ = start
    graph = LaneGraph(scene)
    for way_id, way in graph.lanes.items():
        for following in graph.successors(way_id):
            x_m, y_m = graph.lanes[following].centerline.points_m[0]
            end_x_m, end_y_m = way.centerline.points_m[-1]
            assert math.hypot(x_m - end_x_m, y_m - end_y_m) < 2.5, (way_id, following)


def test_what_drives_heads_where_it_drives(start: tuple[Scene, Recording]) -> None:
    scene, recording = start
    checked = 0
    vehicles = (AgentType.VEHICLE.value, AgentType.BUS.value)
    for track in (track for track in recording.tracks if track.type in vehicles):
        moved = np.diff(track.states[:, :2], axis=0)
        for (dx, dy), state in zip(moved, track.states[:-1], strict=True):
            if math.hypot(dx, dy) > 0.5:
                checked += 1
                assert abs(difference(math.atan2(dy, dx), state[2])) < math.radians(40.0)
    assert checked > 200
    aligned = [
        abs(difference(LaneGraph(scene).lane(a.lane_id).centerline.heading_at(0.0), a.heading_rad))
        for a in scene.agents
        if a.type is AgentType.VEHICLE and a.speed_mps > 3.0 and a.lane_id is not None
    ]
    assert float(np.median(aligned)) < math.radians(10.0)


@pytest.mark.parametrize("frame", [0, 60])
def test_the_ego_stays_on_what_can_be_driven_on(realdata: Path, frame: int) -> None:
    scene, recording = recorded(realdata, frame)
    drivable = union_all(
        [Polygon(area.boundary_m) for area in scene.areas if area.kind is AreaKind.DRIVABLE]
    )
    assert all(drivable.contains(Point(x, y)) for x, y in recording.ego[:, :2])
    assert recording.ego[0, :3].tolist() == [0.0, 0.0, 0.0]
    assert recording.ego[0, 3] == scene.ego.speed_mps


def test_no_area_crosses_itself(start: tuple[Scene, Recording]) -> None:
    areas = start[0].areas
    assert [area.id for area in areas if not Polygon(area.boundary_m).is_valid] == []
    assert {area.kind for area in areas} == {AreaKind.DRIVABLE, AreaKind.CROSSWALK}


def test_frames_of_one_log_show_one_world(realdata: Path, start: tuple[Scene, Recording]) -> None:
    _, first = start
    later_scene, later = recorded(realdata, 60)
    x_m, y_m, heading_rad = first.ego[60, :3]
    cos, sin = math.cos(heading_rad), math.sin(heading_rad)
    back = later.ego[:, :2] @ np.array([[cos, sin], [-sin, cos]]) + np.array([x_m, y_m])
    assert np.abs(back - first.ego[60:, :2]).max() < 0.02
    assert len(later_scene.lanes) > 30


def test_it_survives_the_way_through_json_exactly(start: tuple[Scene, Recording]) -> None:
    scene, recording = start
    text = json.dumps(scene_to_document(scene), allow_nan=False)
    assert scene_from_document(json.loads(text)) == scene
    text = json.dumps(recording_to_document(recording), allow_nan=False)
    back = recording_from_document(json.loads(text))
    for given, kept in zip(recording.tracks, back.tracks, strict=True):
        assert np.array_equal(given.states, kept.states, equal_nan=True)
