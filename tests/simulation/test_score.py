"""Each metric of the score in a world whose answer can be worked out by hand."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from augment.scene.entities import Modification, ScenarioType, Scene, TrafficAgent
from augment.simulation.drive import Drive, Expert, ExpertKind
from augment.simulation.score import (
    Metric,
    Score,
    ScoreKind,
    collisions,
    combine,
    criticality,
    required_braking_mps2,
    score_drive,
)
from augment.simulation.states import FloatArray
from tests.scenes import cone, pedestrian, vehicle
from tests.simulation.worlds import driven, states_along, street

STEADY = np.full(151, 8.0)
FAR = Expert(kind=ExpertKind.IDM, start_m=50.0, end_m=170.0)
"""120 m, what 8 m/s make in 15 s."""
CALM = Expert(kind=ExpertKind.IDM, start_m=50.0, end_m=52.0)


def moving(agent: TrafficAgent, speed_mps: float) -> TrafficAgent:
    return replace(agent, speed_mps=speed_mps)


def scored(
    speeds: Sequence[float] | FloatArray = STEADY,
    agents: Sequence[TrafficAgent] = (),
    *,
    expert: Expert = FAR,
    y_m: float = 0.0,
    heading_rad: float = 0.0,
    on: Scene | None = None,
) -> Score:
    states = states_along(speeds, y_m=y_m, heading_rad=heading_rad)
    return score_drive(driven(states, agents, on=on), expert)


def value(score: Score, name: str) -> float | None:
    return next(metric.value for metric in score.metrics if metric.name == name)


def test_a_plain_drive_is_perfect_in_each_of_nuplans_parts() -> None:
    score = scored()
    assert score.value == pytest.approx(1.0)
    assert score.metrics == (
        Metric("no_ego_at_fault_collisions", 1.0),
        Metric("drivable_area_compliance", 1.0),
        Metric("ego_is_making_progress", 1.0),
        Metric("driving_direction_compliance", 1.0),
        Metric("ego_progress_along_expert_route", 1.0, 5.0),
        Metric("time_to_collision_within_bound", 1.0, 5.0),
        Metric("speed_limit_compliance", 1.0, 4.0),
        Metric("ego_is_comfortable", 1.0, 2.0),
    )


def test_collisions() -> None:
    for who, agents, expected in (
        ("nobody", [], 1.0),
        ("a parked car ahead", [vehicle("A", 30.0, 0.0)], 0.0),
        ("one cone", [cone("A", 30.0, 0.0)], 0.5),
        ("two cones", [cone("A", 30.0, 0.0), cone("B", 40.0, 0.0)], 0.0),
        ("a person that stands", [pedestrian("A", 30.0, 0.0)], 0.0),
        ("a cone and a person", [cone("A", 20.0, 0.0), pedestrian("B", 30.0, 0.0)], 0.0),
        ("a faster car from behind", [moving(vehicle("A", -12.0, 0.0), 9.0)], 1.0),
        ("a slower car ahead", [moving(vehicle("A", 20.0, 0.0), 4.0)], 0.0),
        ("who touched the ego at the start", [vehicle("A", 4.0, 0.0)], 1.0),
        ("a car from the side into the ego's flank", [], 1.0),
    ):
        if who == "a car from the side into the ego's flank":
            # Its nose meets the ego's side between the axles at 5 s, at x = 40 m.
            agents = [moving(vehicle("A", 39.5, 22.0, -math.pi / 2.0), 3.8)]
            assert len(collisions(driven(states_along(STEADY), agents))) == 1
        assert value(scored(agents=agents), "no_ego_at_fault_collisions") == expected


@pytest.mark.parametrize(
    ("y_m", "expected"),
    # The lane's right edge is at y = -1.75, half the ego's width 1.1485: the corner is outside
    # from y = -0.6015 on, and 0.3 m outside at y = -0.9015.
    [(0.0, 1.0), (-0.7, 1.0), (-0.9, 1.0), (-0.903, 0.0), (-3.0, 0.0), (3.5, 1.0)],
)
def test_the_drivable_area_allows_less_than_30_cm(y_m: float, expected: float) -> None:
    assert value(scored(y_m=y_m), "drivable_area_compliance") == expected


def test_progress_is_a_share_of_the_experts() -> None:
    for speed, ratio, enough in (
        *((8.0, 1.0, 1.0), (4.0, 0.5, 1.0), (1.61, 0.20125, 1.0), (1.59, 0.19875, 0.0)),
        *((9.0, 1.0, 1.0), (-8.0, 0.0, 0.0)),
    ):
        score = scored(np.full(151, speed))
        assert value(score, "ego_progress_along_expert_route") == pytest.approx(ratio)
        assert value(score, "ego_is_making_progress") == enough


def test_the_wrong_way_counts_by_the_metres_of_1_1_s() -> None:
    for speed, expected in ((1.8, 1.0), (1.83, 0.5), (5.4, 0.5), (5.5, 0.0)):
        score = scored(np.full(151, speed), y_m=3.5, expert=CALM)
        assert value(score, "driving_direction_compliance") == expected


def test_time_to_collision_is_bounded_by_0_95_s() -> None:
    for gap_m, expected in ((8.1, 1.0), (7.0, 0.0)):
        # Four moments only, so that the last gap is what counts.
        start = gap_m + 3 * 0.8
        speeds = np.full(4, 8.0)
        score = scored(speeds, [vehicle("A", start + 2.588 + 2.4, 0.0)], expert=CALM)
        assert value(score, "time_to_collision_within_bound") == expected


def test_who_is_beside_an_ego_in_its_lane_does_not_count_as_a_coming_collision() -> None:
    cutting_in = moving(vehicle("A", 1.0, -3.2, math.radians(30.0)), 8.0)
    in_lane = scored(np.full(3, 8.0), [cutting_in], expert=CALM)
    assert value(in_lane, "time_to_collision_within_bound") == 1.0
    across = scored(np.full(3, 8.0), [replace(cutting_in, y_m=-1.6)], y_m=1.6, expert=CALM)
    assert value(across, "time_to_collision_within_bound") == 0.0


def test_overspeed_is_summed_up() -> None:
    for limit, speed, expected in (
        *((10.0, 10.0, 1.0), (10.0, 11.115, 1.0 - 151 / 150 * 0.5)),
        *((10.0, 13.0, 0.0), (None, 30.0, None)),
    ):
        score = scored(np.full(151, speed), on=street(600.0, limit_mps=limit))
        assert value(score, "speed_limit_compliance") == (
            None if expected is None else pytest.approx(expected)
        )


@pytest.mark.parametrize(("pull", "expected"), [(2.3, 1.0), (2.5, 0.0), (-4.0, 1.0), (-4.1, 0.0)])
def test_comfort_is_all_or_nothing(pull: float, expected: float) -> None:
    states = states_along(np.maximum(0.0, 20.0 + pull * 0.1 * np.arange(40)))
    states[:, 4] = pull
    assert value(score_drive(driven(states), CALM), "ego_is_comfortable") == expected


def test_multipliers_multiply_and_what_is_unknown_does_not_count() -> None:
    rows = (("a", 0.5), ("b", None), ("c", 0.4, 5.0), ("d", 1.0, 1.0), ("e", None, 100.0))
    assert combine(tuple(Metric(*row) for row in rows)) == pytest.approx(
        0.5 * (5.0 * 0.4 + 1.0) / 6.0
    )


def by_interplan(drive: Drive, kind: ScenarioType, change: Modification) -> Score:
    more: dict[str, Any] = {"kind": ScoreKind.INTERPLAN, "scenario_type": kind}
    return score_drive(drive, FAR, modification=change, **more)


@pytest.mark.parametrize("scenario_type", list(ScenarioType))
def test_interplan_lets_four_types_use_the_other_lane(scenario_type: ScenarioType) -> None:
    parked = Modification(added=(vehicle("A", 60.0, 0.0),))
    drive = driven(states_along(STEADY, y_m=3.5))
    score = by_interplan(drive, scenario_type, parked)
    weights = {metric.name: metric.weight for metric in score.metrics}
    if scenario_type is ScenarioType.JAYWALKER:
        assert weights["driving_direction_compliance"] is None
        assert score.value == 0.0
    else:
        assert weights["driving_direction_compliance"] == 1.0
        # Undefined start (0.2607): it starts in the other lane; direction 0.
        wanted = (5 + 5 + 4 + 2 + 4 * 0.2607 + 0) / (5 + 5 + 4 + 2 + 4 + 1)
        assert score.value == pytest.approx(wanted)


@pytest.mark.parametrize(
    "furthest", [vehicle("A", 60.0, 5.0), pedestrian("A", 10.0, 5.0, (60.0, 5.0))]
)
@pytest.mark.parametrize(("speed", "expected"), [(8.0, 1.0), (4.1, 1.0), (3.9, 0.0)])
def test_interplan_wants_the_furthest_obstacle_passed(
    furthest: TrafficAgent, speed: float, expected: float
) -> None:
    # 60 of the expert's 120 m: half of its way.
    parked = Modification(added=(furthest, cone("B", 20.0, 5.0)))
    drive = driven(states_along(np.full(151, speed)))
    score = by_interplan(drive, ScenarioType.NUDGE, parked)
    assert value(score, "ego_passed_obstacles") == expected


def test_criticality_of_a_drive_towards_a_parked_car() -> None:
    # 8 m/s for 2 s from a bumper gap of 40 m: 24 m remain, and 3 s, which is the horizon.
    drive = driven(states_along(np.full(21, 8.0)), [vehicle("A", 40.0 + 2.588 + 2.4, 0.0)])
    assert criticality(drive, ()) == {
        "least_distance_m": pytest.approx(24.0),
        "least_ttc_s": None,
        "required_braking_mps2": pytest.approx(8.0**2 / (2.0 * 24.0)),
    }


def test_the_required_braking_is_that_of_who_is_in_the_way() -> None:
    for other, speed_mps, needed_mps2 in (
        # 30 m from centre to centre less half of 5.176 m and of 4.8 m leaves 25.012 m.
        (vehicle("Agent2", 30.0, 0.0), 0.0, 8.0**2 / (2.0 * 25.012)),
        (vehicle("Agent2", 30.0, 0.0), 5.0, 3.0**2 / (2.0 * 25.012)),
        (vehicle("Agent2", 30.0, 0.0), 8.0, 0.0),
        (vehicle("Agent2", 30.0, 3.5), 0.0, 0.0),
        (vehicle("Agent2", -30.0, 0.0), 0.0, 0.0),
    ):
        drive = driven(states_along([8.0, 8.0]), [replace(other, speed_mps=speed_mps)])
        assert required_braking_mps2(drive)[0] == pytest.approx(needed_mps2, abs=1e-6)
