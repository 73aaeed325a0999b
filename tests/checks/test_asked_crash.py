"""Who is which in a crash, and whether they lie as is said of them."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.checks import FindingKind, Ground
from augment.checks.registry import check_against_intent
from augment.scene.entities import Modification, TrafficAgent
from augment.scene.intent import (
    Bearing,
    CrashedCar,
    CrashRequest,
    Facing,
    Intent,
    Length,
    Relation,
    Spot,
)
from tests.scenes import scene, vehicle

SPOT = Spot(distance=Length(low_m=25.0, high_m=25.0), relation=Relation.AHEAD)
GAP = Length(low_m=4.6, high_m=4.6)


def cars(*places: tuple[float, float, float]) -> tuple[TrafficAgent, ...]:
    """Cars by x, y and heading in degrees."""
    return tuple(
        vehicle(f"Agent{n}", x_m, y_m, math.radians(turn_deg))
        for n, (x_m, y_m, turn_deg) in enumerate(places, start=2)
    )


def faults(request: CrashRequest, *added: TrafficAgent) -> set[FindingKind]:
    intent = Intent(requests=(request,))
    found = check_against_intent(Ground.of(scene()), Modification(added=added), intent)
    return {one.kind for one in found if one.is_fault}


CHAIN = CrashRequest(
    spot=SPOT,
    count=3,
    others=(CrashedCar(gap=GAP, turn_deg=25.0), CrashedCar(gap=GAP, turn_deg=60.0)),
)
BEHIND = CrashRequest(
    spot=SPOT, count=2, others=(CrashedCar(gap=GAP, bearing=Bearing.BEHIND, turn_deg=40.0),)
)
ACROSS = CrashRequest(spot=SPOT, count=2, facing=Facing.ACROSS)
AS_SAID = cars((25.0, 0.0, 0.0), (29.6, 0.0, 25.0), (34.2, 0.0, -35.0))


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 0, 1), (1, 2, 0)])
def test_the_order_in_which_they_were_added_means_nothing(order: tuple[int, ...]) -> None:
    assert faults(CHAIN, *(AS_SAID[n] for n in order)) == set()


def test_an_angle_that_is_not_as_said_is_a_heading() -> None:
    bent = (*AS_SAID[:2], replace(AS_SAID[2], heading_rad=math.radians(30.0)))
    assert faults(CHAIN, *bent) == {FindingKind.ASKED_HEADING}


def test_a_gap_that_is_not_as_said_is_a_place() -> None:
    apart = (*AS_SAID[:2], replace(AS_SAID[2], x_m=38.5))
    assert faults(CHAIN, *apart) == {FindingKind.ASKED_SPACING}


def test_the_whole_crash_too_far_on_is_one_fault_of_place() -> None:
    shifted = (replace(one, x_m=one.x_m + 4.6) for one in AS_SAID)
    assert faults(CHAIN, *shifted) == {FindingKind.ASKED_DISTANCE}


def test_a_car_behind_the_first_is_nearer_and_that_is_right() -> None:
    assert faults(BEHIND, *cars((25.0, 0.0, 0.0), (20.4, 0.0, 40.0))) == set()
    ahead = faults(BEHIND, *cars((25.0, 0.0, 0.0), (29.6, 0.0, 40.0)))
    assert ahead == {FindingKind.ASKED_DISTANCE}, "the one behind is taken for the first"


def test_cars_that_lie_across_the_street_from_each_other_have_not_crashed() -> None:
    plain = CrashRequest(spot=SPOT, count=2)
    assert faults(plain, *cars((25.0, 0.0, 0.0), (29.9, 0.0, 10.0))) == set()
    assert FindingKind.ASKED_SPACING in faults(plain, *cars((25.0, 0.0, 0.0), (33.0, 0.0, 10.0)))


def test_the_first_one_stands_across_where_that_is_said() -> None:
    across = cars((25.0, 0.0, -80.0), (28.7, 0.0, 0.0))
    assert faults(ACROSS, *across) == set()
    along = cars((25.0, 0.0, 0.0), (29.9, 0.0, 0.0))
    assert faults(ACROSS, *along) == {FindingKind.ASKED_HEADING}


def test_of_cars_on_top_of_each_other_only_that_is_told() -> None:
    heap = cars((25.0, 0.0, 0.0), (25.3, 0.0, 25.0), (34.2, 0.0, -35.0))
    assert faults(CHAIN, *heap) == {FindingKind.OVERLAP, FindingKind.DUPLICATE}
