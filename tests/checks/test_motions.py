"""Motions before the ego comes: hand-computed accelerations, bends, contacts and triggers."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from augment.checks import Finding, FindingKind, Ground, Severity, findings_on
from augment.metrics.fault_guess import FaultClass, first_guess
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent
from augment.scene.planned_motion import (
    AtPlace,
    AtTime,
    LanePath,
    NearEgo,
    PlannedMotion,
    PointPath,
    Trigger,
)
from augment.scene.recording import Recording
from tests.checks.worlds import found_in, of_kind, severities
from tests.scene.test_planned_motion import two_lanes, with_motion
from tests.scenes import pedestrian, scene, vehicle

DOUBTFUL, WRONG = Severity.DOUBTFUL, Severity.WRONG


def car(
    motion: PlannedMotion, *, x_m: float = 30.0, y_m: float = 3.5, speed_mps: float = 8.0
) -> TrafficAgent:
    lane_id = "Lane2" if y_m == 3.5 else "Lane1"
    return with_motion(vehicle("Agent2", x_m, y_m), motion, speed_mps=speed_mps, lane_id=lane_id)


def circle(radius_m: float) -> PointPath:
    """Half a circle to the left from (30, 0)."""
    angles = np.linspace(0.0, math.pi, 61)[1:]
    east, north = 30.0 + radius_m * np.sin(angles), radius_m * (1.0 - np.cos(angles))
    return PointPath(points_m=tuple(zip(east.tolist(), north.tolist(), strict=True)))


def limits(found: Sequence[Finding]) -> list[tuple[Severity, float]]:
    kind = FindingKind.MOTION_LIMITS
    return [(one.severity, next(iter(one.measured.values()))) for one in of_kind(found, kind)]


def test_a_car_brakes_and_speeds_up_as_cars_can() -> None:
    for speeds, said in (
        (((2.0, 0.0),), []),  # 10 m/s in 2 s: 5 m/s^2
        (((10.0 / 8.9, 0.0),), []),
        (((10.0 / 9.1, 0.0),), [(DOUBTFUL, 9.1)]),
        (((1.0, 0.0),), [(WRONG, 10.0)]),
        (((2.0, 19.9),), []),
        (((2.0, 22.0),), [(DOUBTFUL, 6.0)]),
        (((0.0, 5.4), (5.0, 5.4)), [(DOUBTFUL, 9.2)]),  # a jump of 4.6 m/s, over half a second
    ):
        agent = car(PlannedMotion(speeds=speeds, start=AtTime(after_s=1.0)), speed_mps=10.0)
        found = limits(found_in(two_lanes(), agent))
        assert [one for one, _ in found] == [one for one, _ in said]
        assert [mps2 for _, mps2 in found] == pytest.approx([mps2 for _, mps2 in said], abs=0.05)


def test_a_bend_is_as_tight_and_as_fast_as_a_car_can_take_it() -> None:
    for radius_m, speed_mps, said in (
        (5.0, 5.0, []),  # 25 / 5 = 5 m/s^2
        *((5.0, 6.2, [(DOUBTFUL, 38.44 / 5.0)]), (5.0, 8.0, [(WRONG, 12.8)])),
        *((4.0, 2.0, [(DOUBTFUL, 4.0)]), (2.2, 2.0, [(WRONG, 2.2)])),
    ):
        agent = car(PlannedMotion(path=circle(radius_m)), y_m=0.0, speed_mps=speed_mps)
        found = [
            (one.severity, next(iter(one.measured.values())))
            for one in found_in(two_lanes(), agent)
            if one.kind is FindingKind.MOTION_LIMITS
            and "brakes" not in one.template  # at the last point
        ]
        assert [one for one, _ in found] == [one for one, _ in said]
        assert [value for _, value in found] == pytest.approx(
            [value for _, value in said], rel=0.03
        )


def test_stopping_dead_at_the_last_point_is_wrong_for_a_car_and_not_for_a_person() -> None:
    motion = PlannedMotion(path=PointPath(points_m=((40.0, 0.0),)))
    found = limits(found_in(two_lanes(), car(motion, y_m=0.0)))
    assert [one for one, _ in found] == [WRONG]
    assert found[0][1] == pytest.approx(16.0)  # 8 m/s in half a second
    runs = replace(motion, speeds=((0.0, 3.5),))
    walker = with_motion(pedestrian("Agent2", 30.0, -3.0), runs)
    assert severities(found_in(two_lanes(), walker)) == set()
    sprints = with_motion(walker, replace(motion, speeds=((0.0, 7.0),)))
    assert severities(found_in(two_lanes(), sprints)) == {(FindingKind.SPEED, WRONG)}


@pytest.mark.parametrize(
    ("turn_deg", "severity"), [(14.0, None), (16.0, DOUBTFUL), (44.0, DOUBTFUL), (46.0, WRONG)]
)
def test_a_car_does_not_turn_on_the_spot(turn_deg: float, severity: Severity | None) -> None:
    angle = math.radians(turn_deg)
    path = PointPath(points_m=((30.0 + 40.0 * math.cos(angle), 40.0 * math.sin(angle)),))
    stands = car(PlannedMotion(path=path, start=AtTime(after_s=2.0)), y_m=0.0, speed_mps=0.0)
    found = of_kind(found_in(two_lanes(), stands), FindingKind.MOTION_START)
    assert [one.severity for one in found] == ([] if severity is None else [severity])
    person = replace(stands, type=AgentType.PEDESTRIAN, length_m=0.9, width_m=0.8)
    assert of_kind(found_in(two_lanes(), person), FindingKind.MOTION_START) == []


def test_who_stands_in_the_way_before_the_ego_comes_is_run_into() -> None:
    # From 30 m at 12 m/s, 8 m/s with the ego: the rear of a car at 60 m is reached when
    # 30 + 12 t + 4.8 = 60, at 2.1 s, and 10 cm deep at the next step.
    motion, stands = PlannedMotion(path=LanePath(lane_ids=("Lane2",))), vehicle("Agent3", 60, 3.5)
    base = replace(two_lanes(), agents=(stands,))
    found = of_kind(found_in(base, car(motion, speed_mps=12.0)), FindingKind.MOTION_BLOCKED)
    assert [(one.severity, one.agents) for one in found] == [(WRONG, ("Agent2", "Agent3"))]
    assert found[0].measured["after_s"] == pytest.approx(2.2)
    drives = replace(base, agents=(replace(stands, speed_mps=0.6, lane_id="Lane2"),))
    found = of_kind(found_in(drives, car(motion, speed_mps=12.0)), FindingKind.MOTION_BLOCKED)
    assert [one.severity for one in found] == [DOUBTFUL]
    beside = replace(base, agents=(replace(stands, y_m=0.0),))
    assert of_kind(found_in(beside, car(motion)), FindingKind.MOTION_BLOCKED) == []


def test_what_happens_after_the_ego_is_past_depends_on_the_ego() -> None:
    # The ego, at 8 m/s, is beside the car at 4 m/s from 30 m on after 7.5 s, 60 m down the road.
    motion = PlannedMotion(path=LanePath(lane_ids=("Lane2",)))
    for x_m, expected in ((55.0, [WRONG]), (70.0, [])):
        base = replace(two_lanes(), agents=(vehicle("Agent3", x_m, 3.5),))
        found = found_in(base, car(motion, speed_mps=4.0))
        assert [one.severity for one in of_kind(found, FindingKind.MOTION_BLOCKED)] == expected


def test_two_motions_that_meet_are_said_once() -> None:
    one = car(PlannedMotion(path=LanePath(lane_ids=("Lane2",))), speed_mps=10.0)
    other = replace(car(PlannedMotion(), x_m=50.0, speed_mps=2.0), id="Agent3")
    found = of_kind(found_in(two_lanes(), one, other), FindingKind.MOTION_BLOCKED)
    assert [(one.severity, set(one.agents)) for one in found] == [(WRONG, {"Agent2", "Agent3"})]


@pytest.mark.parametrize("across_m", [2.1, 2.5, 3.0])
def test_a_door_may_touch_its_car_and_no_other(across_m: float) -> None:
    """The car is at y = 3.5, its right side at 2.5; the door slides 0.9 m towards the ego."""
    path = PointPath(points_m=((30.0, across_m - 0.9),), keeps_heading=True)
    motion = PlannedMotion(path=path, speeds=((0.5, 1.8), (1.0, 0.0)), start=NearEgo(within_m=15))
    slab = vehicle("Agent2", 30.0, across_m, length_m=1.1, width_m=0.15, motion=motion)
    door = replace(slab, type=AgentType.GENERIC_OBJECT)
    base = replace(two_lanes(), agents=(vehicle("Agent9", 30.0, 3.5),))
    assert severities(found_in(base, door)) == set()
    blocked = replace(base, agents=(*base.agents, vehicle("Agent8", 30.0, across_m - 1.8)))
    kinds = {kind for kind, _ in severities(found_in(blocked, door))}
    assert kinds == {FindingKind.MOTION_BLOCKED}


@pytest.mark.parametrize(("to_y_m", "severity"), [(0.0, None), (-1.1, DOUBTFUL), (-3.5, WRONG)])
def test_a_car_stays_on_the_road(to_y_m: float, severity: Severity | None) -> None:
    """Of its 2 m those below y = -1.75 are off: 0.35 m are 17 %, all 100 %."""
    path = PointPath(points_m=((40.0, 0.0), (60.0, to_y_m), (90.0, to_y_m)))
    found = found_in(scene(), car(PlannedMotion(path=path), y_m=0.0))
    off = of_kind(found, FindingKind.MOTION_OFF_ROAD)
    assert [one.severity for one in off] == ([] if severity is None else [severity])
    assert (FaultClass.POSITION in first_guess(found)) is (severity is not None)


def test_leaving_the_map_is_no_fault_and_a_person_may_cross_the_road() -> None:
    leaves = car(PlannedMotion(path=LanePath(lane_ids=("Lane1",))), y_m=0.0, speed_mps=10.0)
    assert of_kind(found_in(scene(), leaves), FindingKind.MOTION_OFF_ROAD) == []
    path = PointPath(points_m=((30.0, 7.0),))
    crosses = with_motion(
        pedestrian("Agent2", 30.0, -3.0), PlannedMotion(path=path, speeds=((0.5, 2.0),))
    )
    assert severities(found_in(scene(), crosses)) == set()


def recorded(to_x_m: float) -> Recording:
    times_s = np.linspace(0.0, 10.0, 101)
    ego = np.zeros((101, 4))
    ego[:, 0] = np.linspace(0.0, to_x_m, 101)
    return Recording(times_s=times_s, ego=ego)


@pytest.mark.parametrize(
    ("start", "recording", "severity", "seconds"),
    [
        # At 8 m/s sqrt(15^2 - 3.5^2) = 14.586 m before 30 m after 1.93 s, so at 2.0 s.
        (NearEgo(within_m=15.0), None, Severity.FACT, 2.0),
        (NearEgo(within_m=3.0), None, Severity.FACT, 15.0),
        (NearEgo(within_m=3.0), recorded(80.0), DOUBTFUL, 10.0),
        (NearEgo(within_m=15.0), recorded(15.0), DOUBTFUL, 10.0),
        (NearEgo(within_m=15.5), recorded(15.0), Severity.FACT, 10.0),
        (AtPlace(agent_id="Agent9", x_m=0.0, y_m=0.0), None, DOUBTFUL, 15.0),
        (AtTime(after_s=16.0), None, DOUBTFUL, 15.0),
    ],
)
def test_whether_a_trigger_fires(
    start: Trigger, recording: Recording | None, severity: Severity, seconds: float
) -> None:
    base: Scene = replace(two_lanes(), agents=(vehicle("Agent9", -30.0, 3.5),))
    stands = car(PlannedMotion(speeds=((3.0, 5.0),), start=start), speed_mps=0.0)
    ground = Ground.of(base, lambda *_: recording)
    found = of_kind(findings_on(ground, Modification(added=(stands,))), FindingKind.MOTION_TRIGGER)
    assert [one.severity for one in found] == [severity]
    assert next(iter(found[0].measured.values())) == pytest.approx(seconds)


@pytest.mark.parametrize("step_s", [0.02, 0.1])
def test_a_recording_of_a_moment_is_no_reason_to_fail(step_s: float) -> None:
    states = np.array([(0.0, 0.0, 0.0, 8.0), (8.0 * step_s, 0.0, 0.0, 8.0)])
    recording = Recording(times_s=np.array([0.0, step_s]), ego=states)
    brakes = car(PlannedMotion(speeds=((0.05, 0.0),)))
    found = findings_on(
        Ground.of(two_lanes(), lambda *_: recording), Modification(added=(brakes,))
    )
    assert [one.severity for one in of_kind(found, FindingKind.MOTION_LIMITS)] == [WRONG]
