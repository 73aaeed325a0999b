"""Whole drives: laws that hold for each, the end of the map, and planners of one's own."""

import hashlib
import math
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import CannotDrive
from augment.geometry.frames import Pose
from augment.scene.entities import InterplanRules, Modification, Scene, SceneOptions, TurnType
from augment.scene.lane_graph import LaneGraph
from augment.simulation.drive import ExpertKind, find_expert, run
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PdmClosed
from augment.simulation.planners import planner_named
from augment.simulation.planning import IdmPlanner, Plan, Situation
from augment.simulation.road import Road, find_route
from augment.simulation.score import collisions, progress_ratio, score_drive
from augment.simulation.states import X, Y
from augment.simulation.traffic import DriveSetting
from tests.properties import examples
from tests.recorded import recorded
from tests.scenes import junction, lane, moved_scene, pedestrian, vehicle
from tests.simulation.worlds import ConstantSpeed, recorded_street, street


def bend() -> Scene:
    """A street that bends to the left; the second lane comes towards."""
    angles = np.linspace(0.0, 1.2, 60)
    rim = np.stack([60.0 * np.sin(angles), 60.0 * (1.0 - np.cos(angles))], axis=1)
    line = np.vstack([[[-30.0, 0.0]], rim])
    other = np.vstack([[[-30.0, 3.5]], rim * (56.5 / 60.0) + [0.0, 3.5]])[::-1]
    both = (lane("Lane1", line, speed_limit_mps=10.0), lane("Lane2", other, speed_limit_mps=10.0))
    return replace(street(), lanes=both)


@examples(3)
@given(
    st.floats(-50.0, 50.0),
    st.floats(-50.0, 50.0),
    st.floats(-3.0, 3.0),
    st.sampled_from([1.0, -1.0]),
)
def test_a_moved_or_mirrored_world_gives_the_moved_or_mirrored_drive(
    x_m: float, y_m: float, turn_rad: float, flip: float
) -> None:
    parked = vehicle("A", 22.0, -1.3, 0.1)
    rider = vehicle("B", 30.0, 4.0, math.pi + 0.4, speed_mps=4.0)
    scene = replace(bend(), agents=(parked, rider))
    frame = Pose(x_m=x_m, y_m=y_m, heading_rad=turn_rad)
    here = run(DriveSetting(scene=scene), PdmClosed(), steps=8)
    there = run(DriveSetting(scene=moved_scene(scene, frame, flip)), PdmClosed(), steps=8)
    places = frame.to_parent(here.states[:, [X, Y]] * np.array([1.0, flip]))
    assert there.states[:, [X, Y]] == pytest.approx(places, abs=1e-5)
    assert there.states[:, 3:5] == pytest.approx(here.states[:, 3:5], abs=1e-5)
    assert there.states[:, 5] == pytest.approx(flip * here.states[:, 5], abs=1e-5)


DRIVE = """
import hashlib
from augment.scene.entities import Modification
from augment.simulation.drive import run
from augment.simulation.pdm_closed import PdmClosed
from tests.simulation.test_drive import busy
print(hashlib.sha256(run(busy(), PdmClosed(), steps=8).states.tobytes()).hexdigest())
"""


def busy() -> DriveSetting:
    agents = (
        vehicle("A", 25.0, -1.3),
        vehicle("B", 40.0, 0.0, speed_mps=5.0),
        pedestrian("C", 30.0, -6.0, (30.0, 6.0)),
    )
    return DriveSetting(scene=street(), modification=Modification(added=agents))


def test_another_process_drives_the_same_to_the_last_bit() -> None:
    here = hashlib.sha256(run(busy(), PdmClosed(), steps=8).states.tobytes()).hexdigest()
    there = subprocess.run(
        [sys.executable, "-c", DRIVE],
        check=True,
        capture_output=True,
        text=True,
        env={
            "PYTHONHASHSEED": "77",
            "PATH": "",
            "DJANGO_SETTINGS_MODULE": "arena.config.settings",
        },
    )
    assert there.stdout.strip() == here


def test_the_drive_ends_where_the_map_does_and_nobody_brakes_for_it() -> None:
    setting = DriveSetting(scene=street(40.0, speed_mps=10.0))
    drive = run(setting, IdmPlanner(target_mps=None), steps=100)
    assert drive.at_map_end
    assert drive.boxes[-1, 0] + 2.588 == pytest.approx(40.0, abs=1.0)
    assert drive.states[:, 3].min() > 9.5
    expert = find_expert(setting, drive.road)
    assert score_drive(drive, expert).value == pytest.approx(1.0)


def test_the_expert_is_an_idm_drive_without_the_change() -> None:
    blocked = DriveSetting(
        scene=street(), modification=Modification(added=(vehicle("A", 20.0, 0.0),))
    )
    expert = find_expert(blocked, Road(street()), steps=50)
    assert expert.kind is ExpertKind.IDM
    assert 40.0 < expert.progress_m < 50.0


def test_an_ego_off_every_lane_can_not_be_driven() -> None:
    lost = replace(street(), ego=replace(street().ego, y_m=-30.0))
    with pytest.raises(CannotDrive, match="no lane"):
        run(DriveSetting(scene=lost), ConstantSpeed(8.0))


class InPlace(ConstantSpeed):
    """Computes in the ego's frame without a copy, all plans in one array."""

    poses = np.empty((41, 3))

    def plan(self, situation: Situation) -> Plan:
        self.poses[:] = super().plan(situation).poses
        situation.objects.boxes[:, :2] -= situation.ego[:2]
        situation.ego[:] = 0.0
        return Plan(poses=self.poses)


class Exits(ConstantSpeed):
    code: str | int = "no way out"

    def plan(self, situation: Situation) -> Plan:
        sys.exit(self.code)


def test_a_planner_that_computes_in_place_drives_as_with_copies() -> None:
    drives = [run(busy(), planner(8.0), steps=8) for planner in (ConstantSpeed, InPlace)]
    assert (drives[0].states == drives[1].states).all()
    assert (drives[0].objects[4].boxes == drives[1].objects[4].boxes).all()
    assert (drives[0].plans[2].poses == drives[1].plans[2].poses).all()


def test_a_planner_that_exits_fails_the_drive_and_not_the_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(CannotDrive, match="no way out"):
        run(busy(), Exits(8.0))
    monkeypatch.setattr(Exits, "code", -241)  # of a worker that is told to end
    with pytest.raises(SystemExit):
        run(busy(), Exits(8.0))
    (tmp_path / "planner_of_one.py").write_text("if True\n")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(CannotDrive, match="SyntaxError: expected ':'"):
        planner_named("planner_of_one.Mine", allowed=["planner_of_one.Mine"])


def test_a_drive_takes_the_way_to_the_goal_where_there_is_one() -> None:
    for goal, goal_m, route in (
        (None, None, ("Lane1", "Connector1", "Lane2")),
        (TurnType.STRAIGHT, None, ("Lane1", "Connector1", "Lane2")),
        (TurnType.LEFT, None, ("Lane1", "Connector2", "Lane3")),
        (TurnType.LEFT, (27.0, 40.0), ("Lane1", "Connector2", "Lane3")),
        (TurnType.STRAIGHT, (27.0, 40.0), ("Lane1", "Connector2", "Lane3")),
        (TurnType.RIGHT, None, ("Lane1", "Connector1", "Lane2")),
    ):
        scene = replace(junction(), options=SceneOptions(goal=goal, goal_m=goal_m))
        assert find_route(scene, LaneGraph(scene), None) == route


@pytest.mark.slow
def test_half_the_experts_speed_scores_alike_however_long_was_recorded() -> None:
    road = Road(*recorded_street())
    ratios, scores = [], []
    for length_s in (3.0, 6.0, 8.0, 15.0):
        scene, recording = recorded_street(length_s)
        setting = DriveSetting(scene=scene, recording=recording)
        expert = find_expert(setting, road)
        assert expert.progress_m == pytest.approx(120.0)
        drive = run(setting, ConstantSpeed(4.0), road=road)
        assert drive.outlasts_recording == (length_s < 15.0)
        ratios.append(progress_ratio(drive, expert))
        scores.append(score_drive(drive, expert).value)
    assert ratios == pytest.approx([ratios[-1]] * 4, abs=1e-6)
    assert 0.5 < ratios[-1] < 0.55
    assert scores == pytest.approx([scores[-1]] * 4)


def test_by_interplans_rules_a_drive_lasts_30_s_or_until_the_recorded_ego_s_rear_axle() -> None:
    scene, recording = recorded_street(30.0)
    by_rules = replace(scene, options=SceneOptions(interplan=InterplanRules()))
    lasts_s = {}
    cases = (("as ever", scene, 4.0), ("slow", by_rules, 4.0), ("fast", by_rules, 12.0))
    for name, before, speed_mps in cases:
        setting = DriveSetting(scene=before, recording=recording.ego_alone)
        drive = run(setting, ConstantSpeed(speed_mps))
        lasts_s[name] = drive.duration_s
        duration_s = 15.0 if before is scene else 30.0
        assert find_expert(setting, drive.road).progress_m == pytest.approx(8.0 * duration_s)
    assert (lasts_s["as ever"], lasts_s["slow"]) == pytest.approx((15.0, 30.0))
    # Its centre reaches 240 m less 1.461 m and 0.1 m, at 12 m/s after it got there from 8 m/s.
    assert drive.boxes[-2, 0] < 240.0 - 1.561 < drive.boxes[-1, 0]


@pytest.mark.parametrize("reactive", [False, True])
def test_who_stands_stays_and_who_moves_goes_on_along_its_lane(reactive: bool) -> None:
    scene, recording = recorded_street(3.0)
    setting = DriveSetting(scene=scene, recording=recording, reactive=reactive)
    drive = run(setting, ConstantSpeed(4.0))
    before, last = drive.objects[30], drive.objects[-1]
    assert set(last.ids) == set(before.ids) == {"Agent2", "Agent3"}
    parked, ahead = (last.boxes[last.ids.index(name)] for name in ("Agent3", "Agent2"))
    assert parked[:2].tolist() == [60.0, -3.2]
    assert ahead[0] > 40.0 + 8.0 * 15.0 - 1.0, "it goes on at its speed or the limit"
    steps = [row.boxes[row.ids.index("Agent2"), 0] for row in drive.objects]
    assert ((np.diff(steps) > 0.0) & (np.diff(steps) < 1.1)).all(), "without a jump"


def test_a_recording_of_one_moment_measures_by_an_idm_drive() -> None:
    scene, recording = recorded_street(0.0)
    setting = DriveSetting(scene=scene, recording=recording)
    expert = find_expert(setting, Road(scene))
    assert expert.kind is ExpertKind.IDM
    assert len(run(setting, ConstantSpeed(4.0), steps=5).objects[-1]) == 2


def test_an_expert_who_stops_or_meets_the_end_of_the_map_goes_no_further() -> None:
    scene, recording = recorded_street(6.0)
    stopped = recording.ego.copy()
    stopped[20:] = stopped[20]
    setting = DriveSetting(scene=scene, recording=replace(recording, ego=stopped))
    assert find_expert(setting, Road(scene)).progress_m == pytest.approx(16.0)
    short = replace(scene, lanes=tuple(replace(lane) for lane in scene.lanes))
    road = Road(short)
    road.end_m = float(road.centreline.beside(np.array([[50.0, 0.0]]))[0][0])
    setting = DriveSetting(scene=short, recording=recording)
    assert find_expert(setting, road).progress_m < 50.0


@pytest.mark.realdata
def test_a_recorded_scene_is_driven_with_replayed_and_reactive_traffic(realdata: Path) -> None:
    scene, recording = recorded(realdata)
    road = Road(scene, recording)
    setting = DriveSetting(scene=scene, recording=recording)
    # The recorded ego turns left after 65 m; the straightest route would go on.
    ends = recording.ego[~np.isnan(recording.ego).any(axis=1)][[-1], :2]
    assert abs(road.centreline.beside(ends)[1][0]) < 2.0
    expert = find_expert(setting, road)
    assert expert.kind is ExpertKind.RECORDED
    assert 60.0 < expert.progress_m < 80.0
    replayed, reactive = (
        run(one, PdmClosed(ORIGINAL_OFFSETS_M), road=road, steps=15)
        for one in (setting, replace(setting, reactive=True))
    )
    names = [set(drive.objects[-1].ids) for drive in (replayed, reactive)]
    assert names[1] < names[0], "who comes into sight later stays away from a reactive drive"
    assert not collisions(replayed)


@pytest.mark.realdata
def test_a_car_parked_in_the_ego_s_lane_changes_the_drive(realdata: Path) -> None:
    scene, recording = recorded(realdata)
    road = Road(scene, recording)
    start_m = float(road.centreline.beside(np.zeros((1, 2)))[0][0])
    pose = road.centreline.poses(np.array([start_m + 30.0]))[0].tolist()
    parked = vehicle("Added1", *pose)
    setting = DriveSetting(
        scene=scene, recording=recording, modification=Modification(added=(parked,))
    )
    drive = run(setting, PdmClosed(), road=road, steps=25)
    beside = np.abs(road.centreline.beside(drive.boxes[:, :2])[1])
    assert beside.max() > 0.8, "it goes to the side"
    assert not collisions(drive)
