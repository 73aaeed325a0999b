import math
from pathlib import Path

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.argoverse2 import ArgoverseSensor
from augment.scene.codec import recording_to_document
from augment.scene.entities import AgentType, Scene, TrafficLight, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.scene.recording import Recording
from tests.formats.av2_logs import boxes, city_map, poses, write_log


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return write_log(tmp_path / "made-log")


def read(folder: Path, frame: int = 0) -> tuple[Scene, Recording]:
    reading = ArgoverseSensor().read(folder, item=None, frame=frame, name="made")
    return reading.scene, reading.recording


def test_boxes_come_into_the_ego_frame_nearest_first(log: Path) -> None:
    scene, _ = read(log)
    # The centre of the ego is 1.42 m ahead of its rear axle.
    pose = scene.origin.pose
    assert (pose.x_m, pose.y_m, pose.heading_rad) == pytest.approx((100.0, 201.42, math.pi / 2))
    assert scene.ego.speed_mps == pytest.approx(10.0)
    assert scene.ego.lane_id == "Lane1"
    found = [(a.id, a.type, a.x_m, a.y_m, a.lane_id) for a in scene.agents]
    assert found == [
        ("Agent2", AgentType.TRAFFIC_CONE, 10.0, -1.5, "Lane1"),
        ("Agent3", AgentType.VEHICLE, 20.0, 0.0, "Lane1"),
        ("Agent4", AgentType.VEHICLE, 40.0, 4.0, None),
    ]


def test_speeds_come_from_places_in_the_city_not_from_the_ego_frame(log: Path) -> None:
    scene, _ = read(log, frame=2)
    cone, parked, oncoming = scene.agents
    assert (cone.speed_mps, parked.speed_mps) == (0.0, 0.0)
    assert oncoming.speed_mps == pytest.approx(5.0)
    assert abs(oncoming.heading_rad) == pytest.approx(math.pi, abs=1e-3)
    assert parked.x_m == pytest.approx(18.0)


def test_lanes_have_the_middle_the_width_and_the_successors_of_the_map(log: Path) -> None:
    scene, _ = read(log)
    own, oncoming, behind = (scene.lanes[i] for i in (0, 1, 2))
    assert own.centerline.points_m[[0, -1]].tolist() == [[-11.42, 0.0], [28.58, 0.0]]
    assert own.width_m == 4.0
    assert behind.successors == ("Lane1",)
    assert own.left_neighbor is None, "the lane beside comes towards the ego"
    assert oncoming.centerline.heading_at(1.0) == pytest.approx(math.pi)
    assert len(scene.lanes) == 5, "neither the bicycle lane nor the lane far away"


def test_each_way_over_an_intersection_is_one_connector(log: Path) -> None:
    scene, _ = read(log)
    found = {(c.from_lane, c.to_lane, c.turn_type) for c in scene.connectors}
    onward, leftward = (
        next(lane.id for lane in scene.lanes if abs(lane.centerline.points_m[0][axis] - at) < 0.01)
        for axis, at in ((0, 38.58), (1, 10.0))
    )
    assert found == {("Lane1", onward, TurnType.STRAIGHT), ("Lane1", leftward, TurnType.LEFT)}
    assert {c.traffic_light for c in scene.connectors} == {TrafficLight.UNKNOWN}
    assert LaneGraph(scene).route("Lane1", 90.0)[-1] == onward


def test_the_recording_runs_from_t0_to_the_end_in_the_frame_of_t0(log: Path) -> None:
    _, recording = read(log, frame=1)
    assert recording.times_s.tolist() == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert recording.ego[:, 0].tolist() == pytest.approx([0.0, 1.0, 2.0, 3.0])
    by_id = {track.agent_id: track for track in recording.tracks}
    oncoming, walker = by_id["Agent4"], by_id["Agent5"]
    assert oncoming.states[:, 0].tolist() == pytest.approx([38.5, 38.0, 37.5, 37.0])
    assert walker.type == "PEDESTRIAN"
    assert np.isnan(walker.states[:2]).all()
    assert walker.states[2:, 0].tolist() == pytest.approx([7.0, 7.0])
    assert recording_to_document(recording)["tracks"][3]["states"][0] is None


def fault_of(folder: Path, frame: int = 0) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(folder, frame)
    return str(caught.value)


def test_missing_things_are_named(tmp_path: Path, log: Path) -> None:
    assert "annotations.feather: can't be read" in fault_of(tmp_path / "nowhere")
    for frame in (-1, 5, 9999):
        assert f"frame: {frame} is not there; there are 0 to 4" in fault_of(log, frame)
    next((log / "map").iterdir()).unlink()
    assert "log_map_archive_*.json: 0 such files" in fault_of(log)
    (log / "city_SE3_egovehicle.feather").unlink()
    assert "city_SE3_egovehicle.feather: can't be read" in fault_of(log)


def notes_of(folder: Path) -> str:
    return " ".join(ArgoverseSensor().read(folder, item=None, frame=0, name="made").notes)


def test_odd_rows_are_left_out_with_a_note(tmp_path: Path) -> None:
    rows = boxes()
    unknown = [rows[0] | {"category": "UNICORN"}, *rows[1:]]
    assert "category: unknown 'UNICORN'" in notes_of(write_log(tmp_path / "a", box_rows=unknown))
    broken = [rows[0], rows[1] | {"tx_m": math.nan}, *rows[2:]]
    folder = write_log(tmp_path / "b", box_rows=broken)
    assert "annotations.feather with a gap or an odd number was left out." in notes_of(folder)
    folder = write_log(tmp_path / "d", pose_rows=poses()[1:])
    assert "A box at a time without a pose was left out (3 times)" in notes_of(folder)


def test_broken_tables_are_named(tmp_path: Path) -> None:
    rows = boxes()
    folder = write_log(
        tmp_path / "c", box_rows=[{k: v for k, v in row.items() if k != "qw"} for row in rows]
    )
    assert "annotations.feather: can't be read, or has not the columns" in fault_of(folder)
    folder = write_log(tmp_path / "d", pose_rows=[poses()[0] | {"timestamp_ns": 1}])
    assert "city_SE3_egovehicle.feather: has no pose at an annotated time" in fault_of(folder)
    folder = write_log(tmp_path / "e", box_rows=[row | {"tx_m": "far"} for row in rows])
    assert "annotations.feather: can't be read" in fault_of(folder)
    folder = write_log(tmp_path / "f")
    (folder / "annotations.feather").write_bytes(b"no feather")
    assert "annotations.feather: can't be read" in fault_of(folder)


def test_a_broken_map_names_the_place(tmp_path: Path) -> None:
    city = city_map()
    city["lane_segments"]["12"]["left_lane_boundary"][1]["y"] = "north"
    city["lane_segments"]["13"]["lane_type"] = "TRAM"
    text = notes_of(write_log(tmp_path / "a", city=city))
    assert "lane_segments (2); first lane_segments.12: left_lane_boundary[1].y" in text
    city = city_map()
    city["lane_segments"]["12"]["left_lane_boundary"] = [{"x": 1, "y": 2}] * 2
    assert "lane_segments.12: a line needs" in notes_of(write_log(tmp_path / "b", city=city))
    folder = write_log(tmp_path / "c")
    next((folder / "map").iterdir()).write_text("{")
    assert "is not JSON" in fault_of(folder)


def test_an_annotated_ego_is_nobody_else(tmp_path: Path) -> None:
    rows = boxes()
    rows.append(rows[0] | {"track_uuid": "ego", "category": "EGO_VEHICLE", "tx_m": 0.0})
    scene, recording = read(write_log(tmp_path / "log", box_rows=rows))
    assert len(scene.agents) == 3
    assert len(recording.tracks) == 4
