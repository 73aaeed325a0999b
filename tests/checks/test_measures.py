"""Lines and rings that the instruction asks for, and lane edges: by eye, on an arc, by shapely."""

from __future__ import annotations

import json
import math
import random

import numpy as np
import pytest
import shapely

from augment.checks import Ground
from augment.checks.measures import LaneEdges, MeasureLine, find_measures, lane_edges_at
from augment.scene.codec import intent_from_document
from augment.scene.intent import Intent, LaneChoice, Relation, Side, Spot, VehicleRequest
from tests.checks.worlds import FIXTURES, references
from tests.intents import CENTRED, LEFT_EDGE, RIGHT_EDGE, metres, parked, spot, towards, walk
from tests.scenes import curve, scene

STREET = Ground.of(scene())
"""Lane1, the ego's, from y = -1.75 m to 1.75 m; Lane2 comes towards it, up to 5.25 m."""


def lines(intent: Intent, ground: Ground = STREET) -> dict[str, MeasureLine]:
    found = find_measures(ground, intent, reach_m=30.0)
    return {label(one): one for one in found.lines}


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


def test_rings_stand_around_the_ego_every_ten_metres_and_need_no_intent() -> None:
    found = find_measures(STREET, None, reach_m=35.0)
    assert found.lines == ()
    assert [(one.centre_m, one.radius_m) for one in found.rings] == [
        ((0.0, 0.0), 10.0),
        ((0.0, 0.0), 20.0),
        ((0.0, 0.0), 30.0),
    ]


def test_without_a_lane_under_the_ego_there_are_rings_alone() -> None:
    found = find_measures(Ground.of(scene(lanes=())), parked(25.0), reach_m=15.0)
    assert (found.lines, len(found.rings)) == ((), 1)


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
        found = find_measures(Ground.of(one.scene), intent, reach_m=10.0)
        ahead_m = {line.ahead_m for line in found.lines}
        from_ego = (
            asked
            for request in intent.requests
            if not ((asked := request.spot).anchor or asked.landmark or asked.mark)
        )
        for asked in from_ego:
            if asked.distance and asked.relation is Relation.AHEAD:
                assert asked.distance.low_m in ahead_m, one.slug
