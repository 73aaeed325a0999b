from __future__ import annotations

from augment.prompts.vectors import control_points, lane_curves, short_names
from tests.scenes import curve, junction


def test_lanes_and_connectors_are_curves_that_know_their_neighbours() -> None:
    cross = junction()
    curves = lane_curves(cross, short_names(cross), 80.0)
    assert list(curves) == ["Lane1", "Lane2", "Lane3", "Connector1", "Connector2"]
    assert curves["Lane1"].after == ("Connector1", "Connector2")
    assert (curves["Lane3"].before, curves["Lane3"].after) == (("Connector2",), ())
    assert curves["Connector1"].width_m == 3.5


def test_pieces_of_one_lane_share_the_point_at_their_joint() -> None:
    bend = curve(12.0)
    (lane,) = lane_curves(bend, short_names(bend), 80.0).values()
    pieces = control_points(lane.lane)
    assert len(pieces) == len(lane.pieces) > 1
    assert pieces[0][-1] == pieces[1][0]
    assert {len(piece) for piece in pieces} <= {2, 4}
