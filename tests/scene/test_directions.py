from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from augment.geometry.polyline import Polyline
from augment.scene.entities import TrafficSide, TurnType
from augment.scene.lane_graph import traffic_side_of, turn_type_of
from tests.scenes import curve, scene


def arc(turn_rad: float) -> Polyline:
    angles = np.linspace(0.0, abs(turn_rad), 30)
    side = math.copysign(1.0, turn_rad)
    return Polyline(np.column_stack([np.sin(angles), side * (1.0 - np.cos(angles))]))


@pytest.mark.parametrize(
    ("turn_deg", "turn_type"),
    [
        (10, TurnType.STRAIGHT),
        (-25, TurnType.STRAIGHT),
        (35, TurnType.LEFT),
        (140, TurnType.LEFT),
        (-90, TurnType.RIGHT),
        (170, TurnType.U_TURN),
        (-200, TurnType.U_TURN),
    ],
)
def test_a_line_turns_as_far_as_its_bends_together(turn_deg: float, turn_type: TurnType) -> None:
    assert turn_type_of(arc(math.radians(turn_deg))) is turn_type


def test_people_drive_where_oncoming_lanes_are_on_the_other_side() -> None:
    lanes = scene().lanes
    assert traffic_side_of(lanes) is TrafficSide.RIGHT
    mirrored = [
        replace(lane, centerline=Polyline(lane.centerline.points_m * np.array([1.0, -1.0])))
        for lane in lanes
    ]
    assert traffic_side_of(mirrored) is TrafficSide.LEFT


def test_a_one_way_street_does_not_tell() -> None:
    assert traffic_side_of(curve().lanes) is None
