"""Where an agent is: from the ego, along the lanes, on which lane."""

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity
from augment.scene.entities import AgentType, Area, AreaKind
from tests.checks.worlds import found_in, of_kind, severities
from tests.scenes import curve, junction, pedestrian, scene, vehicle


def test_the_distance_along_the_lanes() -> None:
    for world, x_m, y_m, ahead_m, left_m in (
        (scene(), 30.0, -1.0, 30.0, -1.0),
        (scene(), -12.0, 3.5, -12.0, 3.5),
        (junction(), 50.0, 0.0, 50.0, 0.0),
        (curve(), 10.0 + 40.0 * math.sin(0.5), 40.0 * (1.0 - math.cos(0.5)), 30.0, 0.0),
    ):
        (lane,) = of_kind(found_in(world, vehicle("Agent2", x_m, y_m)), FindingKind.LANE)
        assert lane.measured["ahead_m"] == pytest.approx(ahead_m, abs=0.02)
        assert lane.measured["left_m"] == pytest.approx(left_m, abs=0.02)


@pytest.mark.parametrize(
    ("y_m", "words"),
    [(4.0, "4.0 m left of them, on Lane2, -0.50 m left of its"), (-9.0, "off every lane.")],
)
def test_the_lane_under_an_agent(y_m: float, words: str) -> None:
    (lane,) = of_kind(found_in(scene(), vehicle("Agent2", 20.0, y_m, math.pi)), FindingKind.LANE)
    assert words in lane.sentence()


def test_an_ego_off_every_lane_measures_no_distance() -> None:
    lost = replace(scene().ego, y_m=80.0, lane_id=None)
    assert not of_kind(found_in(scene(ego=lost), vehicle("Agent2", 30, 0)), FindingKind.LANE)


def test_the_lane_an_agent_names() -> None:
    for y_m, name, severity in (
        (0.0, "Lane1", None),
        (0.0, None, None),
        (0.0, "Lane9", Severity.WRONG),
        (1.3, "Lane2", None),  # up to 0.5 m beyond the line between them
        (1.2, "Lane2", Severity.DOUBTFUL),
        (2.2, "Lane1", None),
        (2.3, "Lane1", Severity.DOUBTFUL),
    ):
        car = vehicle("Agent2", 30.0, y_m, lane_id=name)
        found = of_kind(found_in(scene(), car), FindingKind.LANE_NAMED)
        assert [one.severity for one in found] == ([severity] if severity else [])


def test_a_map_without_lanes_has_no_facts_about_lanes() -> None:
    found = found_in(scene(lanes=(), areas=()), vehicle("Agent2", 30.0, 0.0))
    assert found == ()


def test_the_turn_against_the_lane() -> None:
    for turn_deg, speed_mps, severity in (
        *((0.0, 8.0, Severity.FACT), (-29.0, 8.0, Severity.FACT), (31.0, 0.0, Severity.DOUBTFUL)),
        *((-100.0, 8.0, Severity.DOUBTFUL), (180.0, 0.0, Severity.DOUBTFUL)),
        (180.0, 8.0, Severity.WRONG),
    ):
        car = vehicle("Agent2", 30, 0, math.radians(turn_deg), speed_mps=speed_mps)
        (heading,) = of_kind(found_in(scene(), car), FindingKind.HEADING)
        assert heading.severity is severity
        assert abs(heading.measured["turn_deg"]) == pytest.approx(abs(turn_deg))


def test_a_heading_is_read_against_the_bend_and_not_the_ego() -> None:
    x_m, y_m = 10.0 + 40.0 * math.sin(1.0), 40.0 * (1.0 - math.cos(1.0))
    (with_it,) = of_kind(found_in(curve(), vehicle("Agent2", x_m, y_m, 1.0)), FindingKind.HEADING)
    (as_ego,) = of_kind(found_in(curve(), vehicle("Agent2", x_m, y_m, 0.0)), FindingKind.HEADING)
    assert with_it.severity is Severity.FACT
    assert as_ego.severity is Severity.DOUBTFUL
    assert as_ego.measured["turn_deg"] == pytest.approx(-math.degrees(1.0), abs=0.6)


def test_crashed_cars_may_face_anywhere() -> None:
    crash = (vehicle("Agent2", 30.0, 0.0, 0.2), vehicle("Agent3", 34.2, 1.0, -1.8))
    assert severities(found_in(scene(), *crash)) == set()
    assert (FindingKind.HEADING, Severity.DOUBTFUL) in severities(found_in(scene(), crash[1]))


def test_parked_in_a_bay_any_direction_is_right() -> None:
    bay = Area(
        id="Area9", kind=AreaKind.CARPARK, boundary_m=((25, 5), (35, 5), (35, 11), (25, 11))
    )
    car = vehicle("Agent2", 30.0, 8.0, math.pi / 2)
    assert severities(found_in(scene(areas=(*scene().areas, bay)), car)) == set()


def test_what_is_not_steered_has_no_heading_against_a_lane() -> None:
    worker = pedestrian("Agent2", 30.0, 0.0)
    assert not of_kind(found_in(scene(), worker), FindingKind.HEADING)


def test_a_pedestrian_faces_its_walk() -> None:
    for turned_rad, walk_m, severity in (
        (0.3, 10.0, Severity.FACT),
        (-1.0, 10.0, Severity.DOUBTFUL),
        (math.pi, 10.0, Severity.WRONG),
        (math.pi, 1.0, Severity.FACT),  # a worker's single step
        (math.pi, 0.0, Severity.FACT),
    ):
        walker = pedestrian("Agent2", 20.0, -3.0, (20.0, walk_m - 3.0))
        turned = replace(walker, heading_rad=math.pi / 2.0 + turned_rad)
        (heading,) = of_kind(found_in(scene(), turned), FindingKind.WALK_HEADING)
        assert heading.severity is severity
        assert heading.measured["walk_m"] == pytest.approx(walk_m)


def test_bicycles_stand_at_any_angle() -> None:
    bicycle = vehicle("Agent2", 30.0, 0.0, 1.2, type=AgentType.BICYCLE, length_m=1.8, width_m=0.6)
    (standing,) = of_kind(found_in(scene(), bicycle), FindingKind.HEADING)
    (riding,) = of_kind(found_in(scene(), replace(bicycle, speed_mps=4.0)), FindingKind.HEADING)
    assert (standing.severity, riding.severity) == (Severity.FACT, Severity.DOUBTFUL)
