"""Families: numbers drawn from the ranges of an intent, each member placed or refused."""

import pytest

from augment.baselines.family import sample_family
from augment.checks import Ground, Severity
from augment.checks.registry import check_against_intent
from augment.errors import CannotPlace
from augment.scene.intent import Intent, LaneChoice, Relation, Spot, VehicleRequest
from tests.intents import metres
from tests.scenes import scene


def cars(low_m: float, high_m: float) -> Intent:
    spot = Spot(distance=metres(low_m, high_m), relation=Relation.AHEAD, lane=LaneChoice.OWN)
    return Intent(requests=(VehicleRequest(spot=spot, speed_mps=0.0, count=1),))


def test_each_member_has_a_number_of_the_range_and_stands_where_it_says() -> None:
    members = sample_family(scene(), cars(15.0, 40.0), count=8, seed=3)
    places = []
    for member in members:
        assert member.modification is not None
        distance = member.intent.requests[0].spot.distance
        assert distance is not None
        assert not distance.is_range
        assert 15.0 <= distance.low_m <= 40.0
        findings = check_against_intent(Ground.of(scene()), member.modification, member.intent)
        assert not [one for one in findings if one.severity is Severity.WRONG]
        places.append(member.modification.added[0].x_m)
        assert places[-1] == pytest.approx(distance.low_m, abs=0.5)
    assert len(set(places)) == 8


def test_a_seed_gives_the_same_family_and_more_of_it_begin_alike() -> None:
    few, many = (sample_family(scene(), cars(15.0, 40.0), count=n, seed=3) for n in (3, 6))
    assert many[:3] == few
    assert sample_family(scene(), cars(15.0, 40.0), count=3, seed=4) != few


def test_a_member_that_fits_nowhere_says_why() -> None:
    members = sample_family(scene(), cars(60.0, 200.0), count=12)  # the lane ends at 100 m
    refused = [member for member in members if member.modification is None]
    assert 0 < len(refused) < 12
    assert all(member.refusal for member in refused)


def test_an_intent_without_a_range_has_no_family() -> None:
    with pytest.raises(CannotPlace, match="range"):
        sample_family(scene(), cars(20.0, 20.0), count=2)
