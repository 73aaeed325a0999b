"""Scenarios go out as OpenSCENARIO with an OpenDRIVE map, and ASAM's own checks find no fault."""

import json
import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from augment.formats.openscenario.writer import REAR_AXLE_SHARE, write
from augment.formats.writing import Cell
from augment.geometry.polyline import Polyline
from augment.scene.codec import scene_from_document
from augment.scene.entities import Lane, Scene
from augment.scene.lane_graph import AnyLane
from tests.formats.cells import OF_EACH_TYPE, cell, crossing, recorded_street
from tests.formats.receivers import told_by
from tests.recorded import recorded
from tests.scenes import curve

SCENES = Path(__file__).parents[2] / "fixtures" / "scenes"
NOT_FOR_US = "check_asam_xodr_junctions_connection_one_link_to_incoming"
"""It holds for versions of OpenDRIVE before 1.7 alone, and says so."""


def files(given: Cell) -> tuple[ET.Element, ET.Element]:
    """The scenario and the map."""
    made = write([given]).files
    return ET.fromstring(made["street--rule.xosc"]), ET.fromstring(made["street--rule.xodr"])


def lines(given: Cell) -> list[str]:
    return [str(loss) for loss in write([given]).losses]


def authored(name: str) -> Scene:
    return scene_from_document(json.loads((SCENES / f"{name}.json").read_text()))


def test_asams_checks_find_no_fault_in_any_file(realdata: Path, tmp_path: Path) -> None:
    log, seen = recorded(realdata)
    before, recording = recorded_street()
    cells = [
        cell(stem="street"),
        cell(crossing(), added=OF_EACH_TYPE, stem="crossing"),
        cell(before, recording=recording, keeps_traffic=True, added=(), stem="recorded"),
        cell(log, recording=seen, keeps_traffic=True, added=(), stem="log"),
        cell(authored("station-cross"), added=(), stem="left-hand"),
        cell(authored("reservoir-road"), added=(), stem="bends"),
    ]
    made = write(cells).files
    for name, content in made.items():
        (tmp_path / name).write_bytes(content)
    told = told_by(*(tmp_path / name for name in made))
    for name, one in zip(made, told, strict=True):
        assert one["issues"] == [], name
        skipped = {check for check, status in one["status"].items() if status != "completed"}
        assert skipped <= {NOT_FOR_US}, name
        assert len(one["status"]) >= 17, name


@pytest.mark.parametrize("before", [curve(), crossing()], ids=["curve", "crossing"])
def test_roads_pass_through_every_point_and_stay_near_the_line(before: Scene) -> None:
    _, road_map = files(cell(before, added=()))
    ways: list[AnyLane] = [*before.lanes, *before.connectors]
    for road, way in zip(road_map.findall("road"), ways, strict=True):
        points = _sampled(road)
        curve_line = Polyline(points)
        for x_m, y_m in way.centerline.points_m:
            assert curve_line.project(x_m, y_m).distance_m < 0.01
        for x_m, y_m in points:
            assert way.centerline.project(float(x_m), float(y_m)).distance_m < 0.05
        assert float(road.attrib["length"]) == pytest.approx(curve_line.length_m, abs=0.01)


def test_a_lane_lies_between_its_own_edges() -> None:
    lane = Lane(
        id="Lane1",
        centerline=Polyline([(0.0, 0.0), (30.0, 0.0), (60.0, 0.0)]),
        width_m=4.2,
        left_boundary=Polyline([(0.0, 2.0), (30.0, 3.0), (60.0, 2.0)]),
        right_boundary=Polyline([(0.0, -2.0), (60.0, -1.0)]),
    )
    _, road_map = files(cell(replace(crossing(), lanes=(lane,), connectors=()), added=()))
    (road,) = road_map.findall("road")
    offsets = [
        (float(one.attrib["s"]), float(one.attrib["a"])) for one in road.findall(".//laneOffset")
    ]
    widths = [
        (float(one.attrib["sOffset"]), float(one.attrib["a"])) for one in road.findall(".//width")
    ]
    # On the left the lane lies left of its inner edge, the right one.
    assert offsets[0] == pytest.approx((0.0, -2.0), abs=0.01)
    assert np.array(widths) == pytest.approx(np.array([(0.0, 4.0), (30.0, 4.5)]), abs=0.01)


def test_a_fork_is_a_junction() -> None:
    _, road_map = files(cell(crossing(), added=()))
    (junction,) = road_map.findall("junction")
    assert [one.attrib["connectingRoad"] for one in junction] == ["4", "5"]
    assert {one.attrib["incomingRoad"] for one in junction} == {"1"}
    for road in road_map.findall("road")[3:]:
        assert road.attrib["junction"] == junction.attrib["id"]


def test_places_are_those_of_the_rear_axle_and_boxes_lie_around_the_centre() -> None:
    scenario, _ = files(cell())
    position = scenario.find(".//Init//Private[@entityRef='Agent2']//WorldPosition")
    centre = scenario.find(".//ScenarioObject[@name='Agent2']//Center")
    assert position is not None
    assert centre is not None
    ahead_m, heading = float(centre.attrib["x"]), float(position.attrib["h"])
    assert ahead_m == pytest.approx(4.8 * REAR_AXLE_SHARE)
    assert heading == pytest.approx(0.1)
    assert float(position.attrib["x"]) + ahead_m * math.cos(heading) == pytest.approx(30.25)
    assert float(position.attrib["y"]) + ahead_m * math.sin(heading) == pytest.approx(0.5)


def test_a_walker_sets_out_when_the_ego_is_near() -> None:
    scenario, _ = files(cell())
    (near,) = scenario.findall(".//RelativeDistanceCondition")
    assert (near.attrib["entityRef"], float(near.attrib["value"])) == ("Agent1", 50.0)
    (walk,) = scenario.findall(".//Trajectory[@name='Agent5 trajectory']")
    vertices = walk.findall(".//Vertex")
    assert [float(one.attrib["time"]) for one in vertices] == pytest.approx([0.0, 15.0])
    last = vertices[-1].find(".//WorldPosition")
    assert last is not None
    assert (float(last.attrib["x"]), float(last.attrib["y"])) == (70.0, 8.0)


def test_recorded_agents_come_drive_and_go() -> None:
    before, recording = recorded_street()
    scenario, _ = files(cell(before, recording=recording, keeps_traffic=True, added=()))
    assert scenario.find(".//Init//Private[@entityRef='Agent3']") is None
    events = {one.attrib["name"]: one for one in scenario.findall(".//Event")}
    assert {"Agent3 comes", "Agent3 goes on", "Agent2 goes on", "Agent2 is gone"} <= set(events)
    vertices = events["Agent2 goes on"].findall(".//Vertex")
    assert [float(one.attrib["time"]) for one in vertices] == pytest.approx(
        [0.1 * step for step in range(20)]
    )
    gone = events["Agent2 is gone"].find(".//SimulationTimeCondition")
    assert gone is not None
    assert float(gone.attrib["value"]) == pytest.approx(2.0)


def test_a_map_that_no_road_can_follow_is_refused() -> None:
    hairpin = Lane(
        id="Lane9", centerline=Polyline([(0.0, 0.0), (40.0, 0.0), (0.0, 0.5)]), width_m=3.5
    )
    bent = cell(replace(crossing(), lanes=(hairpin,), connectors=()), added=(), name="bent")
    bare = cell(replace(crossing(), lanes=(), connectors=()), added=(), name="bare")
    made = write([bent, bare])
    assert made.files == {}
    assert [str(one) for one in made.refused] == [
        "bent: Lane9 turns too sharply between two points for a smooth road",
        "bare: OpenDRIVE needs at least one road, and there is no lane",
    ]


def _sampled(road: ET.Element) -> np.ndarray:
    """The reference line from the file's own numbers, by the standard's formula."""
    found = []
    for geometry in road.findall("planView/geometry"):
        cubic = geometry.find("paramPoly3")
        assert cubic is not None
        at = np.linspace(0.0, 1.0, 50)[:, None] ** np.arange(4)
        u, v = (at @ [float(cubic.attrib[f"{n}{axis}"]) for n in "abcd"] for axis in "UV")
        heading = float(geometry.attrib["hdg"])
        x_m = float(geometry.attrib["x"]) + u * math.cos(heading) - v * math.sin(heading)
        y_m = float(geometry.attrib["y"]) + u * math.sin(heading) + v * math.cos(heading)
        found.append(np.column_stack([x_m, y_m]))
    return np.vstack(found)
