import math

import numpy as np
import pytest

from augment.geometry.frames import difference
from augment.geometry.polyline import Polyline
from augment.scene.bezier_lanes import Tolerance, bezier_lane, piece_ids
from tests.scenes import curve, scene

WINDING = Polyline([(x, 12.0 * math.sin(x / 18.0)) for x in np.linspace(0.0, 200.0, 201).tolist()])


def test_a_straight_lane_is_one_piece() -> None:
    lane = bezier_lane(scene().lanes[0].centerline)
    (piece,) = lane.pieces
    control = piece.curve.control_m
    assert control[[0, 3]].tolist() == [[-50.0, 0.0], [100.0, 0.0]]
    assert lane.length_m == 150.0
    assert lane.error.position_m < 1e-9


def test_a_lane_that_one_cubic_cannot_follow_is_cut() -> None:
    lane = bezier_lane(WINDING)
    assert len(lane.pieces) > 1
    assert lane.error.position_m <= 0.1
    assert lane.error.heading_rad <= math.radians(3.0)


def test_pieces_join_in_place_heading_and_arc_length() -> None:
    lane = bezier_lane(WINDING)
    assert lane.pieces[0].start_m == 0.0
    assert lane.pieces[-1].end_m == WINDING.length_m
    for before, after in zip(lane.pieces[:-1], lane.pieces[1:], strict=True):
        joint_m = before.end_m
        assert after.start_m == joint_m
        assert before.curve.control_m[3].tolist() == after.curve.control_m[0].tolist()
        behind, ahead = lane.pose_at(joint_m - 1e-6), lane.pose_at(joint_m)
        assert math.hypot(ahead.x_m - behind.x_m, ahead.y_m - behind.y_m) < 1e-5
        assert abs(difference(ahead.heading_rad, behind.heading_rad)) < 1e-5


def test_a_place_along_the_pieces_is_that_place_along_the_centreline() -> None:
    lane = bezier_lane(WINDING)
    for s_m in np.linspace(0.0, WINDING.length_m, 400).tolist():
        assert math.dist(lane.position(s_m), WINDING.position(s_m)) < 0.1
        place = lane.project(*lane.position(s_m, 1.2))
        assert place.s_m == pytest.approx(s_m, abs=0.01)
        assert place.d_m == pytest.approx(1.2, abs=0.001)


def test_a_wider_tolerance_takes_fewer_pieces() -> None:
    wide = bezier_lane(WINDING, Tolerance(position_m=2.0, heading_rad=math.radians(10.0)))
    assert len(wide.pieces) < len(bezier_lane(WINDING).pieces)


def test_a_restless_line_keeps_its_error_and_says_so() -> None:
    corners = Polyline([(0.0, 0.0), (2.0, 1.6), (4.0, 0.0), (6.0, 1.6), (8.0, 0.0)])
    lane = bezier_lane(corners)
    assert min(piece.length_m for piece in lane.pieces) >= 0.999
    assert lane.error.heading_rad > math.radians(3.0)


def test_a_bend_has_its_own_heading_at_its_very_ends() -> None:
    line = curve().lanes[0].centerline
    bend = bezier_lane(line.between(60.0, line.length_m))
    assert bend.heading_at(0.0) == pytest.approx(0.0, abs=math.radians(0.5))
    assert bend.heading_at(bend.length_m) == pytest.approx(math.pi / 2, abs=math.radians(0.5))


def test_pieces_are_called_by_their_lane_and_a_letter() -> None:
    assert piece_ids("Lane3", 1) == ("Lane3",)
    assert piece_ids("Lane3", 2) == ("Lane3a", "Lane3b")
    assert piece_ids("Lane3", 28)[-3:] == ("Lane3z", "Lane3aa", "Lane3ab")
