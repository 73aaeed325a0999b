import math
from dataclasses import replace

import numpy as np
import pytest

from augment.errors import UnknownName
from augment.geometry.polyline import Polyline
from augment.scene.ego_route import EgoRoute
from augment.scene.entities import Scene, TrafficSide, TurnType
from augment.scene.lane_graph import LaneGraph, classify_turn, find_traffic_side
from augment.variants.pose_tool import PoseTool
from tests.scenes import EGO, connector, curve, junction, lane, scene


def test_the_lane_under_a_point_fits_its_heading() -> None:
    graph = LaneGraph(scene())
    assert graph.under(20.0, 0.3) == "Lane1"
    assert graph.under(20.0, 3.4, math.pi) == "Lane2"
    assert graph.under(20.0, 1.75, math.pi) == "Lane2"
    assert graph.under(20.0, 9.0) is None


@pytest.mark.parametrize(("off_m", "is_on"), [(0.0, True), (1.75, True), (1.76, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_lane_reaches_half_its_width_to_a_side(sign: float, off_m: float, is_on: bool) -> None:
    graph = LaneGraph(scene(lanes=scene().lanes[:1]))
    assert graph.under(20.0, sign * off_m) == ("Lane1" if is_on else None)


@pytest.mark.parametrize("turn", [TurnType.LEFT, TurnType.RIGHT, TurnType.U_TURN])
@pytest.mark.parametrize("straight_first", [True, False])
def test_the_order_of_the_file_does_not_tell_where_the_road_goes_on(
    turn: TurnType, straight_first: bool
) -> None:
    straight, left = junction().connectors
    bent = replace(left, turn_type=turn)
    given = (straight, bent) if straight_first else (bent, straight)
    graph = LaneGraph(replace(junction(), connectors=given))
    assert graph.successors("Lane1") == ("Connector1", "Connector2")
    assert graph.route("Lane1", 100.0) == ["Lane1", "Connector1", "Lane2"]


@pytest.mark.parametrize("left_first", [True, False])
def test_nobody_turns_round_where_the_road_turns_off(left_first: bool) -> None:
    _, left = junction().connectors
    back = replace(
        left,
        id="Connector3",
        centerline=Polyline([(20.0, 0.0), (24.0, 1.0), (24.0, 5.0), (20.0, 6.0)]),
        turn_type=TurnType.U_TURN,
    )
    given = (left, back) if left_first else (back, left)
    graph = LaneGraph(replace(junction(), connectors=given))
    assert graph.successors("Lane1") == ("Connector2", "Connector3")


def test_a_distance_runs_on_over_connectors() -> None:
    place = LaneGraph(junction()).along("Lane1", 50.0, 40.0, 0.5)
    assert (place.lane_id, place.s_m) == ("Lane2", 4.0)
    assert (place.pose.x_m, place.pose.y_m) == (40.0, 0.5)
    assert LaneGraph(junction()).along("Lane2", 0.0, 65.0) is None, "past the map"


def test_a_turn_can_be_asked_for_and_a_distance_can_run_back() -> None:
    graph = LaneGraph(junction())
    ahead = graph.route("Lane1", 100.0, turn=TurnType.LEFT)
    assert ahead == ["Lane1", "Connector2", "Lane3"]
    back = graph.along("Lane2", 4.0, -40.0)
    assert back.lane_id == "Lane1"
    assert back.pose.x_m == pytest.approx(0.0)


def test_an_unknown_lane_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="Lane1, Lane2"):
        LaneGraph(scene()).lane("Lane9")


def merge(side: float, *, side_first: bool, connectors: bool) -> Scene:
    """A side road bends round 90 degrees into a straight road, from the right (-1) or left (+1).

    Lane1 runs east to x = -20, what is straight runs on to x = 0, where Lane3 begins. Lane2
    comes from the side; its bend of 20 m radius ends in the last 2 m of the very same direction.
    """
    bend = [
        (20.0 * math.sin(a) - 2.0, side * 20.0 * (1.0 - math.cos(a)))
        for a in np.linspace(-math.pi / 2, 0.0, 31)
    ]
    bend.append((0.0, 0.0))
    straight = [(-20.0, 0.0), (0.0, 0.0)]
    lanes = {
        "Lane1": [(-100.0, 0.0), (-20.0, 0.0)],
        "Lane2": [(bend[0][0], side * 80.0), bend[0]],
        "Lane3": [(0.0, 0.0), (80.0, 0.0)],
    }
    if not connectors:
        lanes["Lane1"] += [(0.0, 0.0)]
        lanes["Lane2"] += bend[1:]
    order = ["Lane2", "Lane1", "Lane3"] if side_first else ["Lane1", "Lane2", "Lane3"]
    after = {} if connectors else {"Lane1": ("Lane3",), "Lane2": ("Lane3",)}
    turns = TurnType.LEFT if side < 0.0 else TurnType.RIGHT
    ways = [
        connector("Connector1", "Lane1", "Lane3", straight, turn_type=TurnType.STRAIGHT),
        connector("Connector2", "Lane2", "Lane3", bend, turn_type=turns),
    ]
    return scene(
        areas=(),
        lanes=tuple(lane(name, lanes[name], successors=after.get(name, ())) for name in order),
        connectors=tuple(ways[::-1] if side_first else ways) if connectors else (),
    )


@pytest.mark.parametrize("side", [-1.0, 1.0], ids=["right", "left"])
@pytest.mark.parametrize("side_first", [False, True])
@pytest.mark.parametrize("connectors", [False, True])
def test_back_over_a_merge_goes_the_straightest_way_not_the_first(
    side: float, side_first: bool, connectors: bool
) -> None:
    """Both ways end alike at x = 0: 40 m before x = 10 lies x = -30, on the straight road."""
    world = merge(side, side_first=side_first, connectors=connectors)
    place = LaneGraph(world).along("Lane3", 10.0, -40.0)
    assert place.lane_id == "Lane1"
    assert (place.pose.x_m, place.pose.y_m) == pytest.approx((-30.0, 0.0))
    called = PoseTool(world).pose_on_lane("Lane3", "lane", -30.0, 0.5)
    assert (called.pose.x_m, called.pose.y_m) == pytest.approx((-30.0, 0.5), abs=0.01)


def arc(turn_rad: float) -> Polyline:
    angles = np.linspace(0.0, abs(turn_rad), 30)
    side = math.copysign(1.0, turn_rad)
    return Polyline(np.column_stack([np.sin(angles), side * (1.0 - np.cos(angles))]))


def test_a_line_turns_as_far_as_its_bends_together() -> None:
    for turn_deg, turn_type in (
        *((10, TurnType.STRAIGHT), (-25, TurnType.STRAIGHT), (35, TurnType.LEFT)),
        *((140, TurnType.LEFT), (-90, TurnType.RIGHT)),
        *((170, TurnType.U_TURN), (-200, TurnType.U_TURN)),
    ):
        assert classify_turn(arc(math.radians(turn_deg))) is turn_type


def test_people_drive_where_oncoming_lanes_are_on_the_other_side() -> None:
    lanes = scene().lanes
    assert find_traffic_side(lanes) is TrafficSide.RIGHT
    mirrored = [
        replace(one, centerline=Polyline(one.centerline.points_m * np.array([1.0, -1.0])))
        for one in lanes
    ]
    assert find_traffic_side(mirrored) is TrafficSide.LEFT


def test_a_one_way_street_does_not_tell() -> None:
    assert find_traffic_side(curve().lanes) is None


@pytest.mark.parametrize("ahead_m", [-5.0, 0.0, 12.5, 40.0])
@pytest.mark.parametrize("left_m", [-2.0, 0.0, 1.5])
def test_a_position_is_located_where_it_was_asked_for(ahead_m: float, left_m: float) -> None:
    route = EgoRoute.of(curve())
    place = route.locate(*route.position(ahead_m, left_m))
    assert (place.ahead_m, place.left_m) == pytest.approx((ahead_m, left_m), abs=0.05)


def test_a_route_goes_back_and_on_over_what_joins_the_ego_s_lane() -> None:
    lanes = (
        lane("Before", [(-60.0, 0.0), (-10.0, 0.0)], successors=("Own",)),
        lane("Own", [(-10.0, 0.0), (30.0, 0.0)], successors=("After",)),
        lane("After", [(30.0, 0.0), (80.0, 0.0)]),
    )
    route = EgoRoute.of(scene(ego=EGO, lanes=lanes, agents=(), connectors=(), areas=()))
    assert route.lane_ids == ("Before", "Own", "After")
    assert route.ends_m == (-10.0, 30.0, 80.0)
    assert route.locate(-40.0, 1.0).ahead_m == pytest.approx(-40.0)
    assert route.position(-40.0, 1.0) == pytest.approx((-40.0, 1.0))


def test_the_lane_that_the_ego_names_counts_before_the_one_under_it() -> None:
    lanes = (
        lane("Under", [(-10.0, 0.0), (80.0, 0.0)]),
        lane("Named", [(-10.0, 1.0), (80.0, 1.0)]),
    )
    here = scene(ego=replace(EGO, lane_id="Named"), lanes=lanes, agents=(), areas=())
    assert EgoRoute.of(here).lane_id == "Named"
    gone = replace(here, ego=replace(here.ego, lane_id="Elsewhere"))
    assert EgoRoute.of(gone).lane_id == "Under"


def test_an_ego_off_every_lane_has_no_route() -> None:
    assert EgoRoute.of(scene(ego=replace(EGO, y_m=40.0, lane_id=None))) is None
