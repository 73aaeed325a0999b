"""Sentences and what they ask for."""

from __future__ import annotations

import pytest

from augment.instruction import parse
from augment.instruction.intent import (
    Body,
    ConesRequest,
    CrashRequest,
    Facing,
    LaneChoice,
    LateralTarget,
    Length,
    Nearness,
    Relation,
    Setting,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)

PAPER = (
    "add a parked vehicle in front of/in the travel direction of ego at an approx. distance 21.4m "
    "away from ego. Assume a slight offset (anything randomly between 0 to 1.5m) from lane center "
    "points as it is parked slightly towards the left lane boundary."
)


def one_vehicle(text: str) -> VehicleRequest:
    (request,) = parse(text).requests
    assert isinstance(request, VehicleRequest)
    return request


def test_the_papers_sentence_is_read_in_full() -> None:
    intent = parse(PAPER)
    request = one_vehicle(PAPER)
    assert request.body is Body.VEHICLE
    assert request.spot.distance == Length(low_m=21.4, high_m=21.4, is_approximate=True)
    assert request.spot.relation is Relation.AHEAD
    assert request.spot.lateral.target is LateralTarget.LEFT_BOUNDARY
    assert request.spot.lateral.offset == Length(low_m=0.0, high_m=1.5)
    assert "a parked vehicle" in intent.understood
    assert intent.ignored == ()
    assert intent.assumed == ("in the ego's lane",)


def test_slightly_without_a_number_is_a_named_default() -> None:
    text = (
        "add a parked vehicle in front of ego at about 21.4 m, "
        "slightly towards the left lane boundary"
    )
    assert one_vehicle(text).spot.lateral.nearness is Nearness.SLIGHTLY
    assert one_vehicle(text).spot.lateral.offset is None
    assert "slightly means 0.75 m" in parse(text).assumed


def test_what_the_ego_should_do_is_read_and_places_nothing() -> None:
    intent = parse("Park a car 24 m ahead, so that the ego has to nudge around it.")
    assert intent.ignored == ("so that the ego has to nudge around it",)


@pytest.mark.parametrize(
    ("text", "body", "metres", "relation", "lane"),
    [
        ("add a parked car 20 m ahead", Body.CAR, 20.0, Relation.AHEAD, LaneChoice.OWN),
        (
            "a van is parked 18 metres in front of the ego vehicle in the ego's lane",
            Body.VAN,
            18.0,
            Relation.AHEAD,
            LaneChoice.OWN,
        ),
        (
            "a stopped truck 30 m ahead in the left lane",
            Body.TRUCK,
            30.0,
            Relation.AHEAD,
            LaneChoice.LEFT,
        ),
        (
            "a bus has stopped in the right lane twelve meters behind the ego",
            Body.BUS,
            12.0,
            Relation.BEHIND,
            LaneChoice.RIGHT,
        ),
        (
            "a parked car in the oncoming lane 100 ft ahead",
            Body.CAR,
            30.48,
            Relation.AHEAD,
            LaneChoice.ONCOMING,
        ),
        (
            "a car stands in the lane of the oncoming traffic, 25 m ahead",
            Body.CAR,
            25.0,
            Relation.AHEAD,
            LaneChoice.ONCOMING,
        ),
    ],
)
def test_bodies_distances_and_lanes(
    text: str, body: Body, metres: float, relation: Relation, lane: LaneChoice
) -> None:
    request = one_vehicle(text)
    assert request.body is body
    assert request.spot.distance.low_m == pytest.approx(metres)
    assert (request.spot.relation, request.spot.lane) == (relation, lane)


@pytest.mark.parametrize(
    ("words", "target", "nearness"),
    [
        ("", LateralTarget.LANE_CENTRE, Nearness.SLIGHTLY),
        ("in the middle of the lane", LateralTarget.LANE_CENTRE, Nearness.SLIGHTLY),
        ("slightly to the right", LateralTarget.RIGHT_BOUNDARY, Nearness.SLIGHTLY),
        ("slightly left of the lane centre", LateralTarget.LEFT_BOUNDARY, Nearness.SLIGHTLY),
        ("close to the right lane marking", LateralTarget.RIGHT_BOUNDARY, Nearness.AT_EDGE),
        ("on the left side of the lane", LateralTarget.LEFT_BOUNDARY, Nearness.AT_EDGE),
        ("at the kerb", LateralTarget.KERB, Nearness.AT_EDGE),
        ("slightly towards the centre line", LateralTarget.CENTRE_LINE, Nearness.SLIGHTLY),
        ("partly on the shoulder", LateralTarget.KERB, Nearness.HALF_OUT),
        ("on the left shoulder", LateralTarget.LEFT_BOUNDARY, Nearness.OUTSIDE),
    ],
)
def test_sides_of_the_lane(words: str, target: LateralTarget, nearness: Nearness) -> None:
    lateral = one_vehicle(f"add a parked car 20 m ahead of the ego, {words}").spot.lateral
    assert (lateral.target, lateral.nearness) == (target, nearness)


@pytest.mark.parametrize(
    ("words", "low_m", "high_m"),
    [
        ("offset 1.3 m from the lane centre towards the left lane boundary", 1.3, 1.3),
        ("shifted by 0.5 m to the left", 0.5, 0.5),
        ("between 0.5 and 1 m from the lane centre towards the left boundary", 0.5, 1.0),
        ("0.4 m left of the lane centre", 0.4, 0.4),
    ],
)
def test_offsets_with_numbers(words: str, low_m: float, high_m: float) -> None:
    lateral = one_vehicle(f"a parked car 20 m ahead of the ego, {words}").spot.lateral
    assert lateral.target is LateralTarget.LEFT_BOUNDARY
    assert lateral.offset == Length(low_m=low_m, high_m=high_m)


@pytest.mark.parametrize(
    ("words", "facing", "turn_deg", "speed_mps"),
    [
        ("stands, facing the same way as the ego", Facing.WITH_LANE, 0.0, 0.0),
        ("is parked facing the ego", Facing.AGAINST_LANE, 0.0, 0.0),
        ("is parked across the lane", Facing.ACROSS, 0.0, 0.0),
        ("stands turned by 30 degrees to the right", Facing.WITH_LANE, -30.0, 0.0),
        ("is moving at 36 km/h", Facing.WITH_LANE, 0.0, 10.0),
        ("drives at 8 m/s", Facing.WITH_LANE, 0.0, 8.0),
    ],
)
def test_headings_and_motion(
    words: str, facing: Facing, turn_deg: float, speed_mps: float
) -> None:
    request = one_vehicle(f"a car {words}, 20 m ahead of the ego")
    assert (request.facing, request.turn_deg) == (facing, turn_deg)
    assert request.speed_mps == pytest.approx(speed_mps)


def test_an_oncoming_car_drives_in_the_oncoming_lane() -> None:
    request = one_vehicle("An oncoming car approaches at 10 m/s, 50 m ahead.")
    assert (request.spot.lane, request.speed_mps) == (LaneChoice.ONCOMING, 10.0)


@pytest.mark.parametrize(
    ("text", "start", "count"),
    [
        ("a pedestrian crosses the road from right to left 18 m ahead", Side.RIGHT, 1),
        ("a jaywalker steps off the left walkway 18 m ahead of the ego", Side.LEFT, 1),
        ("two pedestrians cross from the left side to the right side 18 m ahead", Side.LEFT, 2),
        ("a pedestrian walks across the street from the left kerb, 18 m ahead", Side.LEFT, 1),
        (
            "a jaywalking pedestrian 18 m ahead goes across the road to the left side of the road",
            Side.RIGHT,
            1,
        ),
    ],
)
def test_crossings(text: str, start: Side, count: int) -> None:
    (request,) = parse(text).requests
    assert isinstance(request, WalkRequest)
    assert (request.start, request.count) == (start, count)
    assert request.spot.distance.low_m == 18.0


def test_surroundings_are_kept_as_conditions() -> None:
    (request,) = parse(
        "a jaywalker crosses from left to right 16 m ahead, before the intersection and away from "
        "the crosswalk"
    ).requests
    assert request.spot.settings == (Setting.BEFORE_INTERSECTION, Setting.OFF_CROSSWALK)


@pytest.mark.parametrize(
    ("text", "shape", "count", "spacing_m", "start", "has_worker"),
    [
        (
            "a taper of 6 cones from the left lane boundary towards the right one, 2 m apart",
            Shape.TAPER,
            6,
            2.0,
            Side.LEFT,
            False,
        ),
        ("a line of four cones along the kerb and one worker", Shape.LINE, 4, 2.5, None, True),
        (
            "a ring of 8 cones around a worker, 3 m between the cones",
            Shape.RING,
            8,
            3.0,
            None,
            True,
        ),
        ("a construction zone with 5 traffic cones", Shape.TAPER, 5, 2.5, None, True),
        ("roadworks", Shape.TAPER, 6, 2.5, None, True),
    ],
)
def test_cones(
    text: str, shape: Shape, count: int, spacing_m: float, start: Side | None, has_worker: bool
) -> None:
    (request,) = parse(f"Add {text}, starting 20 m ahead of the ego.").requests
    assert isinstance(request, ConesRequest)
    assert (request.shape, request.count, request.start) == (shape, count, start)
    assert request.spacing.low_m == spacing_m
    assert request.has_worker is has_worker


@pytest.mark.parametrize(
    ("text", "count", "turn_deg"),
    [
        ("Two cars have crashed 30 m ahead in the ego's lane", 2, None),
        ("an accident of three cars, the nearest one 30 m ahead", 3, None),
        ("two crashed cars 30 m ahead, at an angle of 80 degrees", 2, 80.0),
        ("a collision between four vehicles 30 m ahead of the ego", 4, None),
    ],
)
def test_accidents(text: str, count: int, turn_deg: float | None) -> None:
    (request,) = parse(text).requests
    assert isinstance(request, CrashRequest)
    assert (request.count, request.turn_deg) == (count, turn_deg)


def test_two_objects_have_a_place_each() -> None:
    car, walk = parse(
        "Add a parked car 20 m ahead and a pedestrian who crosses the road from left to right "
        "30 m ahead. The car is parked close to the right lane boundary."
    ).requests
    assert isinstance(car, VehicleRequest)
    assert isinstance(walk, WalkRequest)
    assert (car.spot.distance.low_m, walk.spot.distance.low_m) == (20.0, 30.0)
    assert car.spot.lateral.nearness is Nearness.AT_EDGE
