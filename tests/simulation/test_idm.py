"""The IDM against nuPlan's own vector and against its steady state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.simulation.pdm_closed import PROPOSAL_IDM
from augment.simulation.planners import PLANNER_IDM
from augment.simulation.planning import Idm
from augment.simulation.road import Road
from augment.simulation.states import Kind, Objects, join_objects
from augment.simulation.traffic import TRAFFIC_IDM, LaneDrivers
from tests.scenes import vehicle
from tests.simulation.worlds import street


def test_the_published_vector() -> None:
    driver = Idm(
        min_gap_m=2.0,
        headway_s=1.5,
        max_acceleration_mps2=0.73,
        max_deceleration_mps2=1.67,
        exponent=4.0,
    )
    # Ego at 5 m with 3 m/s; the leader's front at 15 m, 5 m long, 2 m/s.
    found = driver.acceleration(np.array(3.0), np.array(30.0), np.array(5.0), np.array(2.0))
    assert found == pytest.approx(-1.073366, abs=1e-6)


def steady_gap_m(driver: Idm, speed_mps: float) -> float:
    """Behind a leader of the same speed where 10 m/s are wished, by the closed form."""
    wished = driver.min_gap_m + driver.headway_s * speed_mps
    return wished / math.sqrt(1.0 - (speed_mps / 10.0) ** driver.exponent)


@pytest.mark.parametrize("driver", [PROPOSAL_IDM, TRAFFIC_IDM, PLANNER_IDM])
@pytest.mark.parametrize("speed", [1.0, 5.0, 9.0])
def test_nothing_changes_at_the_steady_gap(driver: Idm, speed: float) -> None:
    gap = steady_gap_m(driver, speed)
    same = np.array(speed)
    assert driver.acceleration(same, np.array(10.0), np.array(gap), same) == pytest.approx(0.0)


def test_a_free_road_pulls_with_all_that_is_left() -> None:
    free = np.array(np.inf)
    for speed, pull in [(0.0, 1.0), (5.0, 1.0 - 0.5**4), (10.0, 0.0)]:
        found = TRAFFIC_IDM.clipped(np.array(speed), np.array(10.0), free, np.array(0.0))
        assert found == pytest.approx(pull)


def test_a_leader_that_runs_away_does_not_brake_anybody() -> None:
    found = TRAFFIC_IDM.acceleration(np.array(5.0), np.array(1e9), np.array(10.0), np.array(100.0))
    assert found == pytest.approx(1.0 - (1.0 / 10.0) ** 2)


def test_traffic_settles_at_the_steady_gap_and_its_sweep() -> None:
    # A leader that holds 5 m/s; the follower's limit is 10 m/s.
    road = Road(street(3000.0))
    follower = replace(vehicle("Agent2", 0.0, 0.0), speed_mps=5.0)
    drivers = LaneDrivers([follower], road)
    leader_m = 30.0
    for _ in range(700):
        leader = Objects(
            ids=("Agent3",),
            kinds=np.array([Kind.VEHICLE], dtype=np.int64),
            boxes=np.array([[leader_m, 0.0, 0.0, 4.8, 2.0]]),
            speeds_mps=np.array([5.0]),
        )
        drivers.step(join_objects([drivers.objects(), leader]))
        leader_m += 0.5
    gap = leader_m - 2.4 - (drivers.objects().boxes[0, 0] + 2.4)
    # 4.6.5: the gap is measured from the sweep's end, so it grows by the swept way.
    wanted = steady_gap_m(TRAFFIC_IDM, 5.0) + 1.5 * 5.0
    assert gap == pytest.approx(wanted, abs=0.05)
