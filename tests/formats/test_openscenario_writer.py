"""Scenarios go out as OpenSCENARIO with an OpenDRIVE map, and ASAM's own checks find no fault."""

import math
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from augment.formats.openscenario.writer import REAR_AXLE_SHARE, write
from augment.formats.writing import Cell
from augment.geometry.polyline import Polyline
from augment.scene.entities import AnyLane, Lane, Scene
from augment.scene.planned_motion import (
    AtPlace,
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
)
from augment.scene.recording import Recording
from tests.fixtures.shelf import whole_scene
from tests.formats.cells import OF_EACH_TYPE, cell, crossing, moving, recorded_street
from tests.formats.receivers import told_by
from tests.recorded import recorded
from tests.scene.test_planned_motion import with_motion
from tests.scenes import curve, pedestrian, vehicle

NOT_FOR_US = "check_asam_xodr_junctions_connection_one_link_to_incoming"
"""It holds for versions of OpenDRIVE before 1.7 alone, and says so."""


def files(given: Cell) -> tuple[ET.Element, ET.Element]:
    """The scenario and the map."""
    made = write([given]).files
    return ET.fromstring(made["street--rule.xosc"]), ET.fromstring(made["street--rule.xodr"])


def lines(given: Cell) -> list[str]:
    return [str(loss) for loss in write([given]).losses]


@pytest.mark.slow
def test_asams_checks_find_no_fault_in_any_file(realdata: Path, tmp_path: Path) -> None:
    log, seen = recorded(realdata)
    before, recording = recorded_street()
    cells = [
        cell(stem="street"),
        cell(crossing(), added=OF_EACH_TYPE, stem="crossing"),
        cell(before, recording=recording, keeps_traffic=True, added=(), stem="recorded"),
        cell(log, recording=seen, keeps_traffic=True, added=(), stem="log"),
        scene_of_motions(),
        cell(whole_scene("station-cross"), added=(), stem="left-hand"),
        cell(whole_scene("reservoir-road"), added=(), stem="bends"),
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
    offsets, widths = (
        [(float(one.attrib[at]), float(one.attrib["a"])) for one in road.findall(f".//{kind}")]
        for kind, at in (("laneOffset", "s"), ("width", "sOffset"))
    )
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
    ahead_m, heading = float(centre.attrib["x"]), float(position.attrib["h"])
    assert ahead_m == pytest.approx(4.8 * REAR_AXLE_SHARE)
    assert heading == pytest.approx(0.1)
    assert float(position.attrib["x"]) + ahead_m * math.cos(heading) == pytest.approx(30.25)
    assert float(position.attrib["y"]) + ahead_m * math.sin(heading) == pytest.approx(0.5)


def test_a_walker_sets_out_when_the_ego_is_near() -> None:
    scenario, _ = files(cell())
    (near,) = scenario.findall(".//RelativeDistanceCondition")
    # At 2.6 s the ego is at 20.8, its rear axle 1.461 m behind; the walker is at (70, -4).
    assert near.attrib["entityRef"] == "Agent1"
    assert float(near.attrib["value"]) == pytest.approx(math.hypot(70.0 - 19.339, 4.0), abs=2e-4)
    (walk,) = scenario.findall(".//Trajectory[@name='Agent5 trajectory']")
    ends = {round(float(one.attrib["time"]), 1): pose_of(one)[:2] for one in walk.iter("Vertex")}
    assert ends[0.0] == pytest.approx((70.0, -4.0))
    assert ends[15.0] == pytest.approx((70.0, 8.0))


def test_recorded_agents_come_drive_and_go() -> None:
    before, recording = recorded_street()
    scenario, _ = files(cell(before, recording=recording, keeps_traffic=True, added=()))
    assert scenario.find(".//Init//Private[@entityRef='Agent3']") is None
    events = {one.attrib["name"]: one for one in scenario.findall(".//Event")}
    assert {"Agent3 comes", "Agent3 goes on", "Agent2 goes on", "Agent2 is gone"} <= set(events)
    vertices = events["Agent2 goes on"].findall(".//Vertex")
    times_s = [float(one.attrib["time"]) for one in vertices]
    assert times_s == pytest.approx([0.1 * step for step in range(20)])
    gone = events["Agent2 is gone"].find(".//SimulationTimeCondition")
    assert float(gone.attrib["value"]) == pytest.approx(2.0)


def test_a_map_that_no_road_can_follow_is_refused() -> None:
    hairpin = Lane(
        id="Lane9", centerline=Polyline([(0.0, 0.0), (40.0, 0.0), (0.0, 0.5)]), width_m=3.5
    )
    off_lanes = replace(crossing(), ego=replace(crossing().ego, lane_id=None), connectors=())
    bent = cell(replace(off_lanes, lanes=(hairpin,)), added=(), name="bent")
    bare = cell(replace(off_lanes, lanes=()), added=(), name="bare")
    made = write([bent, bare])
    assert made.files == {}
    assert [str(one) for one in made.refused] == [
        "bent: Lane9 turns too sharply between two points for a smooth road",
        "bare: OpenDRIVE needs at least one road, and there is no lane",
    ]


def scene_of_motions() -> Cell:
    """The moving cast, of whom the first sets out at 3.9 s, and who leaves the map or brakes."""
    leaves = PlannedMotion(path=LanePath(lane_ids=("Lane1",)), start=NearEgo(within_m=5.0))
    late = PlannedMotion(start=AtTime(after_s=5.0))
    there, aside = (PointPath(points_m=(end_m,)) for end_m in ((64.0, 1.0), (100.0, 3.5)))
    by_ego = AtPlace(x_m=40.0, y_m=0.0, within_m=3.0)
    steps = PlannedMotion(path=there, speeds=((0.0, 2.0),), start=by_ego)
    turns_out = PlannedMotion(path=aside, speeds=((2.0, 5.0),), start=NearEgo(within_m=25.0))
    brakes = PlannedMotion(speeds=((2.0, 0.0),), start=AtTime(after_s=1.05))
    more = (
        with_motion(vehicle("Agent7", 385.0, 0.0), leaves, speed_mps=9.0, lane_id="Lane1"),
        with_motion(vehicle("Agent8", 399.5, 3.5), late, speed_mps=9.0, lane_id="Lane2"),
        with_motion(pedestrian("Agent9", 64.0, -5.0), steps),
        with_motion(vehicle("Agent11", 90.0, -4.0, 2.0), turns_out),
        with_motion(vehicle("Agent10", -20.0, 3.5), brakes, speed_mps=10.0, lane_id="Lane2"),
    )
    given = moving()
    change = replace(given.modification, added=(*given.modification.added, *more))
    return replace(given, modification=change, stem="street--rule")


@pytest.mark.parametrize("step_s", [0.1, 0.02])
def test_a_player_of_the_file_moves_everybody_as_we_do(step_s: float) -> None:
    given = scene_of_motions()
    scenario, _ = files(given)
    played = Player(scenario)
    began: dict[str, float] = {}
    for now in np.arange(round(15.0 / step_s) + 1) * step_s:
        played.go_on(float(now), began)
        if math.isclose(now, round(now), abs_tol=1e-9):
            for one in given.motion.others:
                state = one.states[round(now / 0.1)]
                there = played.centre(one.agent.id)
                assert (there is None) == bool(np.isnan(state[0])), (one.agent.id, now)
                if there is not None:
                    assert math.dist(there, state[:2]) < 0.1, (one.agent.id, now)
    assert began["Agent2 sets out"] == pytest.approx(3.9)
    assert began["Agent10 sets out"] == pytest.approx(1.05, abs=step_s)
    assert {"Agent5 sets out", "Agent7 sets out", "Agent8 sets out"}.isdisjoint(began)


def test_what_holds_with_our_ego_alone_is_named() -> None:
    said = lines(scene_of_motions())
    text = "its distance is told between rear axles: the same moment with our ego, else up to"
    assert f"moving: Agent2: {text} 2.8 m off" in said
    assert f"moving: Agent3: {text} 1.4 m off" in said
    assert "moving: Agent2: sets out from where it is with our ego; with others it jumps" in said
    assert any(line.startswith("moving: Agent7: the motion is left out: where") for line in said)
    assert not any("Agent10" in line or "too early" in line for line in said)


def test_an_ego_whose_axle_was_nearer_before_starts_a_motion_too_early_and_it_is_named() -> None:
    # Its axle is 1.461 m behind: nearer to who waits at (-30, 4) before the ego turns round.
    rows = [(0.0, 0.0, 0.0, 0.0)] * 10 + [(-0.8 * n, 0.0, math.pi, 8.0) for n in range(21)]
    times_s = np.asarray(np.arange(31) * 0.1, dtype=np.float64)
    turns = Recording(times_s=times_s, ego=np.array(rows))
    motion = PlannedMotion(path=PointPath(points_m=((-30.0, 0.0),)), start=NearEgo(within_m=28.0))
    waits = with_motion(pedestrian("Agent2", -30.0, 4.0), replace(motion, speeds=((0.0, 2.0),)))
    given = cell(added=(waits,), recording=turns)
    (walk,) = given.motion.others
    assert walk.started_s == pytest.approx(1.3)
    assert "street by rule: Agent2: sets out 1.3 s too early" in lines(given)


class Player:
    """Plays a file's events step by step, by the standard and by nothing of ours."""

    def __init__(self, scenario: ET.Element) -> None:
        self.ahead_m = {
            one.attrib["name"]: float(one.find(".//Center").attrib["x"])
            for one in scenario.iter("ScenarioObject")
        }
        self.poses = {
            one.attrib["entityRef"]: pose_of(one)
            for one in scenario.find(".//Init").iter("Private")
        }
        self.waiting = [
            (group.find(".//EntityRef").attrib["entityRef"], event)
            for group in scenario.iter("ManeuverGroup")
            for event in group.iter("Event")
        ]
        self.running: dict[str, tuple[str, float, np.ndarray]] = {}
        self.ended: set[str] = set()

    def centre(self, name: str) -> tuple[float, float] | None:
        if name not in self.poses:
            return None
        x_m, y_m, heading = self.poses[name]
        ahead_m = self.ahead_m[name]
        return x_m + ahead_m * math.cos(heading), y_m + ahead_m * math.sin(heading)

    def go_on(self, now: float, began: dict[str, float]) -> None:
        for who in self.running:
            self._follow(who, now)
        for who, event in [one for one in self.waiting if self._fires(one[1], now)]:
            self.waiting.remove((who, event))
            began[event.attrib["name"]] = now
            self._begin(who, event, now)

    def _begin(self, who: str, event: ET.Element, now: float) -> None:
        if event.find(".//DeleteEntityAction") is not None:
            del self.poses[who]
            self.running.pop(who, None)
        elif (follow := event.find(".//FollowTrajectoryAction")) is not None:
            assert who not in self.running or event.attrib["priority"] == "override"
            rows = [(float(one.attrib["time"]), *pose_of(one)) for one in follow.iter("Vertex")]
            is_relative = follow.find(".//Timing[@domainAbsoluteRelative='relative']") is not None
            self.running[who] = event.attrib["name"], now if is_relative else 0.0, np.array(rows)
            self._follow(who, now)

    def _follow(self, who: str, now: float) -> None:
        name, began, rows = self.running[who]
        at = [float(np.interp(now - began, rows[:, 0], rows[:, column])) for column in (1, 2, 3)]
        self.poses[who] = at[0], at[1], at[2]
        if now - began > rows[-1, 0] + 1e-9:
            self.ended.add(name)

    def _fires(self, event: ET.Element, now: float) -> bool:
        condition = event.find("StartTrigger//Condition")
        groups = [*condition.iter("EntityCondition"), *condition.iter("ByValueCondition")]
        (kind,) = (one for group in groups for one in group)
        if kind.tag == "SimulationTimeCondition":
            return now >= float(kind.attrib["value"]) - 1e-9
        if kind.tag == "StoryboardElementStateCondition":
            assert kind.attrib["state"] == "endTransition"
            return kind.attrib["storyboardElementRef"] in self.ended
        who = condition.find(".//EntityRef").attrib["entityRef"]
        is_place = kind.tag == "DistanceCondition"
        other = pose_of(kind) if is_place else self.poses[kind.attrib["entityRef"]]
        assert (kind.attrib["freespace"], kind.attrib["rule"]) == ("false", "lessOrEqual")
        assert kind.attrib["relativeDistanceType"] == "euclidianDistance"
        return math.dist(self.poses[who][:2], other[:2]) <= float(kind.attrib["value"])


def pose_of(element: ET.Element) -> tuple[float, float, float]:
    """The first position in an element."""
    position = element.find(".//WorldPosition")
    given = position.attrib
    return float(given["x"]), float(given["y"]), float(given.get("h", "0"))


def _sampled(road: ET.Element) -> np.ndarray:
    """The reference line from the file's own numbers, by the standard's formula."""
    found = []
    for geometry in road.findall("planView/geometry"):
        cubic = geometry.find("paramPoly3")
        at = np.linspace(0.0, 1.0, 50)[:, None] ** np.arange(4)
        u, v = (at @ [float(cubic.attrib[f"{n}{axis}"]) for n in "abcd"] for axis in "UV")
        heading = float(geometry.attrib["hdg"])
        x_m = float(geometry.attrib["x"]) + u * math.cos(heading) - v * math.sin(heading)
        y_m = float(geometry.attrib["y"]) + u * math.sin(heading) + v * math.cos(heading)
        found.append(np.column_stack([x_m, y_m]))
    return np.vstack(found)
