"""All lanes read at once agree with each way read alone."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from augment.checks.ground import LaneIndex, best_aligned
from augment.scene.entities import Scene
from augment.scene.lane_graph import LaneGraph
from tests.scenes import curve, junction, scene

GRAPHS = st.sampled_from([LaneGraph(made) for made in (scene(), curve(), junction())])
PLACES = st.floats(-15.0, 50.0).map(lambda value: value + 0.00071)


@given(GRAPHS, PLACES, PLACES)
def test_a_point_lies_where_its_projection_says(graph: LaneGraph, x_m: float, y_m: float) -> None:
    for one in LaneIndex(graph.lanes.values()).beside(x_m, y_m):
        place = graph.lanes[one.lane_id].centerline.project(x_m, y_m)
        assert abs(one.s_m - place.s_m) < 1e-9
        assert abs(one.distance_m - place.distance_m) < 1e-9
        if one.beyond_m == 0.0:
            assert abs(one.d_m - place.d_m) < 1e-9


@given(GRAPHS, PLACES, PLACES, st.floats(-3.1, 3.1))
def test_the_same_way_lies_under_a_point(
    graph: LaneGraph, x_m: float, y_m: float, heading_rad: float
) -> None:
    under = graph.under(x_m, y_m, heading_rad)
    found = best_aligned(LaneIndex(graph.lanes.values()).beside(x_m, y_m), heading_rad)
    if under is not None:
        assert found is not None
        assert found.lane_id == under or found.beyond_m > 0.0


def test_a_map_without_ways_has_nothing_beside_a_point() -> None:
    empty: Scene = scene(lanes=())
    assert LaneIndex(LaneGraph(empty).lanes.values()).beside(0.0, 0.0) == ()
