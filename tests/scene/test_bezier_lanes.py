import math
from itertools import pairwise

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.scene.bezier_lanes import LanePiece, bezier_lane, piece_ids
from tests.scenes import curve, scene

WINDING = Polyline([(x, 12.0 * math.sin(x / 18.0)) for x in np.linspace(0.0, 200.0, 201).tolist()])


def errors(lane: tuple[LanePiece, ...]) -> tuple[float, float]:
    """The worst place and the worst heading of all pieces."""
    return max(piece.error[0] for piece in lane), max(piece.error[1] for piece in lane)


def test_a_straight_lane_is_one_piece() -> None:
    (piece,) = bezier_lane(scene().lanes[0].centerline)
    assert piece.curve.control_m[[0, 3]].tolist() == [[-50.0, 0.0], [100.0, 0.0]]
    assert (piece.length_m, piece.is_straight) == (150.0, True)
    assert piece.error[0] < 1e-9


def test_a_lane_that_one_cubic_cannot_follow_is_cut_and_joined_smoothly() -> None:
    lane = bezier_lane(WINDING)
    assert len(lane) > 1
    assert (np.array(errors(lane)) <= (0.1, math.radians(3.0))).all()
    assert (lane[0].start_m, lane[-1].end_m) == (0.0, WINDING.length_m)
    for before, after in pairwise(lane):
        assert after.start_m == before.end_m
        assert before.curve.control_m[3].tolist() == after.curve.control_m[0].tolist()
        turn = after.curve.headings(np.zeros(1)) - before.curve.headings(np.ones(1))
        assert np.cos(turn) == pytest.approx(1.0, abs=1e-9)


def test_a_restless_line_keeps_its_error_and_says_so() -> None:
    corners = Polyline([(0.0, 0.0), (2.0, 1.6), (4.0, 0.0), (6.0, 1.6), (8.0, 0.0)])
    lane = bezier_lane(corners)
    assert min(piece.length_m for piece in lane) >= 0.999
    assert errors(lane)[1] > math.radians(3.0)


def test_a_bend_has_its_own_heading_at_its_very_ends() -> None:
    line = curve().lanes[0].centerline
    bend = bezier_lane(line.between(60.0, line.length_m))
    start, end = bend[0].curve.headings(np.zeros(1)), bend[-1].curve.headings(np.ones(1))
    assert start == pytest.approx(0.0, abs=math.radians(0.5))
    assert end == pytest.approx(math.pi / 2, abs=math.radians(0.5))


def test_pieces_are_called_by_their_lane_and_a_letter() -> None:
    assert piece_ids("Lane3", 1) == ("Lane3",)
    assert piece_ids("Lane3", 2) == ("Lane3a", "Lane3b")
    assert piece_ids("Lane3", 28)[-3:] == ("Lane3z", "Lane3aa", "Lane3ab")
