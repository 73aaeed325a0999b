from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.geometry.polyline import Polyline
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Lane, Scene
from tests.scenes import EGO, curve, junction, scene


def route_of(where: Scene) -> EgoRoute:
    route = EgoRoute.of(where)
    assert route is not None
    return route


def straight_lane(
    name: str, start_m: float, end_m: float, *successors: str, y_m: float = 0.0
) -> Lane:
    line = Polyline([(start_m, y_m), (end_m, y_m)])
    return Lane(id=name, centerline=line, width_m=3.5, successors=successors)


@pytest.mark.parametrize("ahead_m", [-5.0, 0.0, 12.5, 40.0])
@pytest.mark.parametrize("left_m", [-2.0, 0.0, 1.5])
def test_a_position_is_located_where_it_was_asked_for(ahead_m: float, left_m: float) -> None:
    route = route_of(curve())
    place = route.locate(*route.position(ahead_m, left_m))
    assert (place.ahead_m, place.left_m) == pytest.approx((ahead_m, left_m), abs=0.05)


def test_a_route_goes_back_and_on_over_what_joins_the_ego_s_lane() -> None:
    lanes = (
        straight_lane("Before", -60.0, -10.0, "Own"),
        straight_lane("Own", -10.0, 30.0, "After"),
        straight_lane("After", 30.0, 80.0),
    )
    route = route_of(scene(ego=EGO, lanes=lanes, agents=(), connectors=(), areas=()))
    assert route.lane_ids == ("Before", "Own", "After")
    assert route.ends_m == (-10.0, 30.0, 80.0)
    assert route.locate(-40.0, 1.0).ahead_m == pytest.approx(-40.0)
    assert route.position(-40.0, 1.0) == pytest.approx((-40.0, 1.0))


def test_the_lane_that_the_ego_names_counts_before_the_one_under_it() -> None:
    lanes = (straight_lane("Under", -10.0, 80.0), straight_lane("Named", -10.0, 80.0, y_m=1.0))
    here = scene(ego=replace(EGO, lane_id="Named"), lanes=lanes, agents=(), areas=())
    assert route_of(here).lane_id == "Named"
    gone = replace(here, ego=replace(here.ego, lane_id="Elsewhere"))
    assert route_of(gone).lane_id == "Under"


def test_an_ego_off_every_lane_has_no_route() -> None:
    assert EgoRoute.of(scene(ego=replace(EGO, y_m=40.0, lane_id=None))) is None


def test_where_lanes_part_the_route_goes_straight_on() -> None:
    assert route_of(junction()).lane_ids == ("Lane1", "Connector1", "Lane2")
    assert route_of(junction()).heading_at(60.0) == pytest.approx(0.0)


def test_a_corridor_holds_the_lanes_that_begin_within_its_length() -> None:
    lanes = (straight_lane("Own", -10.0, 30.0, "After"), straight_lane("After", 30.0, 80.0))
    wide = (lanes[0], replace(lanes[1], width_m=4.5))
    route = route_of(scene(ego=EGO, lanes=wide, agents=(), areas=()))
    for length_m, end_m, width_m in ((30.0, 30.0, 3.5), (30.1, 80.0, 4.0)):
        corridor = route.corridor(length_m)
        assert corridor is not None
        assert corridor[0].points_m[[0, -1], 0].tolist() == pytest.approx([0.0, end_m])
        assert corridor[1] == pytest.approx(width_m)


def test_there_is_no_corridor_where_the_lanes_end_at_the_ego() -> None:
    lanes = (straight_lane("Own", -10.0, 0.5),)
    route = route_of(scene(ego=EGO, lanes=lanes, agents=(), areas=()))
    assert route.corridor(150.0) is None
    assert math.isclose(route.ends_m[-1], 0.5)
