"""Plane shapes against answers that can be worked out by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from augment.render.shapes import dashes, long_axis, offset, resample_line, runs, stripes

SQUARE = np.array([[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]])


def test_an_offset_runs_beside_the_line_round_its_corner() -> None:
    line = np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0]])
    assert offset(line, 1.0) == pytest.approx(np.array([[0.0, 1.0], [9.0, 1.0], [9.0, 10.0]]))
    assert offset(line, -1.0) == pytest.approx(np.array([[0.0, -1.0], [11.0, -1.0], [11.0, 10.0]]))


def test_dashes_begin_at_the_start_and_end_with_the_line() -> None:
    pieces = dashes(np.array([[0.0, 0.0], [5.0, 0.0]]), 2.0, 1.0)
    assert pieces[:, :, 0].tolist() == [[0.0, 2.0], [3.0, 5.0]]


def test_a_line_is_cut_into_equal_pieces() -> None:
    line = np.array([[0.0, 0.0], [5.0, 0.0]])
    assert resample_line(line, 2.0)[:, 0] == pytest.approx([0.0, 5.0 / 3.0, 10.0 / 3.0, 5.0])


def test_runs_name_the_first_and_the_last_of_each() -> None:
    assert runs(np.array([True, True, False, True])) == [(0, 1), (3, 3)]
    assert runs(np.array([False])) == []


def test_stripes_cover_their_share_and_leave_the_middle_free() -> None:
    found = stripes(SQUARE, 0.0, 1.0, 0.5)
    assert len(found) == 4
    for stripe in found:
        assert np.ptp(stripe[:, 0]) == pytest.approx(4.0)
        assert np.ptp(stripe[:, 1]) == pytest.approx(0.5)
        assert not stripe[:, 1].min() < 2.0 < stripe[:, 1].max()


def test_the_long_axis_of_a_turned_rectangle() -> None:
    turned = math.radians(30.0)
    cos, sin = math.cos(turned), math.sin(turned)
    box = np.array([[0, 0], [6, 0], [6, 2], [0, 2]]) @ np.array([[cos, sin], [-sin, cos]])
    angle, length, width = long_axis(box)
    assert angle % math.pi == pytest.approx(turned)
    assert (length, width) == pytest.approx((6.0, 2.0))
