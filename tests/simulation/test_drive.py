"""Whole drives: laws that hold for each, the end of the map, and planners of one's own."""

from __future__ import annotations

import hashlib
import math
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.errors import CannotDrive
from augment.geometry.frames import Pose
from augment.geometry.polyline import Polyline
from augment.scene.entities import Lane, Modification, Scene, TrafficAgent
from augment.simulation.drive import ExpertKind, expert_of, run
from augment.simulation.pdm_closed import PdmClosed
from augment.simulation.planners import IdmPlanner
from augment.simulation.planning import Plan, Situation
from augment.simulation.road import Road
from augment.simulation.score import score_drive
from augment.simulation.states import EgoBody, X, Y
from augment.simulation.traffic import DriveSetting
from tests.properties import examples
from tests.scenes import pedestrian, vehicle
from tests.simulation.worlds import street


def moved(agent: TrafficAgent, frame: Pose, flip: float) -> TrafficAgent:
    """An agent mirrored at the x axis (flip -1) and then moved into the frame."""
    x, y = frame.to_parent(np.array([[agent.x_m, flip * agent.y_m]]))[0]
    heading = flip * agent.heading_rad + frame.heading_rad
    return replace(agent, x_m=float(x), y_m=float(y), heading_rad=heading)


def moved_scene(scene: Scene, frame: Pose, flip: float) -> Scene:
    def line(given: Polyline) -> Polyline:
        return Polyline(frame.to_parent(given.points_m * np.array([1.0, flip])))

    lanes = tuple(replace(lane, centerline=line(lane.centerline)) for lane in scene.lanes)
    return replace(
        scene,
        lanes=lanes,
        ego=moved(scene.ego, frame, flip),
        agents=tuple(moved(agent, frame, flip) for agent in scene.agents),
    )


def bend() -> Scene:
    """A street that bends to the left; the second lane comes towards."""
    angles = np.linspace(0.0, 1.2, 60)
    rim = np.stack([60.0 * np.sin(angles), 60.0 * (1.0 - np.cos(angles))], axis=1)
    line = np.vstack([[[-30.0, 0.0]], rim])
    other = np.vstack([[[-30.0, 3.5]], rim * (56.5 / 60.0) + [0.0, 3.5]])[::-1]
    lanes = (
        Lane(id="Lane1", centerline=Polyline(line), width_m=3.5, speed_limit_mps=10.0),
        Lane(id="Lane2", centerline=Polyline(other), width_m=3.5, speed_limit_mps=10.0),
    )
    return replace(street(), lanes=lanes)


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
    rider = replace(vehicle("B", 30.0, 4.0, math.pi + 0.4), speed_mps=4.0)
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
        replace(vehicle("B", 40.0, 0.0), speed_mps=5.0),
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
    expert = expert_of(setting, drive.road)
    assert score_drive(drive, expert).value == pytest.approx(1.0)


def test_the_expert_is_an_idm_drive_without_the_change() -> None:
    blocked = DriveSetting(
        scene=street(), modification=Modification(added=(vehicle("A", 20.0, 0.0),))
    )
    expert = expert_of(blocked, Road(street()), steps=50)
    assert expert.kind is ExpertKind.IDM
    assert 40.0 < expert.progress_m < 50.0


class Straight:
    """Keeps speed and heading."""

    def start(self, road: Road, body: EgoBody) -> None:
        self.road = road

    def plan(self, situation: Situation) -> Plan:
        x, y, heading, speed = situation.ego[:4]
        way = speed * 0.1 * np.arange(20)
        cos, sin = np.cos(heading), np.sin(heading)
        return Plan(poses=np.stack([x + way * cos, y + way * sin, np.full(20, heading)], axis=1))


def test_a_planner_of_ones_own_is_driven() -> None:
    drive = run(DriveSetting(scene=street()), Straight(), steps=10)
    assert drive.boxes[-1, 0] == pytest.approx(8.0, abs=1e-6)


def test_an_ego_off_every_lane_can_not_be_driven() -> None:
    lost = replace(street(), ego=replace(street().ego, y_m=-30.0))
    with pytest.raises(CannotDrive, match="no lane"):
        run(DriveSetting(scene=lost), Straight())
