from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from augment.geometry.polyline import Polyline
from tests.scenes import curve

ELL = Polyline([(0, 0), (10, 0), (10, 10)])


def test_a_line_is_read_by_its_arc_length() -> None:
    assert ELL.length_m == 20.0
    assert ELL.position(15.0) == (10.0, 5.0)
    assert ELL.heading_at(15.0) == pytest.approx(math.pi / 2)


def test_left_is_positive() -> None:
    assert ELL.position(5.0, 2.0) == (5.0, 2.0)
    assert ELL.project(5.0, 2.0).d_m == 2.0
    assert ELL.project(5.0, -2.0).d_m == -2.0


def test_the_ends_are_extended_straight() -> None:
    assert ELL.position(-3.0) == (-3.0, 0.0)
    assert ELL.position(25.0) == (10.0, 15.0)


def test_resampling_keeps_both_ends() -> None:
    assert ELL.resampled(8.0).points_m.tolist() == [[0, 0], [8, 0], [10, 6], [10, 10]]
    assert len(ELL.resampled(5.0).points_m) == 5


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
