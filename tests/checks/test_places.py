"""Where an agent is: from the ego, along the lanes, on which lane."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.checks import FindingKind, Severity
from augment.geometry.polyline import Polyline
from augment.scene.entities import Lane, Scene
from tests.checks.worlds import found_in, of_kind
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
