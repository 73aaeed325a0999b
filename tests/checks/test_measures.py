"""Lines and rings that the instruction asks for, and lane edges: by eye, on an arc, by shapely."""

import json
import math
import random
from dataclasses import replace

import numpy as np
import pytest
import shapely

from augment.checks import Ground
from augment.checks.lanes_across import (
    LanesAcross,
    find_mark,
    find_picked,
    list_absent,
    resolve_spots,
)
from augment.checks.measures import LaneEdges, MeasureLine, find_measures, lane_edges_at
from augment.checks.registry import check_against_intent
from augment.scene.codec import intent_from_document
from augment.scene.entities import Modification, TurnType
from augment.scene.intent import (
    Intent,
    LaneChoice,
    Length,
    MapPlace,
    Move,
    Pick,
    Relation,
    Side,
    Sight,
    Spot,
    VehicleRequest,
    WalkRequest,
)
from tests.checks.worlds import FIXTURES, references
from tests.fixtures.shelf import whole_scene
from tests.intents import CENTRED, LEFT_EDGE, RIGHT_EDGE, metres, parked, spot, towards, walk
from tests.scenes import curve, scene

STREET = Ground.of(scene())
"""Lane1, the ego's, from y = -1.75 m to 1.75 m; Lane2 comes towards it, up to 5.25 m."""


def lines(intent: Intent, ground: Ground = STREET) -> dict[str, MeasureLine]:
    return {label(one): one for one in find_measures(ground, intent)}


def label(line: MeasureLine) -> str:
    if line.ahead_m is not None:
        return f"{abs(line.ahead_m):.4g} m {'ahead' if line.ahead_m >= 0.0 else 'behind'}"
    if not line.left_m:
        return "centre of the lane"
    return f"{abs(line.left_m):.4g} m {'left' if line.left_m > 0.0 else 'right'}"


def ends(line: MeasureLine) -> list[tuple[float, float]]:
    first, last = line.points_m[0], line.points_m[-1]
    return [tuple(np.round(point, 6).tolist()) for point in (first, last)]


@pytest.mark.parametrize(
    ("intent", "label", "at"),
    [
        (parked(25.0), "25 m ahead", [(25.0, 2.75), (25.0, -2.75)]),
        (parked(21.4), "21.4 m ahead", [(21.4, 2.75), (21.4, -2.75)]),
        (parked(-8.0), "8 m behind", [(-8.0, 2.75), (-8.0, -2.75)]),
        (parked(30.0, lane=LaneChoice.ONCOMING), "30 m ahead", [(30.0, 6.25), (30.0, -2.75)]),
        (walk(20.0, Side.LEFT), "20 m ahead", [(20.0, 6.75), (20.0, -6.75)]),
        (parked(25.0, lateral=towards(LEFT_EDGE, 1.2)), "1.2 m left", [(19.0, 1.2), (31.0, 1.2)]),
        (
            parked(25.0, lateral=towards(RIGHT_EDGE, 0.5)),
            "0.5 m right",
            [(19.0, -0.5), (31.0, -0.5)],
        ),
        (
            parked(25.0, lane=LaneChoice.ONCOMING, lateral=CENTRED),
            "centre of the lane",
            [(19.0, 3.5), (31.0, 3.5)],
        ),
    ],
)
def test_a_line_lies_where_the_number_says(
    intent: Intent, label: str, at: list[tuple[float, float]]
) -> None:
    assert ends(lines(intent)[label]) == at


def test_a_range_has_a_line_at_either_end_and_no_number_has_none() -> None:
    ranged = Spot(distance=metres(20.0, 30.0), relation=Relation.AHEAD, lane=LaneChoice.OWN)
    assert set(lines(Intent(requests=(VehicleRequest(spot=ranged),)))) == {
        "20 m ahead",
        "30 m ahead",
    }
    somewhere = Spot(relation=Relation.AHEAD, lane=LaneChoice.OWN)
    assert lines(Intent(requests=(VehicleRequest(spot=somewhere),))) == {}
    nowhere = Intent(requests=(VehicleRequest(spot=Spot(lateral=towards(LEFT_EDGE))),))
    assert lines(nowhere) == {}


def test_what_is_asked_for_by_another_counts_from_the_ego() -> None:
    first = VehicleRequest(spot=spot(20.0), name="bus")
    further = Spot(
        distance=metres(10.0), relation=Relation.AHEAD, anchor="bus", lane=LaneChoice.OWN
    )
    found = lines(Intent(requests=(first, VehicleRequest(spot=further))))
    assert set(found) == {"20 m ahead", "30 m ahead"}


def test_on_a_bend_the_distance_runs_along_the_lane() -> None:
    found = lines(parked(25.0), Ground.of(curve(radius_m=40.0)))["25 m ahead"]
    turned = (25.0 - 10.0) / 40.0  # after 10 m straight
    wanted = (10.0 + 40.0 * math.sin(turned), 40.0 * (1.0 - math.cos(turned)))
    assert math.dist(np.mean(found.points_m, axis=0), wanted) < 0.02
    assert math.dist(wanted, (25.0, 0.0)) > 1.0, "not straight ahead"


def test_there_are_no_lines_without_an_intent_or_a_lane_under_the_ego() -> None:
    assert find_measures(STREET, None) == ()
    assert find_measures(Ground.of(scene(lanes=())), parked(25.0)) == ()


@pytest.mark.parametrize(
    ("place", "left_m", "right_m"),
    [
        ((10.0, 0.0), 1.75, 1.75),
        ((10.0, 1.35), 0.4, 3.1),
        ((10.0, -1.75), 3.5, 0.0),
        ((10.0, 3.0), 2.25, 1.25),  # on the oncoming lane: sides stay the ego's
    ],
)
def test_the_edges_of_the_lane_under_a_point(
    place: tuple[float, float], left_m: float, right_m: float
) -> None:
    found = lane_edges_at(STREET, *place)
    assert found is not None
    assert [found.left_m, found.right_m] == pytest.approx([left_m, right_m])


@pytest.mark.parametrize("place", [(10.0, -1.76), (10.0, 5.26), (130.0, 0.0)])
def test_off_every_lane_there_are_no_edges(place: tuple[float, float]) -> None:
    assert lane_edges_at(STREET, *place) is None


def test_edges_of_the_catalogue_are_those_that_shapely_measures() -> None:
    dice = random.Random(5)
    compared = 0
    for one in references()[::9]:
        ground = Ground.of(one.scene)
        for lane in one.scene.lanes[:4]:
            x_m, y_m = lane.centerline.position(
                dice.uniform(0.3, 0.7) * lane.centerline.length_m,
                dice.uniform(-0.45, 0.45) * lane.width_m,
            )
            found = lane_edges_at(ground, x_m, y_m)
            wanted = _by_shapely(ground, x_m, y_m)
            assert found is not None
            assert any(
                [found.left_m, found.right_m] == pytest.approx([w.left_m, w.right_m], abs=0.02)
                for w in wanted
            )
            compared += 1
    assert compared > 10


def _by_shapely(ground: Ground, x_m: float, y_m: float) -> list[LaneEdges]:
    """The edges of every lane under the point, from lines beside its centreline."""
    point, found = shapely.Point(x_m, y_m), []
    for lane in ground.scene.lanes:
        centre = shapely.LineString(lane.centerline.points_m)
        if centre.distance(point) > lane.width_m / 2.0:
            continue
        left, right = (
            centre.offset_curve(side * lane.width_m / 2.0).distance(point) for side in (1.0, -1.0)
        )
        station = centre.project(point)
        here, there = centre.interpolate(station), centre.interpolate(station + 0.1)
        heading = math.atan2(there.y - here.y, there.x - here.x)
        if math.cos(heading - ground.scene.ego.heading_rad) < 0.0:
            left, right = right, left
        found.append(LaneEdges(left_m=left, right_m=right))
    return found


def test_every_scenario_of_the_catalogue_with_a_distance_has_its_line() -> None:
    for one in references():
        document = json.loads((FIXTURES / "scenarios" / f"{one.slug}.json").read_text())
        intent = intent_from_document(document["intent"])
        ahead_m = {line.ahead_m for line in find_measures(Ground.of(one.scene), intent)}
        from_ego = (
            asked
            for request in intent.requests
            if not ((asked := request.spot).anchor or asked.landmark or asked.mark)
        )
        for asked in from_ego:
            if asked.distance and asked.relation is Relation.AHEAD:
                assert asked.distance.low_m in ahead_m, one.slug


LANDMARK_STREET = whole_scene("terrace-row")
"""On the left cars are parked -11, -5.1, 1, 6.9, 14.2 and 28.2 m along, left-hand traffic."""
CROSSING = whole_scene("market-crossing")


def lanes_of(scene_name: str, route: TurnType = TurnType.STRAIGHT) -> LanesAcross:
    lanes = LanesAcross.of(Ground.of(whole_scene(scene_name)), route)
    assert lanes is not None
    return lanes


def faults(intent: Intent, modification: Modification) -> list[str]:
    found = check_against_intent(Ground.of(LANDMARK_STREET), modification, intent)
    return [one.sentence() for one in found if one.is_fault]


PARKED_LEFT = Pick(kind=Sight.PARKED, side=Side.LEFT)


@pytest.mark.parametrize(
    ("pick", "along_m"),
    [
        (PARKED_LEFT, [1.0]),
        (replace(PARKED_LEFT, ordinal=3), [14.2]),
        (replace(PARKED_LEFT, ordinal=5), []),
        (replace(PARKED_LEFT, relation=Relation.BEHIND), [-5.1]),
        (replace(PARKED_LEFT, relation=Relation.BEHIND, ordinal=2), [-11.0]),
        (replace(PARKED_LEFT, every=True), [1.0, 6.9, 14.2, 28.2]),
        (Pick(kind=Sight.PARKED, side=Side.RIGHT, ordinal=2), [15.4]),
        (Pick(kind=Sight.BICYCLE, lane=LaneChoice.ONCOMING), [72.0]),
        (Pick(kind=Sight.BICYCLE, lane=LaneChoice.OWN), []),
        (Pick(kind=Sight.BUS), []),
    ],
)
def test_the_nearest_that_fits_is_the_first(pick: Pick, along_m: list[float]) -> None:
    lanes = lanes_of("terrace-row")
    found = [lanes.route.locate_agent(one).ahead_m for one in find_picked(lanes, pick)]
    assert found == pytest.approx(along_m, abs=0.05)


def test_a_junction_begins_where_the_ego_s_lane_ends() -> None:
    """The ego is 36 m before the middle; stop lines are 4 + 7 + 5 m off it."""
    start_m = find_mark(lanes_of("market-crossing"), MapPlace.JUNCTION_START)
    end_m = find_mark(lanes_of("market-crossing"), MapPlace.JUNCTION_END)
    assert (start_m, end_m) == pytest.approx((20.0, 52.0), abs=0.01)
    assert find_mark(lanes_of("terrace-row"), MapPlace.JUNCTION_START) is None
    turned_m = find_mark(lanes_of("market-crossing", TurnType.RIGHT), MapPlace.JUNCTION_END)
    assert turned_m is not None
    assert 30.0 < turned_m < 45.0


def test_a_crosswalk_is_counted_by_its_middle() -> None:
    """Authored from 117 to 120.5 m, the ego at 80 m."""
    assert find_mark(lanes_of("plane-tree-street"), MapPlace.CROSSWALK) == pytest.approx(
        38.75, abs=0.1
    )
    assert find_mark(lanes_of("terrace-row"), MapPlace.CROSSWALK) is None


def test_a_distance_from_a_landmark_becomes_one_from_the_ego() -> None:
    three = Length(low_m=3.0, high_m=3.0)
    spot = Spot(distance=three, relation=Relation.BEHIND, landmark=PARKED_LEFT)
    level = Spot(landmark=replace(PARKED_LEFT, relation=Relation.BEHIND))
    absent = replace(spot, landmark=Pick(kind=Sight.BUS))
    intent = Intent(requests=tuple(VehicleRequest(spot=one) for one in (spot, level, absent)))
    lanes = lanes_of("terrace-row")
    spans = [one.spot.span_m for one in resolve_spots(intent, lanes).requests]
    assert spans[0] == pytest.approx((-2.0, -2.0), abs=0.05)
    assert spans[1] == pytest.approx((-5.1, -5.1), abs=0.05)
    assert spans[2] is None
    assert list_absent(intent, lanes) == ("bus 1 ahead of the ego",)


def test_who_is_to_be_moved_has_to_be_moved_there() -> None:
    lanes = lanes_of("terrace-row")
    (car,) = find_picked(lanes, replace(PARKED_LEFT, ordinal=3))
    (other,) = find_picked(lanes, replace(PARKED_LEFT, ordinal=4))
    ten = Length(low_m=21.0, high_m=21.0)
    there = Spot(distance=ten, relation=Relation.AHEAD, lane=LaneChoice.OWN)
    intent = Intent(moves=(Move(who=replace(PARKED_LEFT, ordinal=3), spot=there),))
    x_m, y_m = lanes.route.position(21.0, 0.0)
    right = replace(car, x_m=x_m, y_m=y_m)
    x_m, y_m = lanes.route.position(26.0, 0.0)
    wrong = replace(car, x_m=x_m, y_m=y_m)
    assert faults(intent, Modification(moved=(right,))) == []
    assert any(
        "; 21 m is asked for" in one for one in faults(intent, Modification(moved=(wrong,)))
    )
    assert faults(intent, Modification()) == [f"{car.id} is to be moved and is not."]
    elsewhere = faults(intent, Modification(moved=(right, other)))
    assert f"{other.id} is moved; nobody asked for that." in elsewhere


def test_who_is_to_go_has_to_go_and_nobody_else() -> None:
    lanes = lanes_of("terrace-row")
    every = find_picked(lanes, replace(PARKED_LEFT, every=True))
    intent = Intent(removals=(replace(PARKED_LEFT, every=True),))
    names = tuple(one.id for one in every)
    assert faults(intent, Modification(removed=names)) == []
    assert faults(intent, Modification(removed=names[1:])) == [
        f"{names[0]} is to be removed and is not."
    ]


def test_whatever_is_done_about_a_wish_that_can_t_be_met_is_wrong() -> None:
    intent = Intent(unmet="There is no tram {here}.")
    gone = LANDMARK_STREET.agents[0].id
    assert faults(intent, Modification()) == []
    found = faults(intent, Modification(removed=(gone,)))
    assert f"The wish can't be met, and {gone} is changed: There is no tram {{here}}." in found


@pytest.mark.parametrize(
    ("bus_m", "relation", "distance", "wanted"),
    [
        (20.0, Relation.AHEAD, metres(6.0), (26.0, 26.0)),
        (20.0, Relation.BEHIND, metres(6.0, 8.0), (12.0, 14.0)),
        (20.0, Relation.BEHIND, metres(30.0), (-10.0, -10.0)),
        (20.0, Relation.AHEAD, None, None),
    ],
)
def test_a_distance_from_another_object_is_added_to_that_ones(
    bus_m: float, relation: Relation, distance: Length | None, wanted: tuple[float, float] | None
) -> None:
    (bus,) = parked(bus_m).requests
    named = VehicleRequest(spot=bus.spot, name="bus")
    walker = WalkRequest(spot=Spot(anchor="bus", relation=relation, distance=distance))
    lanes = LanesAcross.of(STREET)
    assert lanes is not None
    resolved = resolve_spots(Intent(requests=(named, walker)), lanes)
    assert resolved.requests[1].spot.span_m == wanted
