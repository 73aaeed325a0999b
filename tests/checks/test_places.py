"""Where an agent is: from the ego, along the lanes, on which lane."""

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.checks import FindingKind, Severity
from augment.geometry.frames import wrap
from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, Area, AreaKind, Lane, Scene, TrafficAgent
from tests.checks.worlds import found_in, of_kind, severities
from tests.scenes import curve, junction, pedestrian, scene, vehicle


@pytest.mark.parametrize(
    ("x_m", "y_m", "words"),
    [
        (
            21.4,
            -1.3,
            "21.4 m from the ego in a straight line: 21.4 m ahead of it and 1.3 m to its",
        ),
        (
            3.0,
            4.0,
            "5.0 m from the ego in a straight line: 3.0 m ahead of it and 4.0 m to its left",
        ),
        (-6.0, -8.0, "10.0 m from the ego in a straight line: 6.0 m behind it and 8.0 m to its"),
    ],
)
def test_the_straight_line_from_the_ego(x_m: float, y_m: float, words: str) -> None:
    (offset,) = of_kind(found_in(scene(), vehicle("Agent2", x_m, y_m)), FindingKind.EGO_OFFSET)
    assert offset.severity is Severity.FACT
    assert words in offset.sentence()
    assert offset.measured["ahead_m"] == pytest.approx(x_m)
    assert offset.measured["left_m"] == pytest.approx(y_m)


@pytest.mark.parametrize(
    ("world", "x_m", "y_m", "along_m"),
    [
        (scene(), 30.0, -1.0, 30.0),
        (scene(), -12.0, 0.0, -12.0),
        (junction(), 50.0, 0.0, 50.0),  # straight on
        (junction(), 28.0, 30.0, 20.0 + 4.0 * math.pi + 22.0),  # round the bend to the left
        (curve(), 10.0 + 40.0 * math.sin(0.5), 40.0 * (1.0 - math.cos(0.5)), 10.0 + 20.0),
    ],
)
def test_the_distance_along_the_lanes(
    world: Scene, x_m: float, y_m: float, along_m: float
) -> None:
    (distance,) = of_kind(found_in(world, vehicle("Agent2", x_m, y_m)), FindingKind.LANE_DISTANCE)
    assert distance.measured["along_lanes_m"] == pytest.approx(along_m, abs=0.02)
    word = "ahead of" if along_m > 0.0 else "behind"
    assert f"{abs(along_m):.1f} m {word} the ego along the lanes" in distance.sentence()


@pytest.mark.parametrize(("angle", "along_m"), [(0.5, 20.0), (-0.5, -20.0), (2.5, 100.0)])
def test_on_a_loop_the_shorter_way_counts(angle: float, along_m: float) -> None:
    """A ring road of radius 40 m around (0, 40), in two halves; the ego is where they meet."""
    halves = [
        [(40.0 * math.sin(a), 40.0 - 40.0 * math.cos(a)) for a in np.linspace(start, end, 181)]
        for start, end in ((0.0, math.pi), (math.pi, 2.0 * math.pi))
    ]
    ring = scene(
        lanes=(
            Lane(id="Lane1", centerline=Polyline(halves[0]), width_m=3.5, successors=("Lane2",)),
            Lane(id="Lane2", centerline=Polyline(halves[1]), width_m=3.5, successors=("Lane1",)),
        ),
        areas=(),
    )
    car = vehicle("Agent2", 40.0 * math.sin(angle), 40.0 - 40.0 * math.cos(angle), angle)
    (distance,) = of_kind(found_in(ring, car), FindingKind.LANE_DISTANCE)
    assert distance.measured["along_lanes_m"] == pytest.approx(along_m, abs=0.05)


def test_no_lane_leads_to_the_oncoming_one() -> None:
    car = vehicle("Agent2", 30.0, 3.5, math.pi)
    (distance,) = of_kind(found_in(scene(), car), FindingKind.LANE_DISTANCE)
    assert distance.measured["along_lanes_m"] is None
    assert distance.sentence() == (
        "No lane leads from the ego to the place of Agent2: it is level with a point 30.0 m ahead "
        "of the ego along the lanes, 3.5 m to the left of the centre of Lane1."
    )


def test_far_from_the_ego_s_lanes_no_distance_along_them_is_told() -> None:
    (distance,) = of_kind(
        found_in(scene(), pedestrian("Agent2", 30.0, 60.0)), FindingKind.LANE_DISTANCE
    )
    assert distance.sentence() == "No lane leads from the ego to the place of Agent2."
    assert set(distance.measured.values()) == {None}


def test_a_lane_behind_an_ego_that_has_none_is_no_distance() -> None:
    lost = replace(scene().ego, y_m=80.0, lane_id=None)
    assert not of_kind(
        found_in(scene(ego=lost), vehicle("Agent2", 30, 0)), FindingKind.LANE_DISTANCE
    )


def test_the_lane_under_an_agent_and_its_offset() -> None:
    (lane,) = of_kind(found_in(scene(), vehicle("Agent2", 20.0, 4.0, math.pi)), FindingKind.LANE)
    assert lane.lanes == ("Lane2",)
    assert lane.measured["along_m"] == pytest.approx(80.0)
    assert lane.measured["left_m"] == pytest.approx(-0.5)
    assert lane.sentence() == (
        "Agent2 is on Lane2, 80.0 m along it and 0.50 m to the right of its centre line; "
        "the lane is 3.5 m wide."
    )


def test_off_every_lane() -> None:
    (lane,) = of_kind(found_in(scene(), vehicle("Agent2", 18.2, -9.05)), FindingKind.LANE)
    assert lane.sentence() == (
        "Agent2 is 7.3 m off every lane; the nearest lane is Lane1 at 68.2 m along it."
    )


@pytest.mark.parametrize(
    ("name", "severity", "words"),
    [
        ("Lane1", None, ""),
        (None, None, ""),
        ("Lane2", Severity.DOUBTFUL, "names Lane2 as its lane but is 1.8 m off it, on Lane1."),
        ("Lane9", Severity.WRONG, "names Lane9 as its lane, which the map does not have."),
    ],
)
def test_the_lane_that_an_agent_names(
    name: str | None, severity: Severity | None, words: str
) -> None:
    car = replace(vehicle("Agent2", 30.0, 0.0), lane_id=name)
    found = of_kind(found_in(scene(), car), FindingKind.LANE_NAMED)
    assert [one.severity for one in found] == ([severity] if severity else [])
    assert all(one.sentence() == f"Agent2 {words}" for one in found)


def test_a_map_without_lanes_has_no_facts_about_lanes() -> None:
    found = found_in(scene(lanes=(), areas=()), vehicle("Agent2", 30.0, 0.0))
    assert {one.kind for one in found} == {FindingKind.EGO_OFFSET}


@pytest.mark.parametrize(
    ("y_m", "doubtful"),
    [(1.75, set()), (1.3, set()), (2.2, set()), (1.2, {"Lane2"}), (2.3, {"Lane1"})],
)
def test_on_the_line_between_two_lanes_either_may_be_named(y_m: float, doubtful: set[str]) -> None:
    named = {
        lane
        for lane in ("Lane1", "Lane2")
        if of_kind(
            found_in(scene(), replace(vehicle("Agent2", 30.0, y_m), lane_id=lane)),
            FindingKind.LANE_NAMED,
        )
    }
    assert named == doubtful


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
