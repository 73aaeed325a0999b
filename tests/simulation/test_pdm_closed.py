"""PDM-Closed: what it proposes, how it judges, when it brakes."""

import math
import re
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from augment.scene.entities import (
    Area,
    AreaKind,
    InterplanRules,
    Modification,
    SceneOptions,
    TrafficAgent,
    without_traffic,
)
from augment.simulation.drive import Drive, run
from augment.simulation.pdm_closed import (
    ORIGINAL_OFFSETS_M,
    PAPER_OFFSETS_M,
    PROPOSAL_IDM,
    PdmClosed,
    ProposalScores,
    brake,
    must_brake,
    score_proposals,
)
from augment.simulation.planners import planner_named
from augment.simulation.planning import PLANNER_IDM, Idm, Plan, Situation, foresee
from augment.simulation.road import Road
from augment.simulation.states import FloatArray, Objects, join_objects, start_state, to_objects
from augment.simulation.traffic import TRAFFIC_IDM, DriveSetting, LaneDrivers
from tests.fixtures.shelf import entry, shown_scene
from tests.house.source import ROOT
from tests.scenes import cone, pedestrian, vehicle
from tests.simulation.worlds import BODY, states_along, street


def planner(**options: object) -> PdmClosed:
    made = PdmClosed(**options)  # type: ignore[arg-type]
    made.start(Road(street()), BODY)
    return made


def planned(agents: list[TrafficAgent], *, speed_mps: float = 8.0, **options: object) -> Plan:
    ego = start_state(street(speed_mps=speed_mps).ego, BODY)
    situation = Situation(step=0, ego=ego, objects=to_objects(agents))
    return planner(**options).plan(situation)


def judged_among(states: FloatArray, objects: Objects, road: Road | None = None) -> ProposalScores:
    return score_proposals(states, foresee(objects, 8.0), road or Road(street()), BODY)


def test_fifteen_proposals_by_default_of_the_release_and_45_of_the_paper() -> None:
    for offsets, count in [(ORIGINAL_OFFSETS_M, 15), (None, 45)]:
        plan = planned([]) if offsets is None else planned([], offsets_m=offsets)
        assert plan.proposals.states.shape == (count, 41, 6)
        assert plan.poses.shape == (81, 3)


def test_it_starts_where_the_rear_axle_is_and_accelerates_by_the_idm() -> None:
    # Exponent 10, target 10 m/s: 1.5 (1 - 0.8^10) in the first step.
    plan = planned([])
    steps = np.diff(plan.poses[:, 0])
    assert plan.poses[:, 1] == pytest.approx(np.zeros(81), abs=1e-9)
    assert plan.poses[0, 0] == pytest.approx(-BODY.centre_m)
    assert steps[0] == pytest.approx(0.8)
    assert steps[1] - steps[0] == pytest.approx(
        0.01 * 1.5 * (1.0 - 0.8**10), rel=0.01
    )  # something stands at the far end of the path


def test_collisions_multiply() -> None:
    for what, agents, collision in (
        ("nobody", [], 1.0),
        ("a parked car", [vehicle("A", 20.0, 0.0)], 0.0),
        ("a person", [pedestrian("A", 20.0, 0.0)], 0.0),
        ("a cone", [cone("A", 20.0, 0.0)], 0.5),
        ("a car from behind", [vehicle("A", -10.0, 0.0, speed_mps=12.0)], 1.0),
    ):
        judged = judged_among(states_along(np.full(41, 8.0))[None], to_objects(agents))
        assert judged.parts["collision"].tolist() == [collision], what


def test_no_corner_leaves_the_road_and_the_centre_stays_on_the_route() -> None:
    for y_m, speed, drivable, direction in (
        (0.0, 8.0, 1.0, 1.0),
        (-0.59, 8.0, 1.0, 1.0),
        (-0.61, 8.0, 0.0, 1.0),
        # Up to 2 m the wrong way in 4 s are free, up to 6 m half.
        *((3.5, 0.49, 1.0, 1.0), (3.5, 0.51, 1.0, 0.5)),
        *((3.5, 1.49, 1.0, 0.5), (3.5, 1.51, 1.0, 0.0)),
    ):
        judged = judged_among(states_along(np.full(41, speed), y_m=y_m)[None], to_objects([]))
        assert judged.parts["drivable"].tolist() == [drivable]
        assert judged.parts["direction"].tolist() == [direction]


def test_waiting_scores_more_than_overtaking_on_the_oncoming_lane() -> None:
    # At best half of everything against no progress, but time to collision and comfort in full.
    states = np.stack([states_along(np.zeros(41)), states_along(np.full(41, 1.2), y_m=3.5)])
    judged = judged_among(states, to_objects([vehicle("A", 12.0, 0.0)]))
    assert judged.scores == pytest.approx([7.0 / 12.0, 0.5])


def test_progress_is_a_share_of_the_best_valid_one() -> None:
    states = np.stack([states_along(np.full(41, speed)) for speed in (2.0, 4.0, 8.0)])
    parked = to_objects([vehicle("A", 30.0, 0.0)])  # 32 m are too far
    judged = judged_among(states, parked)
    assert judged.parts["collision"].tolist() == [1.0, 1.0, 0.0]
    assert judged.parts["progress"].tolist() == pytest.approx([0.5, 1.0, 0.0])


@pytest.mark.parametrize(("gap_m", "ttc"), [(0.9 * 5.0 + 0.05, 1.0), (0.9 * 5.0 - 0.05, 0.0)])
def test_time_to_collision_looks_0_9_s_ahead_of_every_state(gap_m: float, ttc: float) -> None:
    states = states_along(np.full(41, 5.0))
    end_m = 20.0 + 2.588
    parked = to_objects([vehicle("A", end_m + gap_m + 2.4, 0.0)])
    assert judged_among(states[None], parked).parts["ttc"].tolist() == [ttc]


@pytest.mark.parametrize(("from_m", "ttc"), [(-1.0, 1.0), (-2.0, 0.0)])
def test_of_each_object_the_first_meeting_ahead_of_time_counts(from_m: float, ttc: float) -> None:
    # It would come from the side at once: that matters only to an ego whose rear axle, 1.46 m
    # behind its centre, is in an intersection. Later on it would be met in front, or in one.
    crossing = vehicle("A", 1.0, 6.5, -math.pi / 2.0, speed_mps=8.0)
    rim = ((from_m, -3.0), (60.0, -3.0), (60.0, 6.0), (from_m, 6.0))
    area = Area(id="Area1", kind=AreaKind.INTERSECTION, boundary_m=rim)
    road = Road(replace(street(), areas=(area,)))
    judged = judged_among(states_along(np.full(41, 5.0))[None], to_objects([crossing]), road)
    assert judged.parts["ttc"].tolist() == [ttc]


def test_who_stands_beside_the_rear_half_of_the_ego_is_a_leader_on_the_path_there() -> None:
    # Its centre lies between rear axle and centre: beyond the rear axle is ahead, as released.
    ends = []
    for agents in ([], [vehicle("A", -0.7, 4.2)]):
        plan = planned(agents, speed_mps=0.0)
        left = PAPER_OFFSETS_M.index(3.0) * 5 + 4
        ends.append(plan.proposals.states[left, -1, 3])
    assert ends[1] < 0.1 < 4.0 < ends[0]


def test_it_brakes_only_slowly_driven_and_soon_hit() -> None:
    assert must_brake(2.0, 5.0)
    assert not must_brake(2.1, 5.0)
    assert not must_brake(2.0, 5.01)


def test_where_every_proposal_fails_it_keeps_to_the_centreline() -> None:
    wall = [vehicle(f"A{n}", 12.0, y, math.pi / 2.0) for n, y in enumerate((-6.0, -1.0, 4.0, 9.0))]
    plan = planned(wall, speed_mps=9.0)
    assert plan.proposals.scores.max() == 0.0
    assert plan.proposals.chosen == 0
    assert plan.poses[:, 1] == pytest.approx(np.zeros(81), abs=1e-9)


def test_the_brakes_command() -> None:
    def commanded(ego: FloatArray) -> float:
        poses = brake(ego, BODY)
        assert poses[0, 0] == pytest.approx(BODY.centre_m)
        return float((poses[1, 0] - poses[0, 0]) / 0.1)

    ego = np.zeros(6)
    for speed, wanted in [(5.0, 1.1 * 0.95), (0.3, 1.1 * (0.3 - 3.0)), (0.2, 0.2 - 0.8)]:
        ego[3] = speed
        assert commanded(ego) == pytest.approx(wanted)


def test_who_touches_the_ego_is_left_out_from_then_on() -> None:
    touching = vehicle("A", 4.5, 0.0)
    assert planned([touching], speed_mps=2.0).poses[:, 0] == pytest.approx(
        planned([], speed_mps=2.0).poses[:, 0]
    )


@pytest.mark.parametrize("offsets", [ORIGINAL_OFFSETS_M, PAPER_OFFSETS_M])
@pytest.mark.parametrize(("speed", "brakes"), [(4.5, True), (9.0, False)])
def test_one_walker_who_steps_out_late_makes_a_slow_ego_brake(
    offsets: tuple[float, ...], speed: float, brakes: bool
) -> None:
    # 1.9 m/s, the pace of interPlan's longest walk, from beside the lane, 2.2 s ahead; the
    # planner takes the walker for standing. Above 5 m/s it never brakes so, whatever comes.
    at_m = 2.2 * speed
    walker = pedestrian("P", at_m, -2.2, (at_m, 26.6))
    scene = street(speed_mps=speed, limit_mps=1.1 * speed)
    by_rules = replace(scene, options=SceneOptions(interplan=InterplanRules()))
    setting = DriveSetting(scene=by_rules, modification=Modification(added=(walker,)))
    drive = run(setting, PdmClosed(offsets), steps=20)
    assert any(plan.braking for plan in drive.plans) == brakes
    assert (drive.states[-1, 3] < 0.5 * speed) == brakes


def test_the_published_vector() -> None:
    limits = {"max_acceleration_mps2": 0.73, "max_deceleration_mps2": 1.67}
    driver = Idm(min_gap_m=2.0, headway_s=1.5, exponent=4.0, **limits)
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
        found = TRAFFIC_IDM.clip(np.array(speed), np.array(10.0), free, np.array(0.0))
        assert found == pytest.approx(pull)


def test_traffic_keeps_the_steady_gap_and_its_sweep() -> None:
    # 4.6.5: the gap is measured from the sweep's end, so it grows by the swept way. The follower's
    # limit is 10 m/s, and it begins where it would settle behind a leader that holds 5 m/s.
    drivers = LaneDrivers([vehicle("Agent2", 0.0, 0.0, speed_mps=5.0)], Road(street()))
    leader_m = wanted_m = 4.8 + steady_gap_m(TRAFFIC_IDM, 5.0) + 1.5 * 5.0
    for _ in range(40):
        leader = to_objects([vehicle("Agent3", leader_m, 0.0, speed_mps=5.0)])
        drivers.step(np.zeros(5), join_objects([drivers.objects(), leader]))
        leader_m += 0.5
    gap_m = leader_m - drivers.objects().boxes[0, 0]
    assert gap_m == pytest.approx(wanted_m, abs=0.1)


SLUG = "nudge-mill-junction"
STEPS = 55


def advance_m(drive: Drive) -> float:
    """How far the ego came along its route."""
    stations, _ = drive.road.centreline.beside(drive.boxes[[0, -1], :2])
    return float(stations[1] - stations[0])


@pytest.mark.slow
def test_offsets_to_4_m_pass_a_parked_car_at_which_the_original_ones_wait() -> None:
    scene, parked = without_traffic(shown_scene(SLUG)), entry(SLUG).reference
    road, setting = Road(scene), DriveSetting(scene=scene, modification=parked)
    wide, narrow = (
        run(setting, PdmClosed(offsets), road=road, steps=STEPS)
        for offsets in (PAPER_OFFSETS_M, ORIGINAL_OFFSETS_M)
    )
    assert advance_m(narrow) < parked.added[0].x_m < advance_m(wide)
    assert narrow.states[-1, 3] < 0.5


def test_the_documented_planner_drives(monkeypatch: pytest.MonkeyPatch) -> None:
    page = (ROOT / "docs" / "simulation.md").read_text()
    found = re.search(r"```python\n(.*?)```", page, re.S)
    module = ModuleType("my_planners")
    exec(compile(found.group(1), "my_planners", "exec"), module.__dict__)
    monkeypatch.setitem(__import__("sys").modules, "my_planners", module)
    name = "my_planners.AlongTheCentreline"
    planner = planner_named(name, allowed=[name])
    drive = run(DriveSetting(scene=street()), planner, steps=10)
    assert drive.boxes[-1, 0] == pytest.approx(8.0, abs=0.01)
