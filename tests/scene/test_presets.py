"""Critical motions by name: hand-computed places, times and refusals."""

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.errors import CannotPlace
from augment.geometry.frames import overlap
from augment.geometry.polyline import Polyline
from augment.scene import entities
from augment.scene.motion import Movement, find_motion
from augment.scene.planned_motion import (
    AtPlace,
    AtTime,
    LanePath,
    MotionPreset,
    NearEgo,
    PointPath,
)
from augment.scene.presets import PresetNumbers, with_preset
from tests.scenes import connector, curve, lane, lanes, pedestrian, scene, vehicle


def crossing(light: entities.TrafficLight = entities.TrafficLight.RED) -> entities.Scene:
    """A way from the right that crosses the ego's at x = 40 m, and turns into nothing else."""
    arms = lane("Lane8", [(40, -60), (40, -10)]), lane("Lane9", [(40, 10), (40, 60)])
    line = [(40, -10), (40, 10)]
    way = connector("Connector1", "Lane8", "Lane9", line, traffic_light=light)
    return scene(lanes=(*lanes(0.0), *arms), connectors=(way,))


def bend() -> entities.Scene:
    """The ego's lane turns left on 40 m round (10, 40) and goes straight on from (50, 40)."""
    (bent,) = curve(40.0).lanes
    line = Polyline(np.vstack([bent.centerline.points_m, [(50.0, 140.0)]]))
    return scene(lanes=(replace(bent, centerline=line),), areas=())


def car(
    x_m: float, y_m: float, *, speed_mps: float = 0.0, heading_rad: float = 0.0
) -> entities.TrafficAgent:
    return vehicle("Agent2", x_m, y_m, heading_rad, speed_mps=speed_mps)


def driven(base: entities.Scene, agent: entities.TrafficAgent) -> Movement:
    return find_motion(replace(base, agents=(agent,))).others[0]


def test_a_cut_in_takes_its_time_and_ends_in_the_egos_lane() -> None:
    base = scene(lanes=lanes(0.0, 3.5))
    numbers = PresetNumbers(start=NearEgo(within_m=12.0), speed_mps=4.0, duration_s=5.0)
    agent = with_preset(MotionPreset.CUT_IN, base, car(20.0, 3.5, speed_mps=6.0), numbers)
    # 5 s at 5 m/s in the mean.
    assert agent.motion.path == LanePath(lane_ids=("Lane2", "Lane1"), change_m=25.0)
    assert agent.motion.speeds == ((0.67, 4.0),)
    # 8 t is within sqrt(12^2 - 3.5^2) = 11.478 m of 20 + 6 t from 4.261 s on.
    moved = driven(base, agent)
    assert moved.started_s == pytest.approx(4.3)
    assert moved.states[-1, 1:].tolist() == pytest.approx([0.0, 0.0, 4.0])


def test_a_leader_brakes_as_hard_as_asked() -> None:
    numbers = PresetNumbers(start=AtTime(after_s=2.0), braking_mps2=6.0)
    leader = car(20.0, 0.0, speed_mps=9.0)
    agent = with_preset(MotionPreset.HARD_BRAKING, scene(), leader, numbers)
    # It brakes from 2 s to 3.5 s over 9 * 1.5 / 2 = 6.75 m, after 18 m.
    states = driven(scene(), agent).states
    assert states[-1, [0, 3]].tolist() == pytest.approx([44.75, 0.0])
    assert states[35, 3] == pytest.approx(0.0, abs=1e-9)
    assert states[34, 3] == pytest.approx(0.6)


def test_a_pedestrian_who_starts_late_waits_and_crosses_both_lanes() -> None:
    walker = pedestrian("Agent2", 40.0, -3.0, (40.0, 9.0), speed_mps=1.0)
    agent = with_preset(MotionPreset.LATE_PEDESTRIAN, scene(), walker)
    assert agent.walk_to_m is None
    # The oncoming lane ends 5.25 m left of the ego's centreline; a metre on is the kerb.
    assert agent.motion.path == PointPath(points_m=((40.0, 6.25),))
    moved = driven(scene(), agent)
    # 20 m from the ego at 8 t: 40 - sqrt(400 - 9) = 20.226 m, at 2.53 s.
    assert moved.started_s == pytest.approx(2.6)
    assert moved.states[:27, 1] == pytest.approx(-3.0)
    # Half a second to 2 m/s is 0.5 m; 8.75 m more take 4.375 s.
    assert moved.states[26 + 48, 1] < 6.25
    assert moved.states[26 + 49, 1] == pytest.approx(6.25)


@pytest.mark.parametrize("heading_rad", [0.0, math.pi])
def test_a_door_slides_out_towards_the_ego_and_stays_shut_before(heading_rad: float) -> None:
    parked = car(30.0, -3.0, heading_rad=heading_rad)
    door = with_preset(MotionPreset.DOOR_OPENING, scene(), parked)
    assert (door.id, door.type) == ("", entities.AgentType.GENERIC_OBJECT)
    assert overlap(door.box, parked.box).depth_m == 0.0
    moved = driven(scene(), replace(door, id="Agent3"))
    start, end = moved.states[0], moved.states[-1]
    assert start[1] == pytest.approx(-1.875)  # half the car, half the door and 0.05 m
    assert end[:2] - start[:2] == pytest.approx([0.0, 0.9], abs=1e-3)
    assert end[2:].tolist() == pytest.approx([start[2], 0.0])
    # From 30 + 0.3 ahead 15 m away: sqrt(225 - 1.875^2) = 14.882 m before, at 1.93 s, and back.
    assert moved.started_s == pytest.approx(2.0 if heading_rad == 0.0 else 1.9)


def test_a_car_turns_round_to_the_oncoming_lane_where_the_road_is_wide() -> None:
    wide = scene(lanes=lanes(0.0, 3.5, oncoming_m=(7.0, 10.5)), areas=())
    agent = with_preset(MotionPreset.U_TURN, wide, car(30.0, 0.0))
    moved = driven(wide, agent)
    y_m, heading_rad, speed_mps = moved.states[-1, 1:]
    assert (y_m, abs(heading_rad), speed_mps) == pytest.approx((7.0, math.pi, 4.0), abs=1e-6)
    # Half a circle of 4.5 m first: its top is 4.5 m ahead.
    assert moved.states[:, 0].max() == pytest.approx(34.5, abs=0.05)
    # Who drives slows down before: 2 s from 10 to 4 m/s at 3 m/s^2 are 14 m.
    driving = with_preset(MotionPreset.U_TURN, wide, car(30.0, 0.0, speed_mps=10.0))
    assert driven(wide, driving).states[:, 0].max() == pytest.approx(30.0 + 14.0 + 4.5, abs=0.05)
    with pytest.raises(CannotPlace, match=r"a turn of 9\.0 m and the car's width of 2\.0 m"):
        with_preset(MotionPreset.U_TURN, scene(), car(30.0, 0.0))


def test_who_runs_a_red_light_meets_the_ego_in_the_crossing() -> None:
    waiting = replace(car(40.0, -12.0, heading_rad=math.pi / 2.0), lane_id="Lane8")
    agent = with_preset(MotionPreset.RED_LIGHT, crossing(), waiting)
    assert agent.motion.path == LanePath(lane_ids=("Lane8", "Connector1", "Lane9"))
    # 12 m at 3 m/s^2 up to 8 m/s: 2.67 s for 10.68 m, 1.32 m more at 8 m/s; the ego goes 22.4 m.
    assert agent.motion.start == AtPlace(x_m=40.0, y_m=0.0, within_m=22.4)
    both = find_motion(replace(crossing(), agents=(agent,)))
    apart = both.ego.states[:, :2] - both.others[0].states[:, :2]
    assert np.nanmin(np.hypot(*apart.T)) < 1.5
    past = replace(car(40.0, 5.0, heading_rad=math.pi / 2.0), lane_id="Connector1")
    with pytest.raises(CannotPlace, match="crosses the ego's"):
        with_preset(MotionPreset.RED_LIGHT, crossing(), past)
    with pytest.raises(CannotPlace, match="its light at Connector1 is green"):
        with_preset(MotionPreset.RED_LIGHT, crossing(entities.TrafficLight.GREEN), waiting)


def test_a_leader_stops_behind_the_bend() -> None:
    agent = with_preset(MotionPreset.EMERGENCY_STOP, bend(), car(5.0, 0.0, speed_mps=8.0))
    end = driven(bend(), agent).states[-1]
    # The bend ends at y = 40 m; within 15 m less than 5 degrees are left 3.5 m before.
    assert end[[0, 3]].tolist() == pytest.approx([50.0, 0.0], abs=0.05)
    assert 40.0 < end[1] < 43.0
    with pytest.raises(CannotPlace, match="no bend ahead"):
        with_preset(MotionPreset.EMERGENCY_STOP, scene(), car(20.0, 0.0, speed_mps=8.0))


def test_a_parked_car_pulls_out_into_the_egos_lane() -> None:
    agent = with_preset(MotionPreset.PULL_OUT, scene(), car(30.0, -3.0))
    moved = driven(scene(), agent)
    there = moved.states[moved.is_present]
    assert there[-1, 1:].tolist() == pytest.approx([0.0, 0.0, 8.0], abs=1e-6)
    assert np.interp(50.0, there[:, 0], there[:, 1]) == pytest.approx(0.0, abs=1e-3)
    assert np.interp(40.0, there[:, 0], there[:, 1]) == pytest.approx(-1.5, abs=0.02)


def test_a_refusal_says_what_is_missing() -> None:
    for preset, agent, why in (
        (MotionPreset.CUT_IN, car(20.0, 0.0, speed_mps=5.0), "in the ego's lane already"),
        (MotionPreset.CUT_IN, car(20.0, 3.5, speed_mps=5.0), "in the same direction"),
        (MotionPreset.CUT_IN, car(-20.0, 3.5, speed_mps=5.0), "ahead of the ego"),
        (MotionPreset.HARD_BRAKING, car(20.0, 0.0), "it has to drive"),
        (MotionPreset.HARD_BRAKING, car(20.0, 3.5, speed_mps=5.0), "in the ego's lane"),
        (MotionPreset.LATE_PEDESTRIAN, car(20.0, -3.0), "not what a vehicle does"),
        (MotionPreset.LATE_PEDESTRIAN, pedestrian("Agent2", 20.0, 1.0), "beside the ego's lane"),
        (MotionPreset.DOOR_OPENING, car(20.0, -3.0, speed_mps=5.0), "it has to stand"),
        (MotionPreset.DOOR_OPENING, car(20.0, 0.0), "within 8 m"),
        (MotionPreset.RED_LIGHT, car(20.0, 3.5, heading_rad=math.pi), "crosses the ego's"),
        (MotionPreset.PULL_OUT, car(20.0, 0.0), "beside the ego's lane"),
        (MotionPreset.PULL_OUT, car(20.0, -3.0, heading_rad=math.pi), "look along it"),
    ):
        with pytest.raises(CannotPlace, match=f"{preset.label}: .*{why}"):
            with_preset(preset, scene(), agent)


def test_a_motion_that_nobody_could_read_again_is_refused_as_is_a_foreign_number() -> None:
    # From 8 m/s at 0.1 m/s^2: 80 s, and a motion may take 60.
    leader, slowly = car(20.0, 0.0, speed_mps=8.0), PresetNumbers(braking_mps2=0.1)
    with pytest.raises(CannotPlace, match=r"Hard braking: .*speeds.* got 80"):
        with_preset(MotionPreset.HARD_BRAKING, scene(), leader, slowly)
    # Nor is a number that a preset has not.
    brakes = PresetNumbers(braking_mps2=3.0)
    with pytest.raises(CannotPlace, match="braking_mps2 is none of its numbers: speed_mps"):
        with_preset(MotionPreset.PULL_OUT, scene(), car(30.0, -3.0), brakes)
