"""Who and what of the scene an intent names, and distances that are counted from it."""

import math
from dataclasses import replace

import pytest

from augment.checks import Ground
from augment.checks.lanes_across import LanesAcross, find_mark, find_picked, resolve_spots
from augment.checks.wish import measure_wish
from augment.checks.wish_places import list_absent
from augment.scene import intent as wish
from augment.scene.entities import Modification, TurnType
from tests.checks.worlds import faults_against
from tests.fixtures.shelf import whole_scene
from tests.intents import metres, parked
from tests.scenes import scene

LANDMARK_STREET = whole_scene("terrace-row")
"""On the left cars are parked -11, -5.1, 1, 6.9, 14.2 and 28.2 m along, left-hand traffic."""


def lanes_of(scene_name: str, route: TurnType = TurnType.STRAIGHT) -> LanesAcross:
    return LanesAcross.of(Ground.of(whole_scene(scene_name)), route)


def faults(intent: wish.Intent, modification: Modification) -> list[str]:
    return [one.sentence() for one in faults_against(LANDMARK_STREET, modification, intent)]


PARKED_LEFT = wish.Pick(kind=wish.Sight.PARKED, side=wish.Side.LEFT)


def test_the_nearest_that_fits_is_the_first() -> None:
    lanes = lanes_of("terrace-row")
    for pick, along_m in (
        (PARKED_LEFT, [1.0]),
        (replace(PARKED_LEFT, ordinal=3), [14.2]),
        (replace(PARKED_LEFT, ordinal=5), []),
        (replace(PARKED_LEFT, relation=wish.Relation.BEHIND), [-5.1]),
        (replace(PARKED_LEFT, relation=wish.Relation.BEHIND, ordinal=2), [-11.0]),
        (replace(PARKED_LEFT, every=True), [1.0, 6.9, 14.2, 28.2]),
        (wish.Pick(kind=wish.Sight.PARKED, side=wish.Side.RIGHT, ordinal=2), [15.4]),
        (wish.Pick(kind=wish.Sight.BICYCLE, lane=wish.LaneChoice.ONCOMING), [72.0]),
        (wish.Pick(kind=wish.Sight.BICYCLE, lane=wish.LaneChoice.OWN), []),
        (wish.Pick(kind=wish.Sight.BUS), []),
    ):
        found = [lanes.route.locate_agent(one).ahead_m for one in find_picked(lanes, pick)]
        assert found == pytest.approx(along_m, abs=0.05)


def test_a_junction_begins_where_the_ego_s_lane_ends() -> None:
    """The ego is 36 m before the middle; stop lines are 4 + 7 + 5 m off it."""
    start_m = find_mark(lanes_of("market-crossing"), wish.MapPlace.JUNCTION_START)
    end_m = find_mark(lanes_of("market-crossing"), wish.MapPlace.JUNCTION_END)
    assert (start_m, end_m) == pytest.approx((20.0, 52.0), abs=0.01)
    assert find_mark(lanes_of("terrace-row"), wish.MapPlace.JUNCTION_START) is None
    turned_m = find_mark(lanes_of("market-crossing", TurnType.RIGHT), wish.MapPlace.JUNCTION_END)
    assert 30.0 < turned_m < 45.0


def test_past_the_end_of_a_lane_the_one_that_goes_on_counts() -> None:
    """The oncoming lane begins 20 m ahead; up to there leads Connector2."""
    bands = (lanes_of("market-crossing").band(wish.LaneChoice.ONCOMING, m) for m in (19.5, 20.5))
    assert [band.lane_id for band in bands] == ["Lane8", "Connector2"]


def test_a_crosswalk_is_counted_by_its_middle() -> None:
    """Authored from 117 to 120.5 m, the ego at 80 m."""
    middle_m = find_mark(lanes_of("plane-tree-street"), wish.MapPlace.CROSSWALK)
    assert middle_m == pytest.approx(38.75, abs=0.1)
    assert find_mark(lanes_of("terrace-row"), wish.MapPlace.CROSSWALK) is None


def test_a_distance_from_a_landmark_becomes_one_from_the_ego() -> None:
    three = wish.Length(low_m=3.0, high_m=3.0)
    spot = wish.Spot(distance=three, relation=wish.Relation.BEHIND, landmark=PARKED_LEFT)
    level = wish.Spot(landmark=replace(PARKED_LEFT, relation=wish.Relation.BEHIND))
    past = (wish.Setting.AFTER_INTERSECTION,)
    missing = replace(spot, landmark=wish.Pick(kind=wish.Sight.BUS), settings=past)
    requests = tuple(wish.VehicleRequest(spot=one) for one in (spot, level, missing))
    intent = wish.Intent(requests=requests)
    lanes = lanes_of("terrace-row")
    spans = [one.spot.span_m for one in resolve_spots(intent, lanes).requests]
    assert spans[0] == pytest.approx((-2.0, -2.0), abs=0.05)
    assert spans[1] == pytest.approx((-5.1, -5.1), abs=0.05)
    assert spans[2] is None
    absent = ("bus 1 ahead of the ego", "a place past the intersection")
    assert list_absent(intent, lanes) == absent


def test_who_is_to_be_moved_has_to_be_moved_there() -> None:
    lanes = lanes_of("terrace-row")
    (car,) = find_picked(lanes, replace(PARKED_LEFT, ordinal=3))
    (other,) = find_picked(lanes, replace(PARKED_LEFT, ordinal=4))
    ten = wish.Length(low_m=21.0, high_m=21.0)
    there = wish.Spot(distance=ten, relation=wish.Relation.AHEAD, lane=wish.LaneChoice.OWN)
    intent = wish.Intent(moves=(wish.Move(who=replace(PARKED_LEFT, ordinal=3), spot=there),))
    ways = map(lanes.route.position, (21.0, 26.0), (0.0, 0.0))
    right, far = (replace(car, x_m=x_m, y_m=y_m) for x_m, y_m in ways)
    assert faults(intent, Modification(moved=(right,))) == []
    for wrong, words in ((far, "; 21 m is"), (replace(right, speed_mps=4.0), "; 0 m/s is")):
        assert any(words in one for one in faults(intent, Modification(moved=(wrong,))))
    assert faults(intent, Modification()) == [f"{car.id} is to be moved and is not."]
    elsewhere = faults(intent, Modification(moved=(right, other)))
    assert f"{other.id} is moved; nobody asked for that." in elsewhere


def test_who_is_only_turned_and_slowed_down_stays() -> None:
    cyclist = wish.Pick(kind=wish.Sight.BICYCLE, lane=wish.LaneChoice.ONCOMING)
    back = wish.Move(who=cyclist, facing=wish.Facing.AGAINST_LANE, speed_mps=2.0)
    intent = wish.Intent(moves=(back,))
    (rider,) = find_picked(lanes_of("terrace-row"), cyclist)
    right = replace(rider, heading_rad=0.0, speed_mps=2.0)
    far = replace(right, x_m=right.x_m - 10.0)
    assert faults(intent, Modification(moved=(right,))) == []
    for wrong, words in ((far, "and is to stay"), (replace(right, heading_rad=3.1), "; 180 deg")):
        assert any(words in one for one in faults(intent, Modification(moved=(wrong,))))
    off = measure_wish(Ground.of(LANDMARK_STREET), Modification(moved=(far,)), intent)
    assert off.distances_m == pytest.approx([10.0])
    # What its place is counted from is not there: it may be anywhere.
    past = wish.Spot(relation=wish.Relation.AHEAD, landmark=wish.Pick(kind=wish.Sight.BUS))
    nowhere = wish.Intent(moves=(wish.Move(who=cyclist, spot=past),))
    moved = Modification(moved=(replace(rider, x_m=rider.x_m - 10.0),))
    assert faults(nowhere, moved) == []
    anywhere = measure_wish(Ground.of(LANDMARK_STREET), moved, nowhere)
    assert anywhere.distances_m == pytest.approx([0.0])


def test_who_is_to_go_has_to_go_and_nobody_else() -> None:
    lanes = lanes_of("terrace-row")
    every = find_picked(lanes, replace(PARKED_LEFT, every=True))
    intent = wish.Intent(removals=(replace(PARKED_LEFT, every=True),))
    names = tuple(one.id for one in every)
    assert faults(intent, Modification(removed=names)) == []
    assert faults(intent, Modification(removed=names[1:])) == [
        f"{names[0]} is to be removed and is not."
    ]


def test_whatever_is_done_about_a_wish_that_can_t_be_met_is_wrong() -> None:
    intent = wish.Intent(unmet="There is no tram {here}.")
    gone = LANDMARK_STREET.agents[0].id
    assert faults(intent, Modification()) == []
    found = faults(intent, Modification(removed=(gone,)))
    assert f"The wish can't be met, and {gone} is changed: There is no tram {{here}}." in found


def test_a_distance_from_another_object_is_added_to_that_ones() -> None:
    for bus_m, relation, distance, wanted in (
        (20.0, wish.Relation.AHEAD, metres(6.0), (26.0, 26.0)),
        (20.0, wish.Relation.BEHIND, metres(6.0, 8.0), (12.0, 14.0)),
        (20.0, wish.Relation.BEHIND, metres(30.0), (-10.0, -10.0)),
        (20.0, wish.Relation.AHEAD, None, (20.0, math.inf)),
    ):
        (bus,) = parked(bus_m).requests
        named = wish.VehicleRequest(spot=bus.spot, name="bus")
        walker = wish.WalkRequest(
            spot=wish.Spot(anchor="bus", relation=relation, distance=distance)
        )
        lanes = LanesAcross.of(Ground.of(scene()))
        resolved = resolve_spots(wish.Intent(requests=(named, walker)), lanes)
        assert resolved.requests[1].spot.span_m == wanted
