"""What was asked for, in so many words, against what is there: a straight two-way street."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.checks import Finding, Ground, Kind, Severity
from augment.checks.against_intent import judged
from augment.instruction import parse
from augment.scene.entities import AgentType, TrafficAgent, TrafficSide
from augment.scene.modification import Modification
from tests.scenes import cone, curve, pedestrian, scene, vehicle

CAR = "Add a parked car 20 m ahead of the ego, 1.2 m to the left of the lane centre."
MIDDLE = "A car is parked in the centre of the ego's lane 20 m ahead of the ego."
FACING = "A car is parked 20 m ahead of the ego, facing the ego."
WALK = "A pedestrian crosses the road from left to right, 20 m ahead of the ego."
CRASH = "Two cars have crashed in the ego's lane 20 m ahead, at an angle of 40 degrees."
LINE = "A line of 3 cones along the right lane boundary, 2.5 m apart, starting 20 m ahead."
BUS = "Park a bus in the ego's lane 35 m ahead, so that the ego must overtake it."
DRIVING = "Add a car driving at 8 m/s 30 m ahead of the ego."
ONCOMING = "Park a car in the oncoming lane, 20 m ahead of the ego."

ACROSS = (pedestrian("Agent2", 20.0, 6.0, (20.0, -3.0)),)
CARS = (vehicle("Agent2", 20.0, 0.0), vehicle("Agent3", 24.5, 0.0, math.radians(40.0)))
CONES = tuple(cone(f"Agent{n + 2}", 20.0 + 2.5 * n, -1.5) for n in range(3))
A_BUS = replace(vehicle("Agent2", 35.0, 0.0), type=AgentType.BUS, length_m=7.456, width_m=2.079)


def held(instruction: str, *added: TrafficAgent) -> tuple[Finding, ...]:
    return judged(Ground.of(scene()), Modification(added=added), parse(instruction))


def faults(instruction: str, *added: TrafficAgent) -> set[Kind]:
    return {one.kind for one in held(instruction, *added) if one.is_fault}


@pytest.mark.parametrize(
    ("instruction", "added"),
    [
        (CAR, (vehicle("Agent2", 20.0, 1.2),)),
        (CAR, (vehicle("Agent2", 22.0, 0.6, math.radians(10.0)),)),
        (MIDDLE, (vehicle("Agent2", 18.0, 0.9),)),
        (FACING, (vehicle("Agent2", 20.0, 0.0, math.pi),)),
        (WALK, ACROSS),
        (CRASH, CARS),
        (LINE, CONES),
        (BUS, (A_BUS,)),
        (BUS, (replace(A_BUS, type=AgentType.VEHICLE),)),
        (DRIVING, (replace(vehicle("Agent2", 30.0, 0.0), speed_mps=9.0),)),
        (ONCOMING, (vehicle("Agent2", 20.0, 3.5, math.pi),)),
    ],
)
def test_what_is_as_asked_for_has_no_fault(
    instruction: str, added: tuple[TrafficAgent, ...]
) -> None:
    assert faults(instruction, *added) == set()


@pytest.mark.parametrize(
    ("instruction", "added", "kind"),
    [
        (CAR, (vehicle("Agent2", 23.0, 1.2),), Kind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", 17.0, 1.2),), Kind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", -20.0, 1.2),), Kind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", 20.0, 2.4),), Kind.ASKED_ACROSS),
        (CAR, (vehicle("Agent2", 20.0, -1.2),), Kind.ASKED_SIDE),
        (CAR, (vehicle("Agent2", 20.0, 1.2, 0.4),), Kind.ASKED_HEADING),
        (CAR, (vehicle("Agent2", 20.0, 1.2, math.pi),), Kind.ASKED_HEADING),
        (CAR, (replace(vehicle("Agent2", 20.0, 1.2), speed_mps=4.0),), Kind.ASKED_MOTION),
        (CAR, (), Kind.ASKED_COUNT),
        (CAR, (vehicle("Agent2", 20.0, 1.2), vehicle("Agent3", 40.0, 0.0)), Kind.ASKED_COUNT),
        (CAR, (cone("Agent2", 20.0, 1.2),), Kind.ASKED_TYPE),
        (MIDDLE, (vehicle("Agent2", 20.0, 1.2),), Kind.ASKED_ACROSS),
        (FACING, (vehicle("Agent2", 20.0, 0.0),), Kind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 30.0, 6.0, (30.0, -3.0)),), Kind.ASKED_DISTANCE),
        (WALK, (pedestrian("Agent2", 20.0, -3.0, (20.0, 6.0)),), Kind.ASKED_SIDE),
        (WALK, (replace(ACROSS[0], heading_rad=math.pi / 2.0),), Kind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, 15.0)),), Kind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, 3.0)),), Kind.ASKED_CROSSING),
        (CRASH, CARS[:1], Kind.ASKED_COUNT),
        (CRASH, (CARS[0], replace(CARS[1], heading_rad=0.0)), Kind.ASKED_HEADING),
        (LINE, CONES[:2], Kind.ASKED_COUNT),
        (LINE, tuple(replace(one, y_m=1.5) for one in CONES), Kind.ASKED_SIDE),
        (LINE, tuple(replace(one, y_m=-2.6) for one in CONES), Kind.ASKED_ACROSS),
        (
            LINE,
            tuple(replace(one, x_m=20.0 + 2.0 * (one.x_m - 20.0)) for one in CONES),
            Kind.ASKED_SPACING,
        ),
        (BUS, (replace(A_BUS, type=AgentType.VEHICLE, length_m=4.8),), Kind.ASKED_TYPE),
        (DRIVING, (vehicle("Agent2", 30.0, 0.0),), Kind.ASKED_MOTION),
        (ONCOMING, (vehicle("Agent2", 20.0, 0.0, math.pi),), Kind.ASKED_ACROSS),
    ],
)
def test_what_is_not_as_asked_for_is_the_one_fault(
    instruction: str, added: tuple[TrafficAgent, ...], kind: Kind
) -> None:
    found = faults(instruction, *added)
    assert found - {Kind.WALK_HEADING} == {kind}


def test_a_finding_says_the_numbers() -> None:
    (distance,) = (
        one for one in held(CAR, vehicle("Agent2", 27.3, 1.2)) if one.kind is Kind.ASKED_DISTANCE
    )
    assert distance.severity is Severity.WRONG
    assert distance.measured["off_m"] == pytest.approx(7.3)
    assert distance.sentence() == (
        "Agent2 is 27.3 m ahead of the ego along its lane; 20 m ahead is asked for."
    )


def test_the_distance_is_counted_along_a_bend() -> None:
    ground = Ground.of(curve())
    bent = vehicle("Agent2", 10.0 + 40.0 * math.sin(0.5), 40.0 * (1.0 - math.cos(0.5)), 0.5)
    straight = vehicle("Agent2", 30.0, 0.0)
    said = parse("A car is parked in the centre of the ego's lane 30 m ahead of the ego.")
    kinds = [
        {one.kind for one in judged(ground, Modification(added=(agent,)), said) if one.is_fault}
        for agent in (bent, straight)
    ]
    assert kinds[0] == set()
    assert Kind.ASKED_ACROSS in kinds[1]


def test_the_kerb_is_where_the_map_says() -> None:
    said = parse(
        "Add a car parked 20 m ahead of the ego, 1.2 m from the lane centre towards the kerb."
    )
    for side, y_m in ((TrafficSide.RIGHT, -1.2), (TrafficSide.LEFT, 1.2)):
        ground = Ground.of(scene(traffic_side=side))
        found = judged(ground, Modification(added=(vehicle("Agent2", 20.0, y_m),)), said)
        assert not [one for one in found if one.is_fault]


def test_what_is_doubtful_is_settled_where_it_was_asked_for() -> None:
    agent = vehicle("Agent2", 20.0, 0.0, math.pi)
    alone = judged(Ground.of(scene()), Modification(added=(agent,)), None)
    assert [one.kind for one in alone if one.is_fault] == [Kind.HEADING]
    assert faults(FACING, agent) == set()


def test_who_was_in_the_scene_and_is_moved_or_removed_is_named() -> None:
    parked = vehicle("Agent2", 40.0, 0.0)
    ground = Ground.of(scene(agents=(parked,)))
    said, car = parse(CAR), vehicle("Agent3", 20.0, 1.2)
    for change in (
        Modification(added=(car,), removed=("Agent2",)),
        Modification(added=(car,), moved=(replace(parked, x_m=50.0),)),
    ):
        assert {one.kind for one in judged(ground, change, said) if one.is_fault} == {Kind.UNASKED}


def test_every_finding_has_a_sentence_that_stands_alone() -> None:
    for instruction in (CAR, WALK, CRASH, LINE, BUS):
        for added in ((), ACROSS, CARS, CONES, (A_BUS,), (*CARS, *CONES)):
            ids = {one.id for one in added}
            if len(ids) < len(added):
                continue
            for one in held(instruction, *added):
                assert "{" not in one.sentence()
                assert one.sentence().endswith(".")
