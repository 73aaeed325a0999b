"""Tested against the published schema: nobody may pass on a file of the data set."""

import sqlite3
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from augment.errors import InvalidDocument
from augment.formats.nuplan_log import NuPlan
from augment.formats.nuplan_map import to_utm
from augment.formats.reading import Reading
from augment.scene.codec import scene_to_document
from augment.scene.entities import AgentType, AreaKind, TrafficLight, TrafficSide, TurnType
from tests.formats.nuplan_files import CITIES, token, write_log, write_map

START = token(100).hex()


def read(file: Path, item: str | None = START) -> Reading:
    return NuPlan().read(file, item=item, frame=None, name="made")


def fault_of(file: Path, item: str | None = START) -> str:
    with pytest.raises(InvalidDocument) as caught:
        read(file, item)
    return str(caught.value)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    write_map(tmp_path, "sg-one-north")
    return write_log(tmp_path, "sg-one-north")


def change_base(log: Path, file: str, change: str) -> None:
    (path,) = log.parent.rglob(file)
    with closing(sqlite3.connect(path)) as base:
        base.executescript(change)


# WGS 84's meridian is 4 984 944.378 m long up to 45 degrees; the CN Tower's published place.
def test_the_projection_has_known_values() -> None:
    for zone, longitude, latitude, east, north, within in (
        (31, 3.0, 0.0, 500_000.0, 0.0, 1e-6),
        (31, 3.0, 45.0, 500_000.0, 0.9996 * 4_984_944.378, 1e-3),
        (17, -79.387139, 43.642567, 630_084.0, 4_833_438.0, 2.0),
    ):
        (found,) = to_utm(np.array([[longitude, latitude]]), zone=zone, is_south=False)
        assert found == pytest.approx([east, north], abs=within)


@pytest.mark.parametrize("city", list(CITIES))
def test_every_city_comes_in_its_own_zone(tmp_path: Path, city: str) -> None:
    write_map(tmp_path, city)
    scene = read(write_log(tmp_path, city)).scene
    _, east, north, _ = CITIES[city]
    assert scene.origin.pose.x_m == pytest.approx(east + 1.461)
    assert scene.origin.pose.y_m == pytest.approx(north)
    own = next(lane for lane in scene.lanes if lane.id == scene.ego.lane_id)
    assert own.centerline.points_m[0].tolist() == pytest.approx([-41.461, 0.0], abs=2e-3)
    assert own.width_m == pytest.approx(4.0, abs=2e-3)
    side = TrafficSide.LEFT if city.startswith("sg") else TrafficSide.RIGHT
    assert scene.traffic_side is side


def test_the_ego_is_its_centre_and_boxes_are_theirs(log: Path) -> None:
    scene = read(log).scene
    assert (scene.ego.length_m, scene.ego.width_m, scene.ego.speed_mps) == (5.176, 2.297, 10.0)
    (car,) = scene.agents
    assert (car.x_m, car.y_m, car.speed_mps, car.length_m) == (20.0, 0.0, 5.0, 4.6)
    assert car.lane_id == scene.ego.lane_id
    scene_to_document(scene)


def test_a_box_without_a_size_gets_the_usual_one_and_that_is_said(log: Path) -> None:
    change = "UPDATE lidar_box SET width = 0, length = NULL WHERE hex(track_token) = '{}'"
    change_base(log, "made.db", change.format(token(60).hex().upper()))
    reading = read(log)
    (car,) = reading.scene.agents
    assert (car.length_m, car.width_m) == (4.8, 2.0)
    assert "1 of 2 objects got the usual size of their class." in reading.notes


def test_what_follows_is_recorded_ten_times_a_second(log: Path) -> None:
    recording = read(log).recording
    assert recording.times_s.tolist() == pytest.approx([0.1 * step for step in range(11)])
    assert recording.ego[:, 0].tolist() == pytest.approx([1.0 * step for step in range(11)])
    walker = next(one for one in recording.tracks if one.type == AgentType.PEDESTRIAN)
    assert np.isnan(walker.states[:5]).all()
    assert np.isfinite(walker.states[5:]).all()


def test_lanes_limits_neighbours_and_boundaries_come_from_the_map(log: Path) -> None:
    reading = read(log)
    scene = reading.scene
    own, beside, _ = scene.lanes
    assert [one.speed_limit_mps for one in scene.lanes] == [13.4, None, None]
    assert (own.left_neighbor, beside.right_neighbor) == (beside.id, own.id)
    assert own.left_boundary.points_m[0, 0] < own.left_boundary.points_m[-1, 0]
    assert "1 parts of the map were left out: bicycle lanes." in reading.notes
    assert {area.kind for area in scene.areas} == {AreaKind.INTERSECTION, AreaKind.WALKWAY}


@pytest.mark.parametrize(
    ("item", "state"), [(START, TrafficLight.GREEN), (token(110).hex(), TrafficLight.RED)]
)
def test_a_connector_has_its_ends_and_light(log: Path, item: str, state: TrafficLight) -> None:
    reading = read(log, item)
    scene, tags = reading.scene, "Scenario tags of this moment: high_magnitude_speed."
    assert (tags in reading.notes) == (item != START)
    (connector,) = scene.connectors
    assert connector.traffic_light is state
    assert connector.turn_type is TurnType.STRAIGHT
    ends = [lane.id for lane in scene.lanes if lane.centerline.points_m[0, 0] > 0.0]
    assert (connector.from_lane, connector.to_lane) == (scene.ego.lane_id, ends[0])


def test_what_is_not_there_is_named(log: Path, tmp_path: Path) -> None:
    assert "there is no lidar_pc 00000000000003e7" in fault_of(log, token(999).hex())
    assert "is no token of 16 hex digits" in fault_of(log, "x")
    alone = tmp_path / "alone"
    alone.mkdir()
    moved = write_log(alone, "us-ma-boston")
    assert "has no map of us-ma-boston" in fault_of(moved)


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("made.db", "DROP TABLE track", "no such table: track"),
        ("made.db", "DELETE FROM log", "log: has no row"),
        ("made.db", "DELETE FROM ego_pose", "has no pose for lidar_pc"),
        ("made.db", "UPDATE ego_pose SET x = 'west'", "has no pose for lidar_pc"),
        ("made.db", "UPDATE ego_pose SET qw = 9e999", "has no pose for lidar_pc"),
        ("made.db", "UPDATE lidar_pc SET timestamp = 'noon'", "a whole number, got 'noon'"),
        ("made.db", "UPDATE log SET logfile = CAST(x'80' AS TEXT)", "can't be read as a database"),
        ("made.db", "UPDATE log SET location = '../../etc'", "is no name of a map"),
        ("map.gpkg", "UPDATE meta SET value = 'EPSG:3857'", "is no UTM zone"),
        ("map.gpkg", "UPDATE gpkg_geometry_columns SET srs_id = 3857", "which is not read"),
    ],
)
def test_a_broken_log_or_map_says_the_fault(log: Path, file: str, change: str, said: str) -> None:
    change_base(log, file, change)
    assert said in fault_of(log)


@pytest.mark.parametrize(
    ("file", "change", "said"),
    [
        ("made.db", "UPDATE category SET name = 'tank' WHERE name = 'pedestrian'",
         "unknown 'tank'"),
        ("made.db", "UPDATE lidar_box SET x = 'west' WHERE rowid = 1", "odd number was left out."),
        ("map.gpkg", "UPDATE boundaries SET geom = substr(geom, 1, 30) WHERE fid = 6", "geometry"),
        ("map.gpkg", "UPDATE walkways SET geom = substr(geom, 1, 30)", "walkways (1); first"),
        ("map.gpkg", "UPDATE lanes_polygons SET speed_limit_mps = 'fast'", "speed limits (3)"),
        ("map.gpkg", "UPDATE baseline_paths SET lane_fid = -1.5 WHERE lane_fid = 3",
         "whole number"),
    ],
)  # fmt: skip
def test_a_bad_part_is_left_out_with_a_note(log: Path, file: str, change: str, said: str) -> None:
    change_base(log, file, change)
    assert said in " ".join(read(log, START).notes)
