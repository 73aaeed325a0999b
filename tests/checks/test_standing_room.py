"""Off the road, outside the map, on top of each other, of no such size or speed."""

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Severity
from augment.checks.finding import FaultClass
from augment.checks.ground import Surface
from augment.geometry.frames import Pose, corners
from augment.metrics.fault_guess import first_guess
from augment.scene.entities import AgentType, Area, AreaKind, Scene, TrafficAgent
from tests.checks.worlds import found_in, of_kind, severities
from tests.scenes import EGO, cone, pedestrian, scene, strip, vehicle

BUS = vehicle("Agent2", 40.0, 0.0, type=AgentType.BUS, length_m=7.456, width_m=2.079)


def test_where_the_map_has_no_walkways_people_off_it_are_a_fact() -> None:
    bare = scene(areas=scene().areas[:1])
    (off,) = of_kind(found_in(bare, pedestrian("Agent2", 30.0, -4.0)), FindingKind.OFF_ROAD)
    assert off.severity is Severity.FACT
    assert off.sentence() == "Agent2 is 2.2 m off everything that the map shows."


def test_an_area_that_crosses_itself_is_the_ground_that_it_encloses() -> None:
    tie = Area(id="A", kind=AreaKind.DRIVABLE, boundary_m=((0, 0), (4, 4), (4, 0), (0, 4)))
    flat = Area(id="B", kind=AreaKind.DRIVABLE, boundary_m=((0, 0), (4, 0), (9, 0)))
    box = corners(Pose(x_m=2.0, y_m=2.0, heading_rad=0.0), 4.0, 4.0)
    assert Surface(areas=(tie, flat)).share_outside(box) == pytest.approx(0.5)
    assert Surface(areas=(flat,)).is_empty


def test_two_stopped_cars_may_touch() -> None:
    for gap_m, severity in (
        *((0.1, None), (-0.015, None), (-0.24, Severity.FACT)),
        *((-0.72, Severity.DOUBTFUL), (-2.0, Severity.WRONG)),
    ):
        cars = vehicle("Agent2", 30.0, 0.0), vehicle("Agent3", 34.8 + gap_m, 0.0)
        found = of_kind(found_in(scene(), *cars), FindingKind.OVERLAP)
        assert [one.severity for one in found] == ([severity] if severity else [])
        if found:
            assert found[0].agents == ("Agent2", "Agent3")
            assert found[0].measured["share_of_smaller"] == pytest.approx(-gap_m / 4.8)


def test_a_moving_car_touches_nobody() -> None:
    cars = vehicle("Agent2", 30.0, 0.0, speed_mps=5.0), vehicle("Agent3", 34.4, 0.0)
    assert (FindingKind.OVERLAP, Severity.WRONG) in severities(found_in(scene(), *cars))


def test_any_overlap_with_the_ego_is_wrong() -> None:
    close = vehicle("Agent2", (EGO.length_m + 4.8) / 2.0 - 0.05, 0.0)
    (overlap,) = of_kind(found_in(scene(), close), FindingKind.OVERLAP)
    assert overlap.severity is Severity.WRONG
    assert overlap.sentence() == (
        "Agent2 and Agent1 overlap by 1% of the smaller box, 0.05 m deep."
    )


def test_the_small_box_counts() -> None:
    inside = cone("Agent3", 41.0, 0.2)
    (overlap,) = of_kind(found_in(scene(), BUS, inside), FindingKind.OVERLAP)
    assert overlap.measured["share_of_smaller"] == pytest.approx(1.0)
    assert overlap.severity is Severity.WRONG


def test_what_was_recorded_is_in_the_way_too() -> None:
    busy = scene(agents=(vehicle("Agent2", 30.0, 0.0),))
    assert (FindingKind.OVERLAP, Severity.WRONG) in severities(
        found_in(busy, vehicle("Agent3", 31, 0))
    )


def test_sizes() -> None:
    for agent, severity, words in (
        (BUS, None, ""),
        (replace(BUS, length_m=2.079, width_m=7.456), Severity.WRONG, "wider than long"),
        (replace(BUS, length_m=24.0), Severity.DOUBTFUL, "unusual for a bus"),
        (pedestrian("Agent2", 30, 0, length_m=4.8), Severity.WRONG, "for a pedestrian"),
        (cone("Agent2", 30, 0, width_m=1.2), Severity.DOUBTFUL, "for a traffic cone"),
    ):
        found = of_kind(found_in(scene(), agent), FindingKind.SIZE)
        assert [one.severity for one in found] == ([severity] if severity else [])
        assert all(words in one.sentence() for one in found)


def test_speeds() -> None:
    for agent, speed_mps, severity in (
        (BUS, 13.0, None),
        (BUS, 20.0, None),  # the limit is 13.9 m/s
        (BUS, 22.0, Severity.DOUBTFUL),
        (BUS, 60.0, Severity.WRONG),
        (pedestrian("Agent2", 30, 0), 5.0, Severity.DOUBTFUL),
        (cone("Agent2", 30, 0), 1.0, Severity.WRONG),
    ):
        found = of_kind(found_in(scene(), replace(agent, speed_mps=speed_mps)), FindingKind.SPEED)
        assert [one.severity for one in found] == ([severity] if severity else [])


def test_nothing_is_held_against_a_well_parked_car() -> None:
    car = vehicle("Agent2", 21.5, -0.7, math.radians(2.0), lane_id="Lane1")
    assert severities(found_in(scene(), car)) == set()


EDGE_M = 4.0
"""The road reaches from -4 to 4 m, a walkway of 2 m beside it on either side."""
FACT, DOUBTFUL, WRONG = Severity.FACT, Severity.DOUBTFUL, Severity.WRONG


def road() -> Scene:
    areas = (
        strip("Area1", AreaKind.DRIVABLE, -4.0, 4.0),
        strip("Area2", AreaKind.WALKWAY, 4.0, 6.0),
        strip("Area3", AreaKind.WALKWAY, -6.0, -4.0),
    )
    return scene(lanes=scene().lanes[:1], areas=areas)


CAR = vehicle("Agent2", 30.0, 0.0)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize(
    ("agent", "left_m", "severity"),
    [
        # A box 2 m wide counts by the share of it that is past the road's edge.
        *((CAR, 3.0 + 2.0 * share, None) for share in (0.0, 0.019)),
        *((CAR, 3.0 + 2.0 * share, FACT) for share in (0.021, 0.149)),
        *((CAR, 3.0 + 2.0 * share, DOUBTFUL) for share in (0.151, 0.499)),
        *((CAR, 3.0 + 2.0 * share, WRONG) for share in (0.501, 1.0)),
        (replace(CAR, type=AgentType.BUS), 3.0 + 2.0 * 0.151, DOUBTFUL),
        # A cone counts by how far its centre is off the road.
        *((cone("Agent2", 30.0, 0.0), EDGE_M + off_m, None) for off_m in (-1.0, 0.99)),
        *((cone("Agent2", 30.0, 0.0), EDGE_M + off_m, DOUBTFUL) for off_m in (1.01, 2.99)),
        (cone("Agent2", 30.0, 0.0), EDGE_M + 3.01, WRONG),
        # Who walks counts by how far he is off all that the map shows.
        (pedestrian("Agent2", 30.0, 0.0), 5.99, None),
        *((pedestrian("Agent2", 30.0, 0.0), 6.0 + off_m, FACT) for off_m in (0.01, 1.99)),
        *((pedestrian("Agent2", 30.0, 0.0), 6.0 + off_m, DOUBTFUL) for off_m in (2.01, 9.99)),
        (pedestrian("Agent2", 30.0, 0.0), 16.01, WRONG),
    ],
)
def test_each_kind_has_its_ground_and_its_edge(
    side: float, agent: TrafficAgent, left_m: float, severity: Severity | None
) -> None:
    moved = replace(agent, y_m=side * left_m)
    found = of_kind(found_in(road(), moved), FindingKind.OFF_ROAD)
    assert [one.severity for one in found] == ([] if severity is None else [severity])


WALKER = pedestrian("Agent2", 30.0, -4.0, (30.0, 6.0))
PARKED = vehicle("Agent3", 31.0, -1.0)


def test_no_walk_leads_through_what_stands() -> None:
    for other, inside_m in (
        (PARKED, 2.0),
        (vehicle("Agent3", 32.3, -1.0), 2.0),
        (vehicle("Agent3", 32.5, -1.0), None),  # he walks past its bumper
        (vehicle("Agent3", 30.0, -1.0, math.radians(45.0)), 2.0 * math.sqrt(2.0)),
        # The corner of a box turned by 45 degrees, 0.02 and 0.07 m past his way.
        (vehicle("Agent3", 32.38, -1.0, math.radians(45.0)), None),
        (vehicle("Agent3", 32.33, -1.0, math.radians(45.0)), 0.148),
        (replace(PARKED, speed_mps=3.0), None),  # it will be gone
        (cone("Agent3", 30.2, 3.0), 0.5),
        (pedestrian("Agent3", 30.0, 2.0), None),
        (vehicle("Agent3", 30.0, 8.0), None),  # beyond where he stops
        (vehicle("Agent3", 30.0, -6.0), None),  # behind him
    ):
        found = of_kind(found_in(scene(agents=(other,)), WALKER), FindingKind.WALK_BLOCKED)
        assert [one.severity for one in found] == [Severity.DOUBTFUL] * (inside_m is not None)
        for one in found:
            assert one.agents == ("Agent2", "Agent3")
            assert one.measured["inside_m"] == pytest.approx(inside_m, abs=0.001)
            assert one.sentence() == f"The walk of Agent2 leads {inside_m:.1f} m through Agent3."


def test_a_blocked_walk_is_a_fault_of_logic_unless_it_follows_from_a_heading() -> None:
    blocked = found_in(scene(agents=(PARKED,)), WALKER)
    assert first_guess(blocked) == {FaultClass.LOGIC}
    backwards = replace(WALKER, heading_rad=-math.pi / 2.0)
    turned = found_in(scene(agents=(PARKED,)), backwards)
    assert first_guess(turned) == {FaultClass.HEADING}
