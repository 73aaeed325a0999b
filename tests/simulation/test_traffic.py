"""Who moves how: walkers, lane drivers, recorded tracks, and what stands."""

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.scene.entities import (
    InterplanRules,
    LaneConnector,
    Modification,
    SceneOptions,
    TrafficAgent,
    TrafficLight,
)
from augment.scene.motion import find_motion
from augment.scene.planned_motion import NearEgo, PlannedMotion, PointPath
from augment.scene.recording import Recording
from augment.simulation.road import Road
from augment.simulation.states import Objects, start_state
from augment.simulation.traffic import DriveSetting, Traffic
from tests.scenes import pedestrian, vehicle
from tests.simulation.worlds import BODY, street, track


def after(setting: DriveSetting, steps: int, *, ego_speed_mps: float = 0.0) -> list[Objects]:
    """Everybody at each moment, while the ego goes straight at that speed."""
    road = Road(setting.scene, setting.recording)
    ego = start_state(setting.scene.ego, BODY)
    ego[3] = ego_speed_mps
    traffic = Traffic(setting, road, BODY, ego)
    made = [traffic.objects()]
    for _ in range(steps):
        traffic.step(ego, made[-1])
        ego = ego + np.array([ego_speed_mps * 0.1, 0, 0, 0, 0, 0])
        made.append(traffic.objects())
    return made


def with_agents(*agents: TrafficAgent, length_m: float = 400.0) -> DriveSetting:
    return DriveSetting(scene=street(length_m), modification=Modification(added=agents))


def place(objects: Objects, name: str) -> tuple[float, float]:
    x, y = objects.boxes[objects.ids.index(name), :2]
    return float(x), float(y)


def test_a_walker_near_enough_takes_15_s_and_reports_no_speed() -> None:
    made = after(with_agents(pedestrian("P", 30.0, -6.0, (30.0, 6.0))), 150)
    assert place(made[0], "P") == (30.0, -6.0)
    assert place(made[75], "P") == pytest.approx((30.0, 0.0))
    assert place(made[150], "P") == pytest.approx((30.0, 6.0))
    assert {float(row.speeds_mps[0]) for row in made} == {0.0}
    assert made[3].boxes[0, 2] == pytest.approx(math.pi / 2.0)


@pytest.mark.parametrize(("x_m", "since"), [(50.0, 0), (50.2, 1), (60.0, 10)])
def test_a_walker_appears_when_the_ego_is_50_m_before_it(x_m: float, since: int) -> None:
    made = after(
        with_agents(pedestrian("P", x_m, -6.0, (x_m, 6.0))), since + 2, ego_speed_mps=10.0
    )
    seen = ["P" in row.ids for row in made]
    # The ego that a step is made for is the one before it moved.
    first = since if since == 0 else since + 1
    assert seen.index(True) == first


@pytest.mark.parametrize(
    ("x_m", "since", "lasts"), [(30.0, 1, 151), (60.0, 11, 161), (250.0, 201, 301)]
)
def test_by_interplans_rules_a_walk_lasts_longer_the_later_it_begins(
    x_m: float, since: int, lasts: int
) -> None:
    given = with_agents(
        pedestrian("P", x_m, -6.0, (x_m, 6.0)), pedestrian("Q", -55.0, -6.0, (-55.0, 6.0))
    )
    options = SceneOptions(interplan=InterplanRules())
    setting = replace(given, scene=replace(given.scene, options=options))
    made = after(setting, since + 60, ego_speed_mps=10.0)
    assert place(made[since], "P") == (x_m, -6.0)
    assert place(made[since + 60], "P") == pytest.approx((x_m, -6.0 + 12.0 * 60 / lasts))
    assert all("Q" not in row.ids for row in made), "it is more than 50 m behind the ego"


def test_a_moving_vehicle_keeps_its_lane_and_reacts_to_the_ego() -> None:
    behind = replace(vehicle("V", -30.0, 0.3), speed_mps=6.0)
    made = after(with_agents(behind), 150)
    x, y = place(made[-1], "V")
    assert y == pytest.approx(0.0, abs=1e-6)
    assert -2.588 - 2.4 - 5.0 < x < -2.588 - 2.4


def test_a_planned_motion_is_the_same_in_a_drive_as_without_one() -> None:
    # Sets out where the ego is 30 m away, runs 8 m across at 2 m/s.
    motion = PlannedMotion(
        path=PointPath(points_m=((50.0, 4.0),)), speeds=((0.0, 2.0),), start=NearEgo(within_m=30.0)
    )
    runner = replace(pedestrian("P", 50.0, -4.0), motion=motion)
    setting = with_agents(runner)
    moves = find_motion(setting.after)
    driven = after(setting, 80, ego_speed_mps=setting.scene.ego.speed_mps)
    assert moves.others[0].started_s is not None
    for step in range(0, 81, 10):
        assert place(driven[step], "P") == pytest.approx(tuple(moves.others[0].states[step, :2]))


def test_lane_drivers_stop_at_a_red_light() -> None:
    plain = street(60.0)
    crossing = LaneConnector(
        id="Connector1",
        from_lane="Lane1",
        to_lane=None,
        centerline=Polyline([(60.0, 0.0), (200.0, 0.0)]),
        width_m=3.5,
        traffic_light=TrafficLight.RED,
    )
    driver = replace(vehicle("V", 20.0, 0.0), speed_mps=8.0)
    setting = DriveSetting(
        scene=replace(plain, connectors=(crossing,)), modification=Modification(added=(driver,))
    )
    x, _ = place(after(setting, 140)[-1], "V")
    assert 50.0 < x < 60.0 - 2.4


def test_a_driver_that_starts_in_somebody_is_dropped() -> None:
    inside = replace(vehicle("V", 3.0, 0.0), speed_mps=5.0)
    assert after(with_agents(inside), 0)[0].ids == ()


def recorded(reactive: bool = False, modification: Modification | None = None) -> DriveSetting:
    """Agent2 drives ahead at 6 m/s and brakes at once; Agent3 is seen from 1 s to 2 s."""
    times = np.arange(151, dtype=np.float64) * 0.1
    stopping = np.zeros((151, 4))
    stopping[:, 0] = 20.0 + np.minimum(times, 1.0) * 6.0
    stopping[:, 3] = np.where(times < 1.0, 6.0, 0.0)
    passing = np.full((151, 4), np.nan)
    passing[10:21] = [30.0, 3.5, math.pi, 8.0]
    passing[10:21, 0] -= 0.8 * np.arange(11)
    ego = np.zeros((151, 4))
    ego[:, 0] = times * 5.0
    cars = vehicle("Agent2", 20.0, 0.0), vehicle("Agent3", 30.0, 3.5)
    tracks = track(cars[0], stopping), track(cars[1], passing)
    agent = replace(cars[0], speed_mps=6.0)
    return DriveSetting(
        scene=replace(street(), agents=(agent,)),
        modification=modification or Modification(),
        recording=Recording(times_s=times, ego=ego, tracks=tracks),
        reactive=reactive,
    )


def test_a_recording_is_replayed() -> None:
    made = after(recorded(), 40)
    assert place(made[5], "Agent2") == pytest.approx((23.0, 0.0))
    assert place(made[40], "Agent2") == pytest.approx((26.0, 0.0))
    assert ["Agent3" in row.ids for row in made[8:23]] == [False] * 2 + [True] * 11 + [False] * 2


def test_in_a_reactive_drive_recorded_vehicles_follow_their_lanes() -> None:
    made = after(recorded(reactive=True), 40)
    assert place(made[40], "Agent2")[0] > 40.0
    assert not any("Agent3" in row.ids for row in made)


def test_who_was_moved_or_removed_is_not_replayed() -> None:
    moved = Modification(moved=(vehicle("Agent2", 50.0, 0.0),))
    assert place(after(recorded(modification=moved), 20)[20], "Agent2") == (50.0, 0.0)
    assert (
        "Agent2" not in after(recorded(modification=Modification(removed=("Agent2",))), 1)[1].ids
    )


def test_who_has_a_motion_is_not_replayed() -> None:
    setting = recorded()
    (agent,) = setting.scene.agents
    goes_on = replace(agent, motion=PlannedMotion(speeds=((0.0, 6.0),)))
    made = after(replace(setting, scene=replace(setting.scene, agents=(goes_on,))), 40)
    assert place(made[40], "Agent2") == pytest.approx((44.0, 0.0))
