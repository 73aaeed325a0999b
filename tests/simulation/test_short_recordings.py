"""A recording that ends before the drive: the others go on, and so does the expert."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from augment.simulation.drive import ExpertKind, expert_of, run
from augment.simulation.metrics import progress_ratio
from augment.simulation.road import Road
from augment.simulation.traffic import DriveSetting
from bench.recording_lengths import (
    LENGTHS_S,
    ConstantSpeed,
    cut,
    half_speed_drives,
    recorded_street,
)


def test_half_the_experts_speed_scores_alike_however_long_was_recorded() -> None:
    drives = list(half_speed_drives(*recorded_street()))
    assert [one.recorded_s for one in drives] == list(LENGTHS_S)
    assert [one.expert.progress_m for one in drives] == pytest.approx([120.0] * len(drives))
    ratios = [progress_ratio(one.drive, one.expert) for one in drives]
    assert ratios == pytest.approx([ratios[-1]] * len(drives), abs=1e-6)
    assert 0.5 < ratios[-1] < 0.55
    assert [one.score for one in drives] == pytest.approx([drives[-1].score] * len(drives))
    assert [one.drive.outlasts_recording for one in drives] == [True, True, True, False]


@pytest.mark.parametrize("reactive", [False, True])
def test_who_stands_stays_and_who_moves_goes_on_along_its_lane(reactive: bool) -> None:
    scene, recording = recorded_street()
    setting = DriveSetting(scene=scene, recording=cut(recording, 3.0), reactive=reactive)
    drive = run(setting, ConstantSpeed(4.0))
    before, last = drive.objects[30], drive.objects[-1]
    assert set(last.ids) == set(before.ids) == {"Agent2", "Agent3"}
    parked, ahead = (last.boxes[last.ids.index(name)] for name in ("Agent3", "Agent2"))
    assert parked[:2].tolist() == [60.0, -3.2]
    assert ahead[0] > 40.0 + 8.0 * 15.0 - 1.0, "it goes on at its speed or the limit"
    steps = [row.boxes[row.ids.index("Agent2"), 0] for row in drive.objects]
    assert ((np.diff(steps) > 0.0) & (np.diff(steps) < 1.1)).all(), "without a jump"


def test_a_parked_cars_noise_is_no_motion() -> None:
    scene, recording = recorded_street()
    recording.tracks[1].states[:, 3] = 0.05
    drive = run(DriveSetting(scene=scene, recording=cut(recording, 3.0)), ConstantSpeed(4.0))
    last = drive.objects[-1]
    assert last.boxes[last.ids.index("Agent3"), 0] == 60.0
    assert last.speeds_mps[last.ids.index("Agent3")] == 0.0


def test_a_recording_of_one_moment_measures_by_an_idm_drive() -> None:
    scene, recording = recorded_street()
    setting = DriveSetting(scene=scene, recording=cut(recording, 0.0))
    expert = expert_of(setting, Road(scene))
    assert expert.kind is ExpertKind.IDM
    assert len(run(setting, ConstantSpeed(4.0), steps=5).objects[-1]) == 2


def test_an_expert_who_stops_or_meets_the_end_of_the_map_goes_no_further() -> None:
    scene, recording = recorded_street()
    stopped = recording.ego.copy()
    stopped[20:] = stopped[20]
    setting = DriveSetting(scene=scene, recording=cut(replace(recording, ego=stopped), 6.0))
    assert expert_of(setting, Road(scene)).progress_m == pytest.approx(16.0)
    short = replace(scene, lanes=tuple(replace(lane) for lane in scene.lanes))
    road = Road(short)
    road.end_m = float(road.centreline.beside(np.array([[50.0, 0.0]]))[0][0])
    setting = DriveSetting(scene=short, recording=cut(recording, 3.0))
    assert expert_of(setting, road).progress_m < 50.0
