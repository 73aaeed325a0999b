"""Displacement over time, by hand: 61 steps of 0.1 s, t0 and 6 s included."""

from dataclasses import astuple, replace

import numpy as np
import pytest

from augment.checks import Ground
from augment.metrics.displacement import Displacement, OverTime, are_alike, displacement, summarise
from augment.scene.entities import Modification, TrafficAgent
from augment.scene.planned_motion import AtPlace, AtTime, LanePath, NearEgo, PlannedMotion, Trigger
from augment.scene.recording import Recording
from tests.scene.test_planned_motion import two_lanes, with_motion
from tests.scenes import cone, pedestrian, scene, vehicle
from tests.simulation.worlds import track

FIVE_MPS = ((0.0, 5.0), (60.0, 5.0))


def starts(start: Trigger, *more: TrafficAgent) -> Modification:
    """A car that stands at (30, 3.5) and goes on at 5 m/s from its start on."""
    car = replace(vehicle("Agent2", 30.0, 3.5), lane_id="Lane2")
    return Modification(
        added=(
            with_motion(car, PlannedMotion(speeds=FIVE_MPS, start=start), lane_id="Lane2"),
            *more,
        )
    )


def followed(
    generated: Modification, reference: Modification, recording: Recording | None = None
) -> Displacement:
    return displacement(generated, reference, Ground.of(two_lanes(), lambda *_: recording))


def test_two_starts_a_second_apart() -> None:
    # 0 m up to 2 s, 5 (t - 2) up to 3 s, then 5 m: 0.5 (1 + ... + 10) + 30 * 5 over 61 steps.
    (match,) = followed(starts(AtTime(after_s=3.0)), starts(AtTime(after_s=2.0))).matches
    assert match.distance_m == 0.0
    assert match.average_m == pytest.approx((0.5 * 55 + 150.0) / 61)
    assert match.final_m == pytest.approx(5.0)
    assert match.start_s == pytest.approx(1.0)
    (back,) = followed(starts(AtTime(after_s=2.0)), starts(AtTime(after_s=3.0))).matches
    assert (back.average_m, back.start_s) == (match.average_m, -1.0)


def test_a_start_that_never_comes_has_no_difference_but_a_distance() -> None:
    # 5 (t - 2) from 2 s on: 0.5 (1 + ... + 40).
    (match,) = followed(starts(NearEgo(within_m=3.0)), starts(AtTime(after_s=2.0))).matches
    assert match.average_m == pytest.approx(0.5 * 820 / 61)
    assert match.final_m == pytest.approx(20.0)
    assert match.start_s is None


def test_who_has_no_motion_keeps_its_distance_and_all_count_alike() -> None:
    walks = pedestrian("Agent3", 60.0, -5.0, (60.0, 5.0))  # from 1.2 s on, or from 1.4 s on
    reference = starts(AtTime(after_s=2.0), walks)
    found = followed(starts(AtTime(after_s=3.0), replace(walks, x_m=61.0)), reference)
    still = next(match for match in found.matches if match.generated == "Agent3")
    assert (still.distance_m, still.average_m, still.final_m) == (1.0, 1.0, 1.0)
    assert still.start_s is None
    average_m = (0.5 * 55 + 150.0) / 61
    expected = OverTime(
        n=2, at_t0_m=0.5, average_m=(average_m + 1.0) / 2.0, final_m=3.0, start_s=1.0
    )
    summary = summarise([found, Displacement(), displacement(Modification(), reference)])
    for over_time in (found.over_time, summary.over_time):
        assert over_time is not None
        assert astuple(over_time) == pytest.approx(astuple(expected))
    assert summary.box.median_m == pytest.approx(expected.average_m)
    assert found.mean_m == pytest.approx(expected.average_m)
    assert found.error_m == pytest.approx(expected.average_m)


def test_what_does_not_move_has_nothing_over_time() -> None:
    one, other = (Modification(added=(cone("Agent2", x_m, 0.0),)) for x_m in (20.0, 21.0))
    drives = replace(vehicle("Agent2", 30.0, 3.5), speed_mps=5.0, lane_id="Lane2")
    for found in (
        followed(one, other),
        followed(Modification(added=(drives,)), Modification(added=(replace(drives, x_m=31.0),))),
    ):
        assert found.over_time is None
        assert found.errors_m == found.distances_m
    without_ground = displacement(starts(AtTime(after_s=3.0)), starts(AtTime(after_s=2.0)))
    assert without_ground.over_time is None
    unreadable = displacement(None, starts(AtTime()), Ground.of(two_lanes()))
    assert (unreadable.over_time, unreadable.missing) == (None, ("Agent2",))


def test_who_leaves_the_map_is_compared_as_long_as_both_are_there() -> None:
    """From 80 m at 9.5 m/s the lane's end at 100 m comes between 2.1 and 2.2 s."""
    here = replace(vehicle("Agent2", 80.0, 0.0), lane_id="Lane1")
    motion = PlannedMotion(path=LanePath(lane_ids=("Lane1",)), speeds=((0.0, 9.5),))
    leaves = Modification(added=(with_motion(here, motion, lane_id="Lane1"),))
    (match,) = displacement(Modification(added=(here,)), leaves, Ground.of(scene())).matches
    assert match.final_m == pytest.approx(9.5 * 2.1)
    assert match.average_m == pytest.approx(0.95 * sum(range(22)) / 22)


def recorded_at(ego_mps: float) -> Recording:
    """The ego at an even speed for 10 s, and Agent9 who comes to x = 20 m after 4 s."""
    times_s = np.linspace(0.0, 10.0, 101)
    states = np.zeros((2, 101, 4))
    states[:, :, 0] = np.outer([ego_mps, 5.0], times_s)
    other = track(vehicle("Agent9", 0.0, 7.0), states[1] + (0.0, 7.0, 0.0, 5.0))
    return Recording(times_s=times_s, ego=states[0] + (0.0, 0.0, 0.0, ego_mps), tracks=(other,))


@pytest.mark.parametrize(
    ("recording", "start", "begins_s"),
    [
        # 15 m from the centre at (30, 3.5): after 15.414 m, at 8 and at 4 m/s.
        (None, NearEgo(within_m=15.0), 2.0),
        (recorded_at(4.0), NearEgo(within_m=15.0), 3.9),
        (recorded_at(4.0), AtPlace(agent_id="Agent9", x_m=20.0, y_m=7.0, within_m=0.1), 4.0),
    ],
)
def test_ego_and_traffic_are_the_recorded_ones(
    recording: Recording | None, start: Trigger, begins_s: float
) -> None:
    there = replace(vehicle("Agent9", 0.0, 7.0), speed_mps=5.0)
    ground = Ground.of(replace(two_lanes(), agents=(there,)), lambda *_: recording)
    (match,) = displacement(starts(start), starts(AtTime()), ground).matches
    assert match.start_s == pytest.approx(begins_s)


def test_a_start_hangs_on_whomever_somebody_waits_for() -> None:
    # Agent8 is within 2 m of x = 16 m after 14 m at 7 m/s; Agent9 stands until then, then goes
    # 3 m at 5 m/s, to within 2 m of x = 5 m.
    first = replace(vehicle("Agent8", 0.0, 12.0), speed_mps=7.0)
    waits = PlannedMotion(speeds=FIVE_MPS, start=AtPlace(agent_id="Agent8", x_m=16.0, y_m=12.0))
    second = with_motion(vehicle("Agent9", 0.0, 7.0), waits)
    ground = Ground.of(replace(two_lanes(), agents=(first, second)))
    start = AtPlace(agent_id="Agent9", x_m=5.0, y_m=7.0)
    (match,) = displacement(starts(start), starts(AtTime()), ground).matches
    assert match.start_s == pytest.approx(2.6)


def test_other_motions_do_not_look_alike() -> None:
    assert are_alike(starts(AtTime()), starts(AtTime()))
    assert not are_alike(starts(AtTime()), starts(AtTime(after_s=2.0)))
