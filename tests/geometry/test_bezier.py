import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from augment.geometry.bezier import CubicBezier, FloatArray, fit, fit_error, travel_pose
from augment.geometry.polyline import Polyline
from tests.properties import examples
from tests.scenes import curve as curved_scene

KAPPA = 4.0 / 3.0 * (math.sqrt(2.0) - 1.0)
QUARTER = CubicBezier([(10, 0), (10, 10 * KAPPA), (10 * KAPPA, 10), (0, 10)])
"""The usual cubic for a quarter of a circle of 10 m; it is 3 mm off at most."""

STRAIGHT = CubicBezier([(0, 0), (10, 0), (20, 0), (30, 0)])


@st.composite
def curves(draw: st.DrawFn) -> CubicBezier:
    control = draw(arrays(np.float64, (4, 2), elements=st.floats(-100.0, 100.0)))
    assume(np.ptp(control, axis=0).max() > 1.0)
    return CubicBezier(control)


@st.composite
def lane_like(draw: st.DrawFn) -> CubicBezier:
    """A curve as a lane's is: it goes on forward all the way."""
    headings = [draw(st.floats(-0.7, 0.7)) for _ in range(3)]
    lengths = [draw(st.floats(3.0, 40.0)) for _ in range(3)]
    steps = [(r * math.cos(a), r * math.sin(a)) for r, a in zip(lengths, headings, strict=True)]
    return CubicBezier(np.vstack([[(0.0, 0.0)], np.cumsum(steps, axis=0)]))


def de_casteljau(control: FloatArray, t: float) -> FloatArray:
    while len(control) > 1:
        control = (1.0 - t) * control[:-1] + t * control[1:]
    return np.asarray(control[0], dtype=np.float64)


def dense_length(curve: CubicBezier, until: float = 1.0) -> float:
    points = curve.points(np.linspace(0.0, until, 40_001))
    return float(np.hypot(*np.diff(points, axis=0).T).sum())


@given(curve=curves(), t=st.floats(0.0, 1.0))
def test_a_point_is_what_de_casteljau_finds(curve: CubicBezier, t: float) -> None:
    assert curve.points(np.array([t]))[0] == pytest.approx(
        de_casteljau(curve.control_m, t), abs=1e-10
    )


@examples(40)
@given(curve=lane_like(), share=st.floats(0.0, 1.0))
def test_the_place_at_an_arc_length_has_that_arc_length(curve: CubicBezier, share: float) -> None:
    assert curve.length_m == pytest.approx(dense_length(curve), abs=1e-3)
    s_m = share * curve.length_m
    t = float(curve.parameters_at([s_m])[0])
    assert dense_length(curve, t) == pytest.approx(s_m, abs=1e-3)


def test_a_doubled_control_point_still_has_a_heading() -> None:
    doubled = CubicBezier([(0, 0), (0, 0), (5, 5), (5, 5)])
    assert doubled.headings(np.array([0.0, 1.0])) == pytest.approx([math.pi / 4] * 2)


def test_a_fit_finds_a_curve_again() -> None:
    line = Polyline(QUARTER.points(QUARTER.parameters_at(np.linspace(0, QUARTER.length_m, 200))))
    found = fit(line)
    assert fit_error(found, line)[0] < 0.01
    assert found.length_m == pytest.approx(QUARTER.length_m, abs=0.005)


def test_a_fit_keeps_the_ends_and_takes_the_headings_it_is_given() -> None:
    line = curved_scene().lanes[0].centerline.between(50.0, 110.0)
    found = fit(line, start_rad=0.1, end_rad=1.2)
    assert np.array_equal(found.control_m[[0, 3]], line.points_m[[0, -1]])
    assert found.headings(np.array([0.0, 1.0])) == pytest.approx([0.1, 1.2])


def test_the_error_of_a_fit_is_its_worst_place() -> None:
    line = Polyline([(0, 0), (30, 0)])
    assert fit_error(STRAIGHT, line)[0] == pytest.approx(0.0, abs=1e-9)
    aside = CubicBezier(STRAIGHT.control_m + np.array([0.0, 0.4]))
    assert fit_error(aside, line)[0] == pytest.approx(0.4)
    turned = CubicBezier(STRAIGHT.control_m @ np.array([[0.0, 1.0], [-1.0, 0.0]]))
    assert fit_error(turned, line)[1] == pytest.approx(math.pi / 2)


@pytest.mark.parametrize(
    "control", [[], [(0, 0)] * 4, [(0, 0)] * 3, [(0, 0), (1, 1), (2, 2), (math.nan, 3)]]
)
def test_what_is_no_curve_is_refused(control: list[tuple[float, float]]) -> None:
    with pytest.raises(ValueError, match="a curve needs"):
        CubicBezier(control)


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["left", "right"])
@pytest.mark.parametrize("turn_rad", [0.0, 0.5, 1.5, 2.5, 3.1])
@pytest.mark.parametrize("is_end", [False, True], ids=["start", "end"])
def test_a_fit_never_leaves_or_arrives_against_the_heading_it_is_given(
    side: float, turn_rad: float, is_end: bool
) -> None:
    """A line along x with a heading that may point far away from it, even backwards.

    Least squares alone would put the inner control point on the wrong side of its end, so that
    the curve keeps the line's direction and its tangent points against the heading.
    """
    line = Polyline([(0.0, 0.0), (10.0, side * 1.0), (20.0, 0.0)])
    wanted_rad = side * turn_rad
    curve = fit(line, end_rad=wanted_rad) if is_end else fit(line, start_rad=wanted_rad)
    heading_rad = float(curve.headings(np.array([1.0 if is_end else 0.0]))[0])
    assert math.cos(heading_rad - wanted_rad) == pytest.approx(1.0, abs=1e-6)
    ends, inner = curve.control_m[[0, 3]], curve.control_m[[1, 2]]
    arm = (ends - inner)[1] if is_end else (inner - ends)[0]
    along_m = arm @ [math.cos(wanted_rad), math.sin(wanted_rad)]
    assert along_m >= 0.01 - 1e-9


@pytest.mark.parametrize("d_m", [0.0, 1.5, -1.5])
def test_what_drives_along_a_line_turns_evenly_and_leaves_its_ends_straight(d_m: float) -> None:
    line = curved_scene().lanes[0].centerline
    for s_m, turned in ((-5.0, 0.0), (0.0, 0.0), (80.0, 0.5)):
        pose = travel_pose(line, s_m, d_m)
        wanted = line.pose_at(s_m, d_m)
        assert pose.heading_rad == pytest.approx(turned, abs=0.01)
        assert math.dist((pose.x_m, pose.y_m), (wanted.x_m, wanted.y_m)) < 0.03
