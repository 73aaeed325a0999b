"""What was asked for, in so many words, against what is there: a straight two-way street."""

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Ground, Severity
from augment.checks.registry import check_against_intent
from augment.scene import intent as wish
from augment.scene.entities import AgentType, Modification, Scene, TrafficAgent, TrafficSide
from tests.checks.worlds import faults_against
from tests.fixtures.shelf import AUTHORED
from tests.intents import (
    CENTRED,
    LEFT_EDGE,
    RIGHT_EDGE,
    cones,
    crash,
    metres,
    parked,
    spot,
    towards,
    walk,
)
from tests.scenes import cone, curve, pedestrian, scene, vehicle

CAR = parked(20.0, lateral=towards(LEFT_EDGE, 1.2))
MIDDLE = parked(20.0, lateral=CENTRED)
FACING = parked(20.0, facing=wish.Facing.AGAINST_LANE)
WALK = walk(20.0, wish.Side.LEFT)
CRASH = crash(20.0, 2, wish.CrashedCar(turn_deg=40.0))
_BESIDE = spot(20.0, lateral=towards(LEFT_EDGE, 1.2))
ASIDE = wish.Intent(requests=(replace(CRASH.requests[0], spot=_BESIDE),))
LINE = cones(20.0, 3, wish.Shape.LINE, lateral=towards(RIGHT_EDGE), spacing=metres(2.5))
BUS = parked(35.0, body=wish.Body.BUS)
DRIVING = parked(30.0, speed_mps=8.0)
ONCOMING = parked(20.0, lane=wish.LaneChoice.ONCOMING)
FILE = walk(20.0, wish.Side.LEFT, count=2, is_file=True, behind=(metres(3.0),))
SLANTED = walk(20.0, wish.Side.LEFT, drift_m=8.0)
NARROWED = cones(
    20.0, 3, wish.Shape.TAPER, start=wish.Side.RIGHT, ends_in_middle=True, has_worker=True
)

ACROSS = (pedestrian("Agent2", 20.0, 6.0, (20.0, -3.0)),)
CARS = (vehicle("Agent2", 20.0, 0.0), vehicle("Agent3", 24.5, 0.0, math.radians(40.0)))
IN_FILE = (
    pedestrian("Agent2", 20.0, 1.0, (20.0, -3.0)),
    pedestrian("Agent3", 20.0, 4.0, (20.0, -3.0)),
)
TAPER = (
    *(cone(f"Agent{n + 2}", 20.0 + 2.5 * n, 0.75 * n - 1.5) for n in range(3)),
    pedestrian("Agent5", 25.0, -2.0),
)
CONES = tuple(cone(f"Agent{n + 2}", 20.0 + 2.5 * n, -1.5) for n in range(3))
A_BUS = vehicle("Agent2", 35.0, 0.0, type=AgentType.BUS, length_m=7.456, width_m=2.079)
CLOSED = parked(20.0, body=wish.Body.BARRIER, facing=wish.Facing.ACROSS)
A_BAR = vehicle("Agent2", 20.0, 0.0, type=AgentType.BARRIER, length_m=0.6)


def faults(
    intent: wish.Intent | None, *added: TrafficAgent, where: Scene | None = None
) -> set[FindingKind]:
    found = faults_against(where or scene(), Modification(added=added), intent)
    return {one.kind for one in found}


def test_what_is_as_asked_for_has_no_fault() -> None:
    for intent, added in (
        (CAR, (vehicle("Agent2", 20.0, 1.2),)),
        (CAR, (vehicle("Agent2", 22.0, 0.6, math.radians(10.0)),)),
        (MIDDLE, (vehicle("Agent2", 18.0, 0.9),)),
        (FACING, (vehicle("Agent2", 20.0, 0.0, math.pi),)),
        *((WALK, ACROSS), (CRASH, CARS), (LINE, CONES), (BUS, (A_BUS,))),
        (BUS, (replace(A_BUS, type=AgentType.VEHICLE),)),
        (DRIVING, (vehicle("Agent2", 30.0, 0.0, speed_mps=9.0),)),
        (ONCOMING, (vehicle("Agent2", 20.0, 3.5, math.pi),)),
        (FILE, IN_FILE),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, -0.9)),)),  # the road ends 0.85 m on
        (SLANTED, (pedestrian("Agent2", 20.0, 6.0, (28.0, -3.0)),)),
        (walk(20.0, wish.Side.LEFT, end=CENTRED), (pedestrian("Agent2", 20.0, 6.0, (20.0, 0.3)),)),
        (NARROWED, TAPER),
        *((CLOSED, (A_BAR,)), (CLOSED, (replace(A_BAR, heading_rad=math.pi),))),
    ):
        assert faults(intent, *added) == set()


@pytest.mark.parametrize(
    ("intent", "added", "kind"),
    [
        (CAR, (vehicle("Agent2", 23.0, 1.2),), FindingKind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", 17.0, 1.2),), FindingKind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", -20.0, 1.2),), FindingKind.ASKED_DISTANCE),
        (CAR, (vehicle("Agent2", 20.0, 2.4),), FindingKind.ASKED_ACROSS),
        (CAR, (vehicle("Agent2", 20.0, -1.2),), FindingKind.ASKED_SIDE),
        (CAR, (vehicle("Agent2", 20.0, 1.2, 0.4),), FindingKind.ASKED_HEADING),
        (CAR, (vehicle("Agent2", 20.0, 1.2, math.pi),), FindingKind.ASKED_HEADING),
        (CAR, (vehicle("Agent2", 20.0, 1.2, speed_mps=4.0),), FindingKind.ASKED_MOTION),
        (CAR, (), FindingKind.ASKED_COUNT),
        (CAR, (vehicle("Agent2", 20.0, 1.2), vehicle("Agent3", 40.0, 0.0)),
         FindingKind.ASKED_COUNT),
        (CAR, (cone("Agent2", 20.0, 1.2),), FindingKind.ASKED_TYPE),
        (MIDDLE, (vehicle("Agent2", 20.0, 1.2),), FindingKind.ASKED_ACROSS),
        (FACING, (vehicle("Agent2", 20.0, 0.0),), FindingKind.ASKED_HEADING),
        (CLOSED, (replace(A_BAR, heading_rad=math.pi / 2.0),), FindingKind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 30.0, 6.0, (30.0, -3.0)),), FindingKind.ASKED_DISTANCE),
        (WALK, (pedestrian("Agent2", 20.0, -3.0, (20.0, 6.0)),), FindingKind.ASKED_SIDE),
        (WALK, (replace(ACROSS[0], heading_rad=math.pi / 2.0),), FindingKind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, 15.0)),), FindingKind.ASKED_HEADING),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, 3.0)),), FindingKind.ASKED_CROSSING),
        (WALK, (pedestrian("Agent2", 20.0, 6.0, (20.0, -0.5)),), FindingKind.ASKED_CROSSING),
        (CRASH, CARS[:1], FindingKind.ASKED_COUNT),
        (ASIDE, CARS, FindingKind.ASKED_ACROSS),
        (CRASH, (CARS[0], replace(CARS[1], heading_rad=0.0)), FindingKind.ASKED_HEADING),
        (LINE, CONES[:2], FindingKind.ASKED_COUNT),
        (LINE, tuple(replace(one, y_m=1.5) for one in CONES), FindingKind.ASKED_SIDE),
        (LINE, tuple(replace(one, y_m=-2.6) for one in CONES), FindingKind.ASKED_ACROSS),
        (LINE, tuple(replace(one, x_m=20.0 + 2.0 * (one.x_m - 20.0)) for one in CONES),
         FindingKind.ASKED_SPACING),
        (BUS, (replace(A_BUS, type=AgentType.VEHICLE, length_m=4.8),), FindingKind.ASKED_TYPE),
        (DRIVING, (vehicle("Agent2", 30.0, 0.0),), FindingKind.ASKED_MOTION),
        (ONCOMING, (vehicle("Agent2", 20.0, 0.0, math.pi),), FindingKind.ASKED_ACROSS),
        (FILE, (IN_FILE[0], replace(IN_FILE[1], y_m=5.5)), FindingKind.ASKED_SPACING),
        (SLANTED, (pedestrian("Agent2", 20.0, 6.0, (20.0, -3.0)),), FindingKind.ASKED_DISTANCE),
        (NARROWED, (*TAPER[:2], replace(TAPER[2], y_m=1.5), TAPER[3]), FindingKind.ASKED_ACROSS),
        (NARROWED, (*TAPER[:3], replace(TAPER[3], y_m=-7.0)), FindingKind.ASKED_SPACING),
        (cones(20.0, 3, wish.Shape.TAPER, start=wish.Side.LEFT), TAPER[:3],
         FindingKind.ASKED_SIDE),
        (cones(20.0, 2, wish.Shape.ROW), (cone("Agent2", 20.0, 0.2), cone("Agent3", 21.0, 0.0)),
         FindingKind.ASKED_ACROSS),
        (cones(20.0, 2, wish.Shape.LINE), (cone("Agent2", 20.0, 0.5), cone("Agent3", 20.4, -0.5)),
         FindingKind.ASKED_ACROSS),
    ],
)  # fmt: skip
def test_what_is_not_as_asked_for_is_the_one_fault(
    intent: wish.Intent, added: tuple[TrafficAgent, ...], kind: FindingKind
) -> None:
    found = faults(intent, *added)
    assert found - {FindingKind.WALK_HEADING} == {kind}


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("wrong_way_m", "kind"),
    [
        *((0.44, FindingKind.ASKED_ACROSS), (0.46, FindingKind.ASKED_SIDE)),
        *((1.2, FindingKind.ASKED_SIDE), (1.94, FindingKind.ASKED_SIDE)),
        (1.96, FindingKind.ASKED_ACROSS),
    ],
)
def test_sides_are_exchanged_within_the_tolerance_of_the_place_across(
    sign: float, wrong_way_m: float, kind: FindingKind
) -> None:
    # 1.2 m to one side is asked for, 0.75 m off is let pass: so is it on the other side.
    asked = parked(20.0, lateral=towards(LEFT_EDGE if sign > 0.0 else RIGHT_EDGE, 1.2))
    found = faults(asked, vehicle("Agent2", 20.0, -sign * wrong_way_m))
    assert found & {FindingKind.ASKED_ACROSS, FindingKind.ASKED_SIDE} == {kind}


@pytest.mark.parametrize(
    ("asked_m", "off_m", "is_fault"),
    [
        (20.0, 2.49, False),
        (20.0, 2.5, False),
        (20.0, 2.51, True),
        # 5 % is more from 50 m on.
        (60.0, 2.99, False),
        (60.0, 3.0, False),
        (60.0, 3.01, True),
    ],
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_distance_may_be_off_by_the_whole_tolerance(
    sign: float, asked_m: float, off_m: float, is_fault: bool
) -> None:
    found = faults(
        parked(asked_m, lateral=CENTRED), vehicle("Agent2", asked_m + sign * off_m, 0.0)
    )
    assert (FindingKind.ASKED_DISTANCE in found) == is_fault


@pytest.mark.parametrize(
    ("off_deg", "is_fault"), [(0.0, False), (14.9, False), (15.1, True), (90.0, True)]
)
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    ("facing", "lane_deg"), [(wish.Facing.WITH_LANE, 0.0), (wish.Facing.AGAINST_LANE, 180.0)]
)
def test_a_vehicle_may_be_turned_by_fifteen_degrees(
    facing: wish.Facing, lane_deg: float, sign: float, off_deg: float, is_fault: bool
) -> None:
    heading_rad = math.remainder(math.radians(lane_deg + sign * off_deg), math.tau)
    found = faults(parked(20.0, facing=facing), vehicle("Agent2", 20.0, 0.0, heading_rad))
    assert (FindingKind.ASKED_HEADING in found) == is_fault


def test_a_finding_says_the_numbers() -> None:
    change = Modification(added=(vehicle("Agent2", 27.3, 1.2),))
    (distance,) = faults_against(scene(), change, CAR)
    assert distance.severity is Severity.WRONG
    assert distance.measured["off"] == pytest.approx(7.3)
    assert distance.sentence() == (
        "The distance of Agent2 ahead along the ego's lane is 27.30 m; 20 m is asked for."
    )


def test_the_distance_is_counted_along_a_bend() -> None:
    bent = vehicle("Agent2", 10.0 + 40.0 * math.sin(0.5), 40.0 * (1.0 - math.cos(0.5)), 0.5)
    straight = vehicle("Agent2", 30.0, 0.0)
    said = parked(30.0, lateral=CENTRED)
    assert faults(said, bent, where=curve()) == set()
    assert FindingKind.ASKED_ACROSS in faults(said, straight, where=curve())


def test_the_kerb_is_where_the_map_says() -> None:
    said = parked(20.0, lateral=towards(wish.LateralTarget.KERB, 1.2))
    for side, y_m in ((TrafficSide.RIGHT, -1.2), (TrafficSide.LEFT, 1.2)):
        where = scene(traffic_side=side)
        assert faults(said, vehicle("Agent2", 20.0, y_m), where=where) == set()


def test_what_is_doubtful_is_settled_where_it_was_asked_for() -> None:
    agent = vehicle("Agent2", 20.0, 0.0, math.pi)
    assert faults(None, agent) == {FindingKind.HEADING}
    assert faults(FACING, agent) == set()


def test_what_is_open_is_held_against_nothing() -> None:
    somewhere = wish.Intent(requests=(replace(CAR.requests[0], spot=wish.Spot(), speed_mps=None),))
    here = vehicle("Agent2", 47.0, 0.4, speed_mps=3.0)
    assert faults(somewhere, here) == set()


def test_any_number_answers_an_open_count_but_none_does_not() -> None:
    (request,) = LINE.requests
    some = wish.Intent(requests=(replace(request, count=None),))
    assert faults(some, *CONES) == set()
    assert faults(some, *CONES[:2]) == set()
    assert faults(some) == {FindingKind.ASKED_COUNT}


def test_ahead_without_a_number_is_anywhere_ahead() -> None:
    (request,) = MIDDLE.requests
    where = replace(request.spot, distance=None)
    ahead = wish.Intent(requests=(replace(request, spot=where),))
    assert faults(ahead, vehicle("Agent2", 47.0, 0.0)) == set()
    assert faults(ahead, vehicle("Agent2", -20.0, 0.0)) == {FindingKind.ASKED_DISTANCE}


def test_a_row_is_measured_from_centre_to_centre_along_its_lane_or_straight() -> None:
    row = parked(20.0, count=3, spacing=metres(8.0))
    cars = [vehicle(f"Agent{n + 2}", 20.0 + 8.0 * n, 0.0) for n in range(3)]
    assert faults(row, *cars) == set()
    gaps = [vehicle(f"Agent{n + 2}", 20.0 + 12.8 * n, 0.0) for n in range(3)]  # 8 m between boxes
    assert FindingKind.ASKED_SPACING in faults(row, *gaps)


def test_cones_around_a_sharp_bend_are_apart_along_the_lane() -> None:
    """On a circle of 6 m, 5 m along the lane are 4.8 m straight, and 3.8 m at its inner edge."""
    bend, wanted = curve(6.0), metres(5.0)
    line = cones(12.5, 3, wish.Shape.LINE, lateral=towards(LEFT_EDGE), spacing=wanted)
    angles = [(2.5 + 5.0 * n) / 6.0 for n in range(2)]
    inner = [(10.0 + 4.25 * math.sin(a), 6.0 - 4.25 * math.cos(a)) for a in angles]
    added = [cone(f"Agent{n + 2}", *place) for n, place in enumerate([(7.5, 1.75), *inner])]
    found = check_against_intent(Ground.of(bend), Modification(added=tuple(added)), line, AUTHORED)
    (spacing,) = [one for one in found if one.kind is FindingKind.ASKED_SPACING]
    assert not spacing.is_fault
    assert spacing.measured["value"] == pytest.approx(5.0, abs=0.1)


SPOT = wish.Spot(distance=wish.Length(low_m=25.0, high_m=25.0), relation=wish.Relation.AHEAD)
GAP = wish.Length(low_m=4.6, high_m=4.6)


def cars(*places: tuple[float, float, float]) -> tuple[TrafficAgent, ...]:
    """Cars by x, y and heading in degrees."""
    return tuple(
        vehicle(f"Agent{n}", x_m, y_m, math.radians(turn_deg))
        for n, (x_m, y_m, turn_deg) in enumerate(places, start=2)
    )


TURNED = tuple(wish.CrashedCar(gap=GAP, turn_deg=turn_deg) for turn_deg in (25.0, 60.0))
CHAIN = wish.CrashRequest(spot=SPOT, count=3, others=TURNED)
AFTER = wish.CrashedCar(gap=GAP, bearing=wish.Bearing.BEHIND, turn_deg=40.0)
BEHIND = wish.CrashRequest(spot=SPOT, count=2, others=(AFTER,))
PLAIN = wish.CrashRequest(spot=SPOT, count=2)
FURTHER = replace(CHAIN, others=(wish.CrashedCar(gap=GAP, turn_deg=80.0),) * 2)
FIRST_ACROSS = wish.CrashRequest(spot=SPOT, count=2, facing=wish.Facing.ACROSS)
AS_SAID = cars((25.0, 0.0, 0.0), (29.6, 0.0, 25.0), (34.2, 0.0, -35.0))


def test_how_crashed_cars_lie_to_each_other() -> None:
    for request_, added, kinds in (
        (CHAIN, AS_SAID, []),
        (CHAIN, (AS_SAID[2], *AS_SAID[:2]), []),  # the order of adding means nothing
        (CHAIN, (*AS_SAID[:2], replace(AS_SAID[2], heading_rad=0.5)), ["asked_heading"]),
        (CHAIN, (*AS_SAID[:2], replace(AS_SAID[2], x_m=38.5)), ["asked_spacing"]),
        (CHAIN, tuple(replace(one, x_m=one.x_m + 4.6) for one in AS_SAID), ["asked_distance"]),
        # Of cars on top of each other only that is told.
        (CHAIN, cars((25.0, 0.0, 0.0), (25.3, 0.0, 25.0), (34.2, 0.0, -35.0)), ["overlap"]),
        (BEHIND, cars((25.0, 0.0, 0.0), (20.4, 0.0, 40.0)), []),
        # The one behind is taken for the first.
        (BEHIND, cars((25.0, 0.0, 0.0), (29.6, 0.0, 40.0)), ["asked_distance"]),
        (PLAIN, cars((25.0, 0.0, 0.0), (29.9, 0.0, 10.0)), []),
        (PLAIN, cars((25.0, 0.0, 0.0), (33.0, 0.0, 10.0)), ["asked_spacing"]),
        (FURTHER, cars((25.0, 0.0, 0.0), (29.6, 0.0, 80.0), (27.7, 4.2, 0.0)), []),
        (FIRST_ACROSS, cars((25.0, 0.0, -80.0), (28.7, 0.0, 0.0)), []),
        (FIRST_ACROSS, cars((25.0, 0.0, 0.0), (29.9, 0.0, 0.0)), ["asked_heading"]),
    ):
        assert faults(wish.Intent(requests=(request_,)), *added) == set(kinds)
