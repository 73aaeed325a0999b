"""Who moves how: walkers, lane drivers, recorded tracks, and what stands."""

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.checks import Ground
from augment.checks.wish import measure_wish
from augment.scene.entities import (
    InterplanRules,
    Modification,
    SceneOptions,
    TrafficAgent,
    TrafficLight,
)
from augment.scene.intent import Body, Intent, LaneChoice, Length, Spot, VehicleRequest
from augment.scene.motion import find_motion
from augment.scene.planned_motion import PlannedMotion
from augment.scene.recording import Recording
from augment.simulation.expected import expect_recording
from augment.simulation.road import Road
from augment.simulation.states import Objects, start_state
from augment.simulation.traffic import DriveSetting, Traffic
from tests.fixtures.shelf import HARD_SLUGS, MOVING_SLUGS, SLUGS, entry, shown_scene
from tests.scenes import connector, pedestrian, vehicle
from tests.simulation.places import assert_everybody_is_at_one_place, place
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


def by_interplans_rules(given: DriveSetting) -> DriveSetting:
    options = SceneOptions(interplan=InterplanRules())
    return replace(given, scene=replace(given.scene, options=options))


@pytest.mark.parametrize(
    ("x_m", "since", "lasts"), [(30.0, 1, 151), (60.0, 11, 161), (250.0, 201, 301)]
)
def test_by_interplans_rules_a_walk_lasts_longer_the_later_it_begins(
    x_m: float, since: int, lasts: int
) -> None:
    given = with_agents(
        pedestrian("P", x_m, -6.0, (x_m, 6.0)), pedestrian("Q", -55.0, -6.0, (-55.0, 6.0))
    )
    made = after(by_interplans_rules(given), since + 60, ego_speed_mps=10.0)
    first = since if since > 1 else 0
    assert [row.ids.count("P") for row in made[: first + 1]] == [0] * first + [1]
    assert {float(row.speeds_mps.sum()) for row in made} == {0.0}
    assert made[first].boxes[0, 2] == pytest.approx(math.pi / 2.0)
    assert place(made[since], "P") == (x_m, -6.0)
    assert place(made[since + 60], "P") == pytest.approx((x_m, -6.0 + 12.0 * 60 / lasts))
    assert all("Q" not in row.ids for row in made), "it is more than 50 m behind the ego"


@pytest.mark.parametrize("keeps_rule", [False, True])
def test_a_moving_vehicle_keeps_its_lane_and_reacts_to_the_ego(keeps_rule: bool) -> None:
    behind = vehicle("V", -30.0, 0.3, speed_mps=6.0)
    setting = with_agents(behind)
    made = after(by_interplans_rules(setting) if keeps_rule else setting, 150)
    x, y = place(made[-1], "V")
    assert y == pytest.approx(0.0 if keeps_rule else 0.3, abs=1e-6)
    assert -2.588 - 2.4 - 5.0 < x < -2.588 - 2.4


@pytest.mark.parametrize(
    "slug",
    [*MOVING_SLUGS, *(pytest.param(s, marks=pytest.mark.slow) for s in (*SLUGS, *HARD_SLUGS))],
)
def test_everybody_is_at_one_place_in_checks_films_stills_and_drives(slug: str) -> None:
    assert_everybody_is_at_one_place(
        DriveSetting(scene=shown_scene(slug), modification=entry(slug).reference)
    )


@pytest.mark.parametrize("lasts_s", [None, 2.0, 15.0])
@pytest.mark.parametrize("goes_by_interplan", [True, False])
def test_so_it_is_where_others_drive_by_rules_and_where_a_recording_ends_early(
    goes_by_interplan: bool, lasts_s: float | None
) -> None:
    faster = PlannedMotion(speeds=((3.0, 9.0),))
    added = (
        vehicle("New1", 60.0, 0.3, speed_mps=3.0),
        vehicle("New2", 35.0, 0.4, speed_mps=8.0),
        vehicle("New3", 90.0, 0.0),
        pedestrian("New4", 55.0, -6.0, (55.0, 6.0)),
        vehicle("New5", -30.0, 0.0, speed_mps=6.0, motion=faster),
    )
    setting = recorded(modification=Modification(added=added))
    steps = round(10.0 * (lasts_s or 0.0)) + 1
    shorter = Recording(
        times_s=setting.recording.times_s[:steps],
        ego=setting.recording.ego[:steps],
        tracks=tuple(replace(one, states=one.states[:steps]) for one in setting.recording.tracks),
    )
    setting = replace(setting, recording=None if lasts_s is None else shorter)
    assert_everybody_is_at_one_place(
        by_interplans_rules(setting) if goes_by_interplan else setting
    )


@pytest.mark.parametrize(
    ("goes_by_interplan", "least_m", "most_m"), [(True, 2.0, 9.0), (False, 0, 0)]
)
def test_who_is_to_drive_on_is_measured_by_the_rule_of_the_drive(
    goes_by_interplan: bool, least_m: float, most_m: float
) -> None:
    holds = vehicle("New1", 20.0, 0.0, speed_mps=5.0, motion=PlannedMotion())
    setting = with_agents(holds)
    setting = by_interplans_rules(setting) if goes_by_interplan else setting
    spot = Spot(distance=Length(low_m=20.0, high_m=20.0), lane=LaneChoice.OWN)
    asked = VehicleRequest(spot=spot, body=Body.CAR, speed_mps=5.0, count=1)
    ground = Ground.of(setting.scene, expect_recording)
    measured = measure_wish(ground, setting.modification, Intent(requests=(asked,)))
    # From 5 towards 10 m/s at 1 m/s^2: t^2 / 2 at first, 18 m after 6 s, 6 m in the mean.
    assert least_m <= measured.matches[0].distance_m <= most_m


def test_interplans_drivers_stop_at_a_red_light_and_ours_hold_their_speed() -> None:
    plain = street(60.0)
    line, red = [(60.0, 0.0), (200.0, 0.0)], TrafficLight.RED
    crossing = connector("Connector1", "Lane1", None, line, traffic_light=red)
    driver = vehicle("V", 20.0, 0.0, speed_mps=8.0)
    setting = DriveSetting(
        scene=replace(plain, connectors=(crossing,)), modification=Modification(added=(driver,))
    )
    x, _ = place(after(by_interplans_rules(setting), 140)[-1], "V")
    assert 50.0 < x < 60.0 - 2.4
    assert place(after(setting, 140)[-1], "V") == pytest.approx((20.0 + 14.0 * 8.0, 0.0))


def test_a_velocity_is_held_through_who_stands_there() -> None:
    driver = vehicle("V", 20.0, 0.3, speed_mps=8.0)
    made = after(with_agents(driver, vehicle("W", 60.0, 0.0)), 100)
    assert place(made[100], "V") == pytest.approx((100.0, 0.3))


def test_in_interplans_scenarios_a_driver_that_starts_in_somebody_is_dropped() -> None:
    inside = with_agents(vehicle("V", 3.0, 0.0, speed_mps=5.0))
    assert after(by_interplans_rules(inside), 0)[0].ids == ()
    assert after(inside, 0)[0].ids == ("V",)


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


def test_a_recording_with_few_moments_is_read_as_films_read_it() -> None:
    setting = recorded()
    thin = setting.recording
    thin = Recording(
        times_s=thin.times_s[::4],
        ego=thin.ego[::4],
        tracks=tuple(replace(one, states=one.states[::4]) for one in thin.tracks),
    )
    states = find_motion(setting.scene, recording=thin).others[0].states
    made = after(replace(setting, recording=thin), 40)
    for step in range(41):
        assert place(made[step], "Agent2") == pytest.approx(tuple(states[step, :2]))


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
