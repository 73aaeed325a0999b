"""Where the rule placer puts what an intent asks for."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from augment.geometry.polyline import Polyline
from augment.scene.entities import AgentType, Lane, Scene, TrafficSide
from augment.scene.intent import (
    Body,
    Intent,
    LaneChoice,
    Lateral,
    LateralTarget,
    Nearness,
    Relation,
    Setting,
    Shape,
    Side,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from tests.baselines.placing import added, refusal
from tests.intents import (
    LEFT_EDGE,
    PAPER,
    RIGHT_EDGE,
    cones,
    crash,
    metres,
    parked,
    spot,
    towards,
    walk,
)
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
    (car,) = added(scene(), parked())
    assert (car.x_m, car.y_m, car.heading_rad) == (21.4, 0.0, 0.0)
    assert (car.id, car.type, car.lane_id) == ("Agent2", AgentType.VEHICLE, "Lane1")
    assert (car.length_m, car.width_m, car.speed_mps) == (4.8, 2.0, 0.0)


def test_on_a_curve_the_distance_runs_along_the_arc() -> None:
    (car,) = added(curve(40.0), parked())
    angle = (21.4 - 10.0) / 40.0
    assert car.x_m == pytest.approx(10.0 + 40.0 * math.sin(angle), abs=0.01)
    assert car.y_m == pytest.approx(40.0 * (1.0 - math.cos(angle)), abs=0.01)
    assert car.heading_rad == pytest.approx(angle, abs=math.radians(1.0))


def test_the_papers_offset_is_drawn_from_its_range_by_the_seed() -> None:
    offsets = [added(scene(), PAPER, seed=seed)[0].y_m for seed in range(40)]
    assert len(set(offsets)) > 30
    assert 0.0 <= min(offsets) < 0.3
    assert 1.2 < max(offsets) <= 1.5
    assert all(added(scene(), PAPER, seed=seed)[0].x_m == 21.4 for seed in range(5))


@pytest.mark.parametrize(
    ("lateral", "y_m"),
    [
        (towards(LEFT_EDGE, how=Nearness.SLIGHTLY), 0.75),
        (towards(RIGHT_EDGE, how=Nearness.SLIGHTLY), -0.75),
        (towards(RIGHT_EDGE), -0.75),
        (towards(RIGHT_EDGE, 1.3), -1.3),
        (towards(LEFT_EDGE, how=Nearness.AT_EDGE), 0.65),
        (towards(LateralTarget.KERB, how=Nearness.AT_EDGE), -0.65),
        (towards(LateralTarget.CENTRE_LINE, how=Nearness.SLIGHTLY), 0.75),
        (towards(LateralTarget.KERB, how=Nearness.HALF_OUT), -1.75),
    ],
)
def test_sides_are_those_of_the_ego_and_the_kerb_that_of_the_map(
    lateral: Lateral, y_m: float
) -> None:
    (car,) = added(scene(), parked(lateral=lateral))
    assert (car.x_m, car.y_m) == (21.4, y_m)


def test_where_people_drive_on_the_left_the_kerb_is_on_the_left() -> None:
    (car,) = added(
        scene(traffic_side=TrafficSide.LEFT),
        parked(lateral=towards(LateralTarget.KERB, how=Nearness.AT_EDGE)),
    )
    assert car.y_m == 0.65


def test_a_car_in_the_oncoming_lane_faces_as_its_lane_leads() -> None:
    (car,) = added(scene(), parked(50.0, lane=LaneChoice.ONCOMING, speed_mps=10.0))
    assert (car.x_m, car.y_m, car.lane_id, car.speed_mps) == (50.0, 3.5, "Lane2", 10.0)
    assert abs(car.heading_rad) == pytest.approx(math.pi, abs=1e-4)


def test_a_place_that_is_taken_is_refused() -> None:
    busy = scene(agents=(vehicle("Agent2", 21.0, 0.0),))
    assert "it would stand in Agent2" in refusal(busy, parked())
    assert "in the ego" in refusal(scene(), parked(2.0))


def on_shoulder(target: LateralTarget) -> Lateral:
    return Lateral(target=target, nearness=Nearness.HALF_OUT, on_shoulder=True)


@pytest.mark.parametrize(
    ("shown", "intent", "reason"),
    [
        (scene(), parked(160.0), "The lanes end 100 m ahead of the ego"),
        (scene(), parked(-60.0), "The lanes end 50 m behind the ego"),
        (scene(), parked(lane=LaneChoice.LEFT), "no lane on the left"),
        (curve(), parked(lane=LaneChoice.ONCOMING), "no oncoming lane"),
        (scene(), parked(lateral=on_shoulder(LEFT_EDGE)), "no shoulder on the left"),
        (scene(), parked(lateral=towards(LEFT_EDGE, 9.0)), "leaves the lane"),
        (three_lanes(), parked(lateral=on_shoulder(LateralTarget.KERB)), "another lane"),
        (scene(lanes=()), parked(), "stands on no lane"),
        (scene(), cones(90.0, 30, Shape.TAPER), "The lanes end"),
        (scene(), crash(30.0, 2, settings=(Setting.IN_INTERSECTION,)), "not in the intersection"),
        (
            junction(),
            walk(30.0, Side.LEFT, Setting.BEFORE_INTERSECTION),
            "not before the intersection",
        ),
        (scene(), cones(20.0, 5, Shape.TAPER, spacing=metres(0.2)), "stand in each other"),
    ],
)
def test_what_the_map_has_no_room_for_is_refused(
    shown: Scene, intent: Intent, reason: str
) -> None:
    if shown.lanes == ():
        shown = replace(shown, ego=replace(shown.ego, lane_id=None))
    assert reason in refusal(shown, intent)


def opened(intent: Intent, **parts: object) -> Intent:
    (request,) = intent.requests
    return Intent(requests=(replace(request, **parts),))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("intent", "what"),
    [
        (opened(parked(), spot=Spot(lane=LaneChoice.OWN)), "the distance"),
        (opened(parked(), speed_mps=None), "whether they stand or how fast they drive"),
        (opened(parked(), count=None), "the count"),
        (walk(18.0, None), "the side that they come from"),
        (opened(cones(20.0, 5, Shape.RING), shape=None), "the shape"),
        (opened(crash(20.0, 2), count=None), "the count"),
    ],
)
def test_what_an_intent_leaves_open_is_never_guessed(intent: Intent, what: str) -> None:
    assert f"leaves open {what}" in refusal(scene(), intent)


def test_a_distance_from_another_object_runs_from_where_that_one_is() -> None:
    bus = VehicleRequest(spot=spot(20.0), name="bus", body=Body.BUS, count=1, speed_mps=0.0)
    walker = WalkRequest(
        spot=Spot(distance=metres(6.0), relation=Relation.AHEAD, anchor="bus"),
        start=Side.LEFT,
        count=1,
    )
    _, crossing = added(scene(), Intent(requests=(bus, walker)))
    assert crossing.x_m == 26.0
