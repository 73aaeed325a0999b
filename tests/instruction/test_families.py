"""Families of phrasings: what people write for each of the five types, and what it asks for."""

from __future__ import annotations

from contextlib import suppress

import pytest

from augment.errors import InstructionNotUnderstood
from augment.instruction import parse
from augment.instruction.intent import (
    Bearing,
    Body,
    ConesRequest,
    CrashedCar,
    CrashRequest,
    Facing,
    LaneChoice,
    LateralTarget,
    Length,
    Post,
    Relation,
    Request,
    Setting,
    Shape,
    Side,
    VehicleRequest,
    WalkRequest,
)


def only_request(text: str) -> Request:
    (request,) = parse(text).requests
    return request


def metres(size_m: float) -> Length:
    return Length(low_m=size_m, high_m=size_m)


@pytest.mark.parametrize(
    ("text", "body", "ahead_m", "left_m"),
    [
        ("Park a red car 20 m ahead, 1.2 m right of the lane's centre line.", Body.CAR, 20, -1.2),
        ("There's a delivery van standing 25 metres ahead of us in our lane.", Body.VAN, 25, 0),
        ("A coach is parked 35 m in front, half a metre left of the centre.", Body.BUS, 35, 0.5),
        ("24 m ahead a car is standing in the ego's lane, right in the middle.", Body.CAR, 24, 0),
        ("A car, 1.0 m off-centre to the right, is parked 23 m ahead.", Body.CAR, 23, -1.0),
        ("Our lane is blocked by a bus 50 m ahead, 0.3 m right of the middle", Body.BUS, 50, -0.3),
        ("Put a car in the lane the ego is driving in, 27 m ahead, pulled over by 1.2 m to the "
         "right.", Body.CAR, 27, -1.2),
        ("A van has come to a stop 24 metres in front, shifted one and a half metres to the left.",
         Body.VAN, 24, 1.5),
        ("At twenty-one point five m ahead, a broken-down lorry is standing, 0.4 m to the right.",
         Body.TRUCK, 21.5, -0.4),
    ],
)  # fmt: skip
def test_vehicles(text: str, body: Body, ahead_m: float, left_m: float) -> None:
    request = only_request(text)
    assert isinstance(request, VehicleRequest)
    assert (request.body, request.spot.lane) == (body, LaneChoice.OWN)
    assert (request.spot.distance.low_m, request.spot.relation) == (ahead_m, Relation.AHEAD)
    lateral = request.spot.lateral
    size_m = lateral.offset.low_m if lateral.offset else 0.0
    assert (-size_m if lateral.target is LateralTarget.RIGHT_BOUNDARY else size_m) == left_m


@pytest.mark.parametrize(
    "words",
    [
        "so that the ego has to steer to the left",
        "the ego can squeeze past without leaving its lane",
        "forcing us to wait for the oncoming traffic",
        "and there is no way past it except over the other lane",
        "because of a breakdown",
        "so the ego must stop",
    ],
)
def test_what_is_said_about_the_ego_is_passed_over_and_reported(words: str) -> None:
    plain = parse("A car is parked 20 m ahead.")
    intent = parse(f"A car is parked 20 m ahead, {words}.")
    assert intent.requests == plain.requests
    assert intent.ignored


@pytest.mark.parametrize(
    "words",
    [
        "Keep the traffic as it is.",
        "Leave the other road users where they are.",
        "Oncoming traffic stays.",
        "All other vehicles remain unchanged.",
    ],
)
def test_kept_traffic_is_understood(words: str) -> None:
    plain = parse("A car is parked 20 m ahead.")
    intent = parse(f"{words} A car is parked 20 m ahead.")
    assert intent.requests == plain.requests
    assert intent.ignored == ()


@pytest.mark.parametrize(
    "hidden",
    [
        "so that the ego has to pass a bus",
        "so that the ego has to stop within 12 m",
        "so that it stands half on the shoulder",
    ],
)
def test_a_clause_that_places_something_is_never_passed_over(hidden: str) -> None:
    with suppress(InstructionNotUnderstood):
        intent = parse(f"A car is parked 20 m ahead, {hidden}.")
        assert not any(hidden in words for words in intent.ignored)


def test_a_row_of_vehicles() -> None:
    request = only_request("A row of four parked cars, 7 m apart, at the kerb 20 m ahead.")
    assert isinstance(request, VehicleRequest)
    assert (request.count, request.spacing) == (4, metres(7.0))


@pytest.mark.parametrize(
    ("text", "speed_mps", "ahead_m"),
    [
        ("Oncoming traffic: a truck drives at 36 km/h 80 m ahead.", 10.0, 80.0),
        ("A car comes from the opposite direction at ten metres per second, 60 m ahead.", 10, 60),
    ],
)
def test_oncoming_traffic(text: str, speed_mps: float, ahead_m: float) -> None:
    request = only_request(text)
    assert isinstance(request, VehicleRequest)
    assert request.spot.lane is LaneChoice.ONCOMING
    assert request.speed_mps == pytest.approx(speed_mps)
    assert request.spot.distance.low_m == ahead_m


def test_both_names_of_a_side_are_kept_for_the_map() -> None:
    request = only_request("a car 20 m ahead, 0.3 m off the lane centre on the kerb side (left)")
    assert request.spot.lateral.target is LateralTarget.LEFT_BOUNDARY
    assert request.spot.lateral.also is LateralTarget.KERB


@pytest.mark.parametrize(
    ("words", "setting"),
    [
        ("just past the intersection", Setting.AFTER_INTERSECTION),
        ("shortly before the junction", Setting.BEFORE_INTERSECTION),
        ("at the start of the bend", Setting.IN_BEND),
        ("in the gap between the parked cars on the left", Setting.BY_PARKED_LEFT),
        ("next to the parked cars", Setting.BY_PARKED),
    ],
)
def test_surroundings(words: str, setting: Setting) -> None:
    request = only_request(f"A car stands 20 m ahead of the ego {words}.")
    assert request.spot.settings == (setting,)


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (
            "Somebody walks across the street from left to right, 20 m in front of the ego.",
            {"start": Side.LEFT},
        ),
        (
            "A child leaves the sidewalk on the right 20 m ahead and crosses to the left.",
            {"start": Side.RIGHT},
        ),
        (
            "A person runs over the road from the left at 2 m/s, 20 m ahead.",
            {"start": Side.LEFT, "speed_mps": 2.0},
        ),
        (
            "From the right walkway 20 m ahead a walker cuts across the bend, diagonally to the "
            "left walkway, arriving 5 m further along the road.",
            {"start": Side.RIGHT, "drift_m": 5.0},
        ),
        (
            "Three people cross in a file from the left to the right; the first is already on the "
            "road 20 m ahead, the others follow 2.1 m and 5.7 m behind.",
            {
                "start": Side.LEFT,
                "count": 3,
                "is_file": True,
                "on_road": True,
                "behind": (metres(2.1), metres(5.7)),
            },
        ),
        (
            "20 m ahead, from between the parked cars on the right, a pedestrian steps out and "
            "crosses the road.",
            {"start": Side.RIGHT},
        ),
    ],
)
def test_walks(text: str, wanted: dict[str, object]) -> None:
    request = only_request(text)
    assert isinstance(request, WalkRequest)
    assert request.spot.distance == metres(20.0)
    assert {name: getattr(request, name) for name in wanted} == wanted


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (
            "Three cones stand in a row across our lane 20 m ahead, 1.6 m from one to the next, "
            "and a workman stands behind the row.",
            {"shape": Shape.ROW, "count": 3, "has_worker": True, "post": Post.BEHIND},
        ),
        (
            "The first of 5 cones is on the right boundary 20 m ahead, the last one in the middle "
            "of the lane, 2.6 m from cone to cone.",
            {"shape": Shape.TAPER, "count": 5, "start": Side.RIGHT, "ends_in_middle": True},
        ),
        (
            "A row of cones along the left lane boundary, starting 20 m ahead and ending 35 m "
            "ahead, 2.5 m apart.",
            {"shape": Shape.LINE, "count": 7, "reach_m": 15.0},
        ),
        (
            "Put 4 cones on each side of the lane, 3 m apart, starting 20 m ahead.",
            {"shape": Shape.LINE, "count": 4, "both_sides": True},
        ),
        (
            "The lane is closed 20 m ahead by eight cones in a ring with a worker inside.",
            {"shape": Shape.RING, "count": 8, "has_worker": True},
        ),
        (
            "Four cones line the kerb from 20 m on, a worker is on the right of the last cones.",
            {"shape": Shape.LINE, "post": Post.AT_LAST, "post_side": Side.RIGHT},
        ),
    ],
)
def test_cones(text: str, wanted: dict[str, object]) -> None:
    request = only_request(text)
    assert isinstance(request, ConesRequest)
    assert request.spot.distance.low_m == 20.0
    assert {name: getattr(request, name) for name in wanted} == wanted


@pytest.mark.parametrize(
    ("text", "others"),
    [
        (
            "Two cars have run into each other 30 m ahead, 4.5 m apart, at 40 degrees.",
            (CrashedCar(gap=metres(4.5), turn_deg=40.0),),
        ),
        (
            "A car stands in our lane 30 m ahead; another one has hit it on the right side and "
            "stands 3.3 m from it at an angle of 41 degrees.",
            (CrashedCar(gap=metres(3.3), bearing=Bearing.RIGHT, turn_deg=41.0),),
        ),
        (
            "Pile-up of three cars: the last car of the queue is 30 m ahead, the second 4.6 m in "
            "front of it and turned 25 degrees to the left, the third 4.2 m from the second.",
            (
                CrashedCar(gap=metres(4.6), turn_deg=25.0, is_signed=True),
                CrashedCar(gap=metres(4.2)),
            ),
        ),
        (
            "A head-on collision of two cars, the nearer one 30 m ahead.",
            (CrashedCar(turn_deg=180.0),),
        ),
    ],
)
def test_accidents_car_by_car(text: str, others: tuple[CrashedCar, ...]) -> None:
    request = only_request(text)
    assert isinstance(request, CrashRequest)
    assert request.spot.distance == metres(30.0)
    assert request.count == len(others) + 1
    assert request.others == others


def test_a_car_behind_a_crosswise_one_is_the_second_of_the_accident() -> None:
    request = only_request(
        "A car stands crosswise 30 m ahead and the car behind it has crashed into it."
    )
    assert isinstance(request, CrashRequest)
    assert (request.count, request.facing) == (2, Facing.ACROSS)
    assert request.others == (CrashedCar(bearing=Bearing.BEHIND),)
