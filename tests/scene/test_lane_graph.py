from __future__ import annotations

import math
from dataclasses import replace

import pytest

from augment.errors import UnknownName
from augment.geometry.polyline import Polyline
from augment.scene.entities import TurnType
from augment.scene.lane_graph import LaneGraph
from tests.scenes import junction, scene


def test_the_lane_under_a_point_fits_its_heading() -> None:
    graph = LaneGraph(scene())
    assert graph.under(20.0, 0.3) == "Lane1"
    assert graph.under(20.0, 3.4, math.pi) == "Lane2"
    assert graph.under(20.0, 1.75, math.pi) == "Lane2"
    assert graph.under(20.0, 9.0) is None


def test_straight_on_comes_first_where_lanes_part() -> None:
    graph = LaneGraph(junction())
    assert graph.successors("Lane1") == ("Connector1", "Connector2")
    assert graph.route("Lane1", 100.0) == ["Lane1", "Connector1", "Lane2"]


def test_a_distance_runs_on_over_connectors() -> None:
    place = LaneGraph(junction()).along("Lane1", 50.0, 40.0, 0.5)
    assert place is not None
    assert (place.way_id, place.s_m) == ("Lane2", 4.0)
    assert (place.pose.x_m, place.pose.y_m) == (40.0, 0.5)


def test_a_turn_can_be_asked_for_and_a_distance_can_run_back() -> None:
    graph = LaneGraph(junction())
    ahead = graph.along("Lane1", 50.0, 40.0, turn=TurnType.LEFT)
    assert ahead is not None
    assert ahead.way_id == "Lane3"
    back = graph.along("Lane2", 4.0, -40.0)
    assert back is not None
    assert back.way_id == "Lane1"
    assert back.pose.x_m == pytest.approx(0.0)


def test_past_the_map_there_is_nothing() -> None:
    assert LaneGraph(junction()).along("Lane2", 0.0, 65.0) is None


def test_an_unknown_lane_names_the_known_ones() -> None:
    with pytest.raises(UnknownName, match="Lane1, Lane2"):
        LaneGraph(scene()).way("Lane9")


def test_a_lane_can_follow_another_with_no_connector_between() -> None:
    first, second = scene().lanes
    onward = replace(second, centerline=Polyline([(100.0, 0.0), (160.0, 0.0)]))
    street = scene(lanes=(replace(first, successors=("Lane2",)), onward))
    graph = LaneGraph(street)
    assert graph.route("Lane1", 200.0) == ["Lane1", "Lane2"]
    assert graph.predecessors("Lane2") == ("Lane1",)
