"""The recorded scene: its route is the recorded ego's, its traffic is replayed or answers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from augment.scene.entities import AgentType, Modification, TrafficAgent
from augment.simulation.drive import ExpertKind, expert_of, run
from augment.simulation.metrics import collisions
from augment.simulation.pdm_closed import ORIGINAL_OFFSETS_M, PdmClosed
from augment.simulation.road import Road
from augment.simulation.traffic import DriveSetting
from tests.recorded import recorded

pytestmark = pytest.mark.realdata


def test_the_recorded_scene_is_driven_with_replayed_and_with_reactive_traffic(
    realdata: Path,
) -> None:
    scene, recording = recorded(realdata)
    road = Road(scene, recording)
    setting = DriveSetting(scene=scene, recording=recording)
    # The recorded ego turns left after 65 m; the straightest route would go on.
    ends = recording.ego[~np.isnan(recording.ego).any(axis=1)][[-1], :2]
    assert abs(road.centreline.beside(ends)[1][0]) < 2.0
    expert = expert_of(setting, road)
    assert expert.kind is ExpertKind.RECORDED
    assert 60.0 < expert.progress_m < 80.0
    replayed, reactive = (
        run(one, PdmClosed(ORIGINAL_OFFSETS_M), road=road, steps=15)
        for one in (setting, replace(setting, reactive=True))
    )
    names = [set(drive.objects[-1].ids) for drive in (replayed, reactive)]
    assert names[1] < names[0], "who comes into sight later stays away from a reactive drive"
    assert not collisions(replayed)


def test_a_car_parked_in_the_ego_s_lane_changes_the_drive(realdata: Path) -> None:
    scene, recording = recorded(realdata)
    road = Road(scene, recording)
    start_m = float(road.centreline.beside(np.zeros((1, 2)))[0][0])
    x_m, y_m, heading_rad = (
        float(v) for v in road.centreline.poses(np.array([start_m + 30.0]))[0]
    )
    parked = TrafficAgent(
        id="Added1", type=AgentType.VEHICLE, x_m=x_m, y_m=y_m, heading_rad=heading_rad,
        width_m=2.0, length_m=4.8,
    )  # fmt: skip
    setting = DriveSetting(
        scene=scene, recording=recording, modification=Modification(added=(parked,))
    )
    drive = run(setting, PdmClosed(), road=road, steps=25)
    beside = np.abs(road.centreline.beside(drive.boxes[:, :2])[1])
    assert beside.max() > 0.8, "it goes to the side"
    assert not collisions(drive)
