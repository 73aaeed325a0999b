"""Headings against lanes, degrees for radians, walks."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity
from augment.geometry.frames import wrap
from augment.scene.entities import AgentType, Area, AreaKind, TrafficAgent
from tests.checks.worlds import found_in, of_kind, severities
from tests.scenes import curve, pedestrian, scene, vehicle


@pytest.mark.parametrize(
    ("turn_deg", "speed_mps", "severity"),
    [
        (0.0, 8.0, Severity.FACT),
        (-29.0, 8.0, Severity.FACT),
        (31.0, 0.0, Severity.DOUBTFUL),
        (-100.0, 8.0, Severity.DOUBTFUL),
        (180.0, 0.0, Severity.DOUBTFUL),
        (180.0, 8.0, Severity.WRONG),
    ],
)
def test_the_turn_against_the_lane(turn_deg: float, speed_mps: float, severity: Severity) -> None:
    car = replace(vehicle("Agent2", 30, 0, math.radians(turn_deg)), speed_mps=speed_mps)
    (heading,) = of_kind(found_in(scene(), car), FindingKind.HEADING)
    assert heading.severity is severity
    assert abs(heading.measured["turn_deg"] or 0.0) == pytest.approx(abs(turn_deg))


def test_a_heading_is_read_against_the_bend_and_not_the_ego() -> None:
    x_m, y_m = 10.0 + 40.0 * math.sin(1.0), 40.0 * (1.0 - math.cos(1.0))
    (with_it,) = of_kind(found_in(curve(), vehicle("Agent2", x_m, y_m, 1.0)), FindingKind.HEADING)
    (as_ego,) = of_kind(found_in(curve(), vehicle("Agent2", x_m, y_m, 0.0)), FindingKind.HEADING)
    assert with_it.severity is Severity.FACT
    assert as_ego.severity is Severity.DOUBTFUL
    assert as_ego.measured["turn_deg"] == pytest.approx(-math.degrees(1.0), abs=0.6)
    assert "to the right of the direction of Lane1, which is 1.004 rad there" in as_ego.sentence()


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


@pytest.mark.parametrize(
    ("heading_rad", "severity"),
    [
        (90.0, Severity.WRONG),
        (-180.0, Severity.WRONG),
        (math.radians(358.0), None),
        (round(wrap(180.0), 3), Severity.DOUBTFUL),
        (round(wrap(170.0), 4), Severity.DOUBTFUL),
        (math.pi, None),
        (2.0, None),
    ],
)
def test_degrees_that_were_given_as_radians(heading_rad: float, severity: Severity | None) -> None:
    oncoming = vehicle("Agent2", 30.0, 3.5, heading_rad)
    found = of_kind(found_in(scene(), oncoming), FindingKind.DEGREES)
    assert [one.severity for one in found] == ([severity] if severity else [])
    assert all("degrees" in one.sentence() for one in found)


def walker(turned_rad: float = 0.0, **changes: object) -> TrafficAgent:
    one = pedestrian("Agent2", 20.0, -3.0, (20.0, 7.0))
    return replace(one, heading_rad=one.heading_rad + turned_rad, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("turned_rad", "severity"),
    [(0.3, Severity.FACT), (-1.0, Severity.DOUBTFUL), (math.pi, Severity.WRONG)],
)
def test_a_pedestrian_faces_its_walk(turned_rad: float, severity: Severity) -> None:
    (heading,) = of_kind(found_in(scene(), walker(turned_rad)), FindingKind.WALK_HEADING)
    assert heading.severity is severity
    assert heading.measured["walk_m"] == pytest.approx(10.0)


def test_a_worker_s_single_step_needs_no_facing() -> None:
    step = walker(math.pi, walk_to_m=(20.0, -2.0))
    (heading,) = of_kind(found_in(scene(), step), FindingKind.WALK_HEADING)
    assert heading.severity is Severity.FACT


def test_a_walk_across_the_road_crosses_the_ego_s_lane() -> None:
    (crossing,) = of_kind(found_in(scene(), walker()), FindingKind.WALK_CROSSING)
    assert crossing.measured["crosses_at_m"] == pytest.approx(20.0)
    assert crossing.sentence() == (
        "The walk of Agent2 crosses the ego's lane from right to left, 20.0 m ahead of the ego "
        "along the lanes."
    )


@pytest.mark.parametrize(
    ("start", "end", "words"),
    [
        ((20.0, -3.0), (40.0, -3.0), "does not cross the ego's lane."),
        ((-20.0, -3.0), (-20.0, 7.0), "does not cross the ego's lane."),
        ((20.0, -3.0), (20.0, -0.5), "starts or ends in the ego's lane"),
        ((20.0, 7.0), (20.0, -3.0), "crosses the ego's lane from left to right, 20.0 m ahead"),
        ((20.0, -3.0), (20.0, -3.0), "does not cross the ego's lane."),
    ],
)
def test_walks_that_cross_and_that_do_not(
    start: tuple[float, float], end: tuple[float, float], words: str
) -> None:
    (crossing,) = of_kind(
        found_in(scene(), pedestrian("Agent2", *start, end)), FindingKind.WALK_CROSSING
    )
    assert words in crossing.sentence()


def test_who_walks_without_an_end_is_followed_along_its_heading() -> None:
    going = walker(walk_to_m=None, speed_mps=1.2)
    standing = walker(walk_to_m=None)
    (crossing,) = of_kind(found_in(scene(), going), FindingKind.WALK_CROSSING)
    assert "keeping its heading, crosses the ego's lane" in crossing.sentence()
    assert not of_kind(found_in(scene(), standing), FindingKind.WALK_CROSSING)


def test_bicycles_stand_at_any_angle() -> None:
    bicycle = replace(
        vehicle("Agent2", 30.0, 0.0, 1.2), type=AgentType.BICYCLE, length_m=1.8, width_m=0.6
    )
    (standing,) = of_kind(found_in(scene(), bicycle), FindingKind.HEADING)
    (riding,) = of_kind(found_in(scene(), replace(bicycle, speed_mps=4.0)), FindingKind.HEADING)
    assert (standing.severity, riding.severity) == (Severity.FACT, Severity.DOUBTFUL)


def test_a_walk_that_ends_where_it_starts_has_no_direction() -> None:
    stays = replace(walker(0.0), walk_to_m=(walker(0.0).x_m, walker(0.0).y_m))
    (heading,) = of_kind(found_in(scene(), stays), FindingKind.WALK_HEADING)
    assert heading.severity is Severity.FACT
    assert heading.measured == {"turn_deg": None, "walk_m": 0.0}
    assert heading.sentence() == f"{stays.id} has a walk that ends where it starts."
