"""Who is where after t0: what was recorded, walked, held or stood."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from augment.scene.motion import MotionSource, motion_of
from tests.formats.cells import recorded_street
from tests.scenes import curve, junction, pedestrian, scene, vehicle


def test_without_a_recording_people_hold_their_speed_along_the_lane() -> None:
    motion = motion_of(curve())
    assert motion.ego.source is MotionSource.HELD_SPEED
    turned = motion.ego.states[60]  # 48 m on: 10 m straight, then 38 m of a circle of 40 m
    assert turned[2] == pytest.approx(38.0 / 40.0, abs=0.02)
    assert turned[:2] == pytest.approx(
        (10.0 + 40.0 * np.sin(38.0 / 40.0), 40.0 * (1.0 - np.cos(38.0 / 40.0))), abs=0.05
    )


def test_past_the_map_the_ego_stands_and_others_are_gone() -> None:
    ahead = replace(vehicle("Agent2", 60.0, 0.0), speed_mps=10.0, lane_id="Lane2")
    motion = motion_of(replace(junction(), agents=(ahead,)))
    assert motion.others[0].is_present.tolist() == [True] * 41 + [False] * 110
    assert motion.ego.is_present.all()
    assert motion.ego.states[-1, 3] == 0.0


def test_whoever_was_recorded_does_what_was_recorded_unless_moved() -> None:
    before, recording = recorded_street()
    kept = motion_of(before, recording=recording, with_later=True)
    assert [one.agent.id for one in kept.others] == ["Agent2", "Agent3"]
    assert kept.others[0].states[10, 0] == pytest.approx(30.0)
    moved = motion_of(before, recording=recording, replaced=frozenset({"Agent2"}))
    assert [one.source for one in moved.others] == [MotionSource.HELD_SPEED]


def test_uneven_times_are_read_between_two_that_were_recorded() -> None:
    before, recording = recorded_street()
    thin = replace(
        recording,
        times_s=recording.times_s[::2],
        ego=recording.ego[::2],
        tracks=tuple(replace(one, states=one.states[::2]) for one in recording.tracks),
    )
    motion = motion_of(before, recording=thin)
    assert motion.ego.states[:, 0] == pytest.approx(8.0 * motion.times_s)
    assert motion.others[0].is_present.tolist() == [True] * 19 + [False] * 12


def test_a_walk_starts_when_the_ego_is_near_and_ends_where_it_should() -> None:
    near = pedestrian("Agent2", 10.0, -3.0, (10.0, 6.0))
    far = replace(pedestrian("Agent3", 90.0, -3.0, (90.0, 6.0)), speed_mps=1.5)
    motion = motion_of(scene(agents=(near, far)))
    walk = motion.others[0].states
    assert walk[0].tolist()[:2] == [10.0, -3.0]
    assert walk[150, :2] == pytest.approx((10.0, 6.0))
    later = motion.others[1].states
    assert np.flatnonzero(later[:, 3])[0] == 51  # the ego is 40.8 m on, at 8 m/s
    assert later[111, :2] == pytest.approx((90.0, 6.0))
    assert (later[111:, 3] == 0.0).all()


def test_nobody_sets_out_where_the_ego_never_comes() -> None:
    before = replace(scene(), ego=replace(scene().ego, speed_mps=0.0))
    far = pedestrian("Agent3", 90.0, -3.0, (90.0, 6.0))
    assert motion_of(replace(before, agents=(far,))).others[0].stands
