import math

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from shapely import Polygon

from augment.geometry.frames import APART, Box, Pose, overlap
from augment.geometry.polyline import Polyline
from tests.scenes import curve

ELL = Polyline([(0, 0), (10, 0), (10, 10)])


def test_a_line_is_read_by_its_arc_length_left_is_positive_and_its_ends_go_straight_on() -> None:
    assert ELL.length_m == 20.0
    assert ELL.position(15.0) == (10.0, 5.0)
    assert ELL.heading_at(15.0) == pytest.approx(math.pi / 2)
    assert ELL.position(5.0, 2.0) == (5.0, 2.0)
    assert (ELL.project(5.0, 2.0).d_m, ELL.project(5.0, -2.0).d_m) == (2.0, -2.0)
    assert (ELL.position(-3.0), ELL.position(25.0)) == ((-3.0, 0.0), (10.0, 15.0))
    assert (ELL.project(-3.0, 0.0).beyond_m, ELL.project(10.0, 14.0).beyond_m) == (3.0, 4.0)


def test_resampling_keeps_both_ends() -> None:
    assert ELL.resample(8.0).points_m.tolist() == [[0, 0], [8, 0], [10, 6], [10, 10]]
    assert len(ELL.resample(5.0).points_m) == 5


@given(s=st.floats(0.5, 110.0), d=st.floats(-1.7, 1.7))
def test_projecting_a_position_gives_it_back(s: float, d: float) -> None:
    line = curve().lanes[0].centerline
    place = line.project(*line.position(s, d))
    assert place.s_m == pytest.approx(s, abs=0.05)
    assert place.d_m == pytest.approx(d, abs=0.01)


@pytest.mark.parametrize(
    "points", [[], [(1, 1)], [(1, 1), (1, 1)], [(0, 0), (math.nan, 1)], [1, 2]]
)
def test_what_is_no_line_is_refused(points: list[object]) -> None:
    with pytest.raises(ValueError, match="a line needs"):
        Polyline(points)  # type: ignore[arg-type]


def box(x: float, y: float, heading: float = 0.0, length: float = 4.0, width: float = 2.0) -> Box:
    return Box(pose=Pose(x_m=x, y_m=y, heading_rad=heading), length_m=length, width_m=width)


METRES, ANGLES, SIZES = st.floats(-6.0, 6.0), st.floats(-math.pi, math.pi), st.floats(0.2, 8.0)
boxes = st.builds(box, x=METRES, y=METRES, heading=ANGLES, length=SIZES, width=SIZES)


def test_half_a_box_in_another() -> None:
    found = overlap(box(0.0, 0.0), box(2.0, 0.0))
    assert found.share == pytest.approx(0.5)
    assert found.depth_m == pytest.approx(2.0)


def test_a_small_box_inside_a_large_one_is_covered_whole_and_boxes_that_touch_are_apart() -> None:
    found = overlap(box(0.0, 0.0, length=10.0, width=10.0), box(1.0, 1.0, 0.7, 0.5, 0.5))
    assert found.share == pytest.approx(1.0)
    for y_m in (0.0, 2.0):
        assert overlap(box(0.0, 0.0), box(4.0, y_m)) == APART


@given(boxes, boxes)
@example(box(2.0, 0.5, -1.125, 2.0, 0.5), box(2.0, 0.5, -1.125, 5.5, 0.5))  # common sides
def test_the_share_is_that_of_the_polygons_in_either_order(first: Box, second: Box) -> None:
    polygons = Polygon(first.corners_m), Polygon(second.corners_m)
    shared = sum(polygon.area for polygon in polygons) - polygons[0].union(polygons[1]).area
    one, other = overlap(first, second), overlap(second, first)
    smaller = min(polygon.area for polygon in polygons)
    assert one.share == pytest.approx(shared / smaller, abs=1e-5)
    assert one.share == pytest.approx(other.share, abs=1e-6)
    assert one.depth_m == pytest.approx(other.depth_m, abs=1e-9)
