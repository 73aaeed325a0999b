"""Where the rule placer puts what a sentence asks for."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from augment.baselines.rule_placer import place
from augment.errors import InstructionNotUnderstood
from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, Lane, Scene, TrafficSide
from tests.baselines.placing import PARKED, added, refusal
from tests.instruction.test_parse import PAPER
from tests.scenes import curve, junction, scene, vehicle


def three_lanes(side: TrafficSide = TrafficSide.LEFT) -> Scene:
    """Three lanes of the ego's direction, 3 m wide, the ego on the middle one."""
    names = ("Right", "Lane1", "Left")
    lanes = tuple(
        Lane(
            id=name,
            centerline=Polyline([(-50.0, d_m), (100.0, d_m)]),
            width_m=3.0,
            left_neighbor=dict(itertools.pairwise(names)).get(name),
            right_neighbor=dict(zip(names[1:], names, strict=False)).get(name),
        )
        for name, d_m in zip(names, (-3.0, 0.0, 3.0), strict=True)
    )
    return scene(lanes=lanes, areas=(), traffic_side=side)


def test_on_a_straight_lane_it_stands_exactly_where_it_was_asked_for() -> None:
    (car,) = added(scene(), PARKED)
    assert (car.x_m, car.y_m, car.heading_rad) == (21.4, 0.0, 0.0)
    assert (car.id, car.type, car.lane_id) == ("Agent2", AgentType.VEHICLE, "Lane1")
    assert (car.length_m, car.width_m, car.speed_mps) == (4.8, 2.0, 0.0)


def test_on_a_curve_the_distance_runs_along_the_arc() -> None:
    (car,) = added(curve(40.0), PARKED)
    angle = (21.4 - 10.0) / 40.0
    assert car.x_m == pytest.approx(10.0 + 40.0 * math.sin(angle), abs=0.01)
    assert car.y_m == pytest.approx(40.0 * (1.0 - math.cos(angle)), abs=0.01)
    assert car.heading_rad == pytest.approx(angle, abs=math.radians(1.0))


def test_across_a_junction_it_goes_straight_on() -> None:
    (on_connector,) = added(junction(), "a parked car 30 m ahead of the ego")
    (beyond,) = added(junction(), "a parked car 45 m ahead of the ego")
    assert (on_connector.x_m, on_connector.y_m, on_connector.lane_id) == (30.0, 0.0, "Connector1")
    assert (beyond.x_m, beyond.lane_id) == (45.0, "Lane2")


def test_the_papers_offset_is_drawn_from_its_range_by_the_seed() -> None:
    offsets = [added(scene(), PAPER, seed=seed)[0].y_m for seed in range(40)]
    assert len(set(offsets)) > 30
    assert 0.0 <= min(offsets) < 0.3
    assert 1.2 < max(offsets) <= 1.5
    assert all(added(scene(), PAPER, seed=seed)[0].x_m == 21.4 for seed in range(5))


def test_the_same_seed_gives_the_same_placement() -> None:
    assert place(scene(), PAPER, seed=7) == place(scene(), PAPER, seed=7)


@pytest.mark.parametrize(
    ("words", "y_m"),
    [
        ("slightly towards the left lane boundary", 0.75),
        ("slightly towards the right lane boundary", -0.75),
        ("offset 1.3 m from the lane centre towards the right lane boundary", -1.3),
        ("close to the left lane boundary", 0.65),
        ("at the kerb", -0.65),
        ("slightly towards the centre line", 0.75),
        ("partly on the shoulder", -1.75),
        ("in the oncoming lane", 3.5),
        ("in the oncoming lane, slightly towards the left lane boundary", 4.25),
    ],
)
def test_sides_are_those_of_the_ego_and_the_kerb_that_of_the_map(words: str, y_m: float) -> None:
    (car,) = added(scene(), f"{PARKED}, {words}")
    assert (car.x_m, car.y_m) == (21.4, y_m)


def test_where_people_drive_on_the_left_the_kerb_is_on_the_left() -> None:
    (car,) = added(scene(traffic_side=TrafficSide.LEFT), f"{PARKED}, at the kerb")
    assert car.y_m == 0.65


def test_a_car_in_the_oncoming_lane_faces_as_its_lane_leads() -> None:
    (car,) = added(scene(), "An oncoming car approaches at 10 m/s, 50 m ahead.")
    assert (car.x_m, car.y_m, car.lane_id, car.speed_mps) == (50.0, 3.5, "Lane2", 10.0)
    assert abs(car.heading_rad) == pytest.approx(math.pi, abs=1e-4)


@pytest.mark.parametrize(("side", "y_m"), [("left", 3.0), ("right", -3.0)])
def test_neighbouring_lanes_are_found_on_the_map(side: str, y_m: float) -> None:
    (car,) = added(three_lanes(), f"{PARKED} in the {side} lane")
    assert (car.x_m, car.y_m) == (21.4, y_m)


def test_a_distance_can_run_back() -> None:
    (car,) = added(scene(), "a parked car 12 m behind the ego")
    assert car.x_m == -12.0


def test_what_stands_in_the_way_is_avoided_by_a_small_shift() -> None:
    busy = scene(agents=(vehicle("Agent2", 16.4, 0.0),))
    (car,) = added(busy, "a parked car about 21 m ahead of the ego")
    assert (car.id, car.x_m) == ("Agent3", 21.25)


def test_a_place_that_is_taken_is_refused() -> None:
    busy = scene(agents=(vehicle("Agent2", 21.0, 0.0),))
    assert "it would stand in Agent2" in refusal(busy, PARKED)
    assert "in the ego" in refusal(scene(), "a parked car 2 m ahead of the ego")


def test_ids_follow_the_highest_of_the_scene() -> None:
    busy = scene(agents=(vehicle("Agent9", 60.0, 0.0), vehicle("other", 70.0, 0.0)))
    assert added(busy, PARKED)[0].id == "Agent10"


@pytest.mark.parametrize(
    ("shown", "text", "reason"),
    [
        (scene(), "a parked car 160 m ahead of the ego", "The lanes end 100 m ahead of the ego"),
        (scene(), "a parked car 60 m behind the ego", "The lanes end 50 m behind the ego"),
        (scene(), f"{PARKED} in the left lane", "no lane on the left"),
        (curve(), f"{PARKED} in the oncoming lane", "no oncoming lane"),
        (scene(), f"{PARKED} on the left shoulder", "no shoulder on the left"),
        (scene(), f"{PARKED}, shifted by 9 m to the left", "leaves the lane"),
        (three_lanes(), f"{PARKED} partly on the shoulder", "another lane"),
        (scene(lanes=()), PARKED, "stands on no lane"),
        (scene(), "a taper of 30 cones 90 m ahead", "The lanes end"),
        (scene(), "two crashed cars 30 m ahead in the intersection", "not in the intersection"),
        (
            junction(),
            "a jaywalker crosses from left to right 30 m ahead, before the intersection",
            "not before the intersection",
        ),
        (scene(), "a taper of 5 cones 20 m ahead, 0.2 m apart", "stand in each other"),
    ],
)
def test_what_the_map_has_no_room_for_is_refused(shown: Scene, text: str, reason: str) -> None:
    if shown.lanes == ():
        shown = replace(shown, ego=replace(shown.ego, lane_id=None))
    assert reason in refusal(shown, text)


def test_notes_say_what_was_placed_assumed_and_ignored() -> None:
    placement = place(
        scene(), "Park a car 24 m ahead of the ego, so that it can only be overtaken."
    )
    assert placement.notes == (
        "A car, standing, 24.0 m ahead of the ego along its lane, in the ego's lane, on the lane "
        "centre. Not said, so assumed: in the ego's lane; in the middle of the lane. Read, but "
        "placing nothing: “so that it can only be overtaken”."
    )
    assert placement.ignored == ("so that it can only be overtaken",)
    assert placement.understood == ("Park", "a car", "24 m ahead of the ego")


def test_notes_tell_drawn_and_moved_numbers() -> None:
    drawn = place(scene(), PAPER)
    (car,) = drawn.modification.added
    assert f"{car.y_m:.2f} m (drawn from 0 to 1.5 m) from the lane centre" in drawn.notes
    busy = scene(agents=(vehicle("Agent2", 16.4, 0.0),))
    moved = place(busy, "a parked car about 21 m ahead of the ego")
    assert "21.2 m ahead of the ego along its lane (moved from 21 m, where it had" in moved.notes


def test_a_refusal_on_the_map_still_tells_what_was_read() -> None:
    with pytest.raises(InstructionNotUnderstood) as refused:
        place(scene(), "a parked car 160 m ahead of the ego")
    assert refused.value.understood == ("a parked car", "160 m ahead of the ego")
